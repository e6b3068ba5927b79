"""Convert an input at several isovalues, reading it once: a file for each, or one with a group for each."""

from collections.abc import Iterator, Sequence
from typing import Any

from dmc_cli.app.conversion import convert, make_mesh
from dmc_cli.app.kept_volume import KeptVolume
from dmc_cli.app.output_folders import OutputFolders
from dmc_cli.app.read_ahead import ReadAhead
from dmc_cli.app.writing import finish
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ConvertSettings


def convert_each(
    items: Sequence[ConvertSettings],
    progress: Progress = SILENT,
    ahead: ReadAhead | None = None,
    *,
    as_groups: bool = False,
    makes_folders: bool = False,
) -> Iterator[dict[str, Any]]:
    """Yield the report of each conversion once its files are written.

    Args:
        items: What to convert; items with the same input that follow each other read it once.
        progress: Who is told the stages.
        ahead: The reading of the first input where it has begun already.
        as_groups: The items differ in the isovalue, and in the files of halfedges and reports, and share one
            mesh file, with a group for each; it is written when all are made.
        makes_folders: Folders of the outputs that are not there are made.

    Raises:
        DmcError: As `convert`, of the first item that fails; files of those before stay, but of groups none.
    """
    kept = KeptVolume(items)
    first = [ahead, *[None] * (len(items) - 1)]
    if as_groups:
        made = [make_mesh(item, progress, begun, kept) for item, begun in zip(items, first, strict=True)]
        finish(made)
        yield from (one.report for one in made)
        return
    with OutputFolders() as folders:
        for item, begun in zip(items, first, strict=True):
            if makes_folders:
                folders.make(item)
            yield convert(item, progress, begun, kept).report
