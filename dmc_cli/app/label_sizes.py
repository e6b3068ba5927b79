"""Give shells of labels the size one wants, one by one: each is its own surface."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from dmc_cli.app.label_surfaces import LabelMesh, Shell
from dmc_cli.app.mesh_stages import Stages, decimate_stages, measure_size, repair_stages
from dmc_cli.array_types import Float64Array
from dmc_cli.mesh import connect, mesh_of_file
from dmc_cli.mesh_io import MeshFile
from dmc_cli.notices import Notice
from dmc_cli.progress import Stopwatch
from dmc_cli.runtime import Device
from dmc_cli.settings import LabelSettings
from dmc_cli.volume import Label


@dataclass(frozen=True)
class Resized:
    """A shell of another size, the report's sections `size` and `repair`, and what is told of it."""

    shell: Shell
    size: dict[str, Any]
    repair: dict[str, int]
    notices: tuple[Notice, ...]


def resize_shell(
    shell: Shell, label: Label, settings: LabelSettings, to_mm: Float64Array, device: Device, watch: Stopwatch
) -> Resized:
    """Return a shell of the size that is asked for.

    Args:
        shell: The shell.
        label: Whose it is.
        settings: With a size.
        to_mm: Maps differences of coordinates to millimetres, shape (3, 3).
        device: Where the work is done.
        watch: Times the stages.
    """
    mesh = connect(mesh_of_file(MeshFile(points=shell.points, faces=shell.faces), device))
    stages = Stages(mesh, None)
    del mesh
    decimate_stages(stages, settings.mesh, to_mm, watch, is_measured=settings.output.is_measured)
    repair_stages(stages, watch)
    measure_size(stages, watch)
    found = Shell(stages.mesh.positions.numpy(), stages.mesh.faces.numpy())
    notices = tuple(replace(n, sentence=f"label {label.number}: {n.sentence}") for n in stages.warnings)
    return Resized(found, stages.size, stages.repair, notices)


def tell_of_gaps(meshes: Sequence[LabelMesh]) -> tuple[Notice, ...]:
    """Return the warning that shells that touched have vertices of their own, if some did."""
    if not any((mesh.sides > 0).all(axis=1).any() for mesh in meshes):
        return ()
    return (
        Notice(
            "W-SHELLS-APART",
            "shells of labels that touch have vertices of their own where they did: each was given its size"
            " alone, and between them are gaps and overlaps as wide as the distances from the mesh before",
        ),
    )
