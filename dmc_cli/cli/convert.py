"""Convert a volume to a mesh: `dmc convert`."""

from collections import Counter
from typing import Any

import click

from dmc_cli.cli import options
from dmc_cli.cli.labels import are_of_labels, convert_labels
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.sections import SectionedCommand
from dmc_cli.cli.summary import echo_summaries
from dmc_cli.errors import SettingsError
from dmc_cli.isovalue_choices import isovalue_text
from dmc_cli.mesh_formats import FORMATS
from dmc_cli.printable import short_number
from dmc_cli.settings import ConvertSettings, ReadSettings


@click.command(cls=SectionedCommand)
@options.input_argument
@options.output_argument
@options.surface_options
@options.part_options
@options.label_options
@options.mesh_options
@options.read_options
@options.noise_options
@options.output_options
@options.run_options
@options.verbosity_options
def convert(input: str, path: str, quiet: bool, verbose: int, **values: Any) -> None:
    """Turn the volume INPUT into the mesh OUTPUT.

    INPUT is a file, packed or not, FILE:/DATASET of HDF5, a folder of DICOM or of images, a zip,
    synth:FIELD:N (for example synth:iwp:128), or - for standard input. OUTPUT is a mesh file, whose
    suffix tells the format, or - for standard output. Without -i the summary tells which isovalue
    was chosen, and which others there are. With several isovalues it is a template with
    {isovalue} in it, or one file of a format that has groups, such as OBJ; the input
    is read once. With --labels INPUT is a label map, and OUTPUT a
    template with {label} or {name} in it, or one file.

    \b
    Examples:
      dmc convert sample_data/dicom/head_ct skull.ply
      dmc convert sample_data/nrrd/tooth.nrrd tooth.ply -i 600
      dmc convert synth:iwp:128 iwp.obj -i 0 --report iwp.json
      dmc convert sample_data/nrrd/tooth.nrrd 'tooth_{isovalue}.ply' -i 500:900:200
      dmc convert sample_data/labels/tooth.seg.nrrd 'shells/{name}.ply' --labels all
    """
    if are_of_labels(values):
        convert_labels(input, path, values, quiet=quiet, verbose=verbose)
        return
    from dmc_cli.cli.conversions import conversion_of

    read = options.gather(ReadSettings, values)
    isovalues = options.isovalues_of(values)
    if len(isovalues) == 1 and "{isovalue" not in path:
        items, is_grouped = [conversion_of(input, values, read, isovalues[0], path)], False
    else:
        items, is_grouped = _several(input, path, values, read)
    reports: list[dict[str, Any]] = []
    try:
        with shown_progress(quiet=quiet, verbose=verbose) as progress:
            with progress.stage("loading"):
                from dmc_cli.app import ReadAhead

                ahead = ReadAhead(items[0])  # reads while Warp, which is most of the loading, is imported
                from dmc_cli.app import convert_each
            makes_folders = "{isovalue" in path
            each = convert_each(items, progress, ahead, as_groups=is_grouped, makes_folders=makes_folders)
            reports.extend(each)
    finally:  # of isovalues before one that failed, too
        if not quiet:
            echo_summaries(reports)


def _several(
    input: str, path: str, values: dict[str, Any], read: ReadSettings
) -> tuple[list[ConvertSettings], bool]:
    """Return the conversions at several isovalues, and whether they share one file with groups.

    Raises:
        SettingsError: Their files cannot be told apart.
    """
    from pathlib import Path

    from dmc_cli.app import refuse_overlaps
    from dmc_cli.cli.conversions import conversions_of

    counts = Counter(options.isovalues_of(values))
    for isovalue, count in counts.items():
        if count > 1:
            raise SettingsError(
                f"isovalue {_shown(isovalue)} was given {count} times; expected each once; leave the others"
                " out"
            )
    is_grouped = "{isovalue" not in path
    items = list(conversions_of(input, values | {"output": path}, read, base=Path(), one_mesh=is_grouped))
    if is_grouped:
        _check_groups(items[0], len(items))
    refuse_overlaps(items, one_mesh=is_grouped)
    return items, is_grouped


def _shown(isovalue: float | str | None) -> str:
    """Return an isovalue as it was given."""
    return short_number(isovalue) if isinstance(isovalue, float) else isovalue_text(isovalue)


def _check_groups(first: ConvertSettings, count: int) -> None:
    """Raise SettingsError unless one file can hold the meshes of several isovalues as groups."""
    from dmc_cli.mesh_io import choose_format

    output = first.output
    if FORMATS[choose_format(output.path, output.output_format)].holds_groups:
        return
    known = ", ".join(name for name, known in FORMATS.items() if known.holds_groups)
    raise SettingsError(
        f"{output.path} is one file for {count} isovalues; expected a template with {{isovalue}} in it, as in"
        f" 'mesh_{{isovalue}}.ply', or a format that has groups ({known}); change its name"
    )
