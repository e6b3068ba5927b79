"""List the components of a volume's object, as `dmc info --components` does."""

from collections.abc import Sequence
from typing import Any

from dmc_cli.field import upload_volume
from dmc_cli.parts import list_components
from dmc_cli.progress import SILENT, Progress
from dmc_cli.runtime import select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import Volume, intact


def list_object_components(
    volume: Volume, isovalues: Sequence[float], threads: int | None = None, progress: Progress = SILENT
) -> list[dict[str, Any]]:
    """Return the components of the nodes at or above each isovalue: how many, specks, the largest ones.

    Args:
        volume: The volume.
        isovalues: Levels in physical values.
        threads: CPU threads, all cores if None.
        progress: Who is told how far it is.
    """
    device = select_device("cpu", threads)
    with intact(volume.values, volume.path), progress.stage("components"):
        on_device = upload_volume(volume, device)
        return [
            {"isovalue": isovalue} | list_components(on_device, SurfaceSettings(isovalue=isovalue))
            for isovalue in isovalues
        ]
