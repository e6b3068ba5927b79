"""Compare methods of contouring on a volume: `dmc compare`."""

from typing import Any

import click

from dmc_cli.cli import options
from dmc_cli.cli.comparison_table import csv_table, markdown_table, text_table
from dmc_cli.cli.parameters import Isovalue, NameList, complete_files
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.sections import SectionedCommand, SectionedOption
from dmc_cli.cli.terminal import echo_lines
from dmc_cli.methods import METHODS
from dmc_cli.printable import json_text
from dmc_cli.settings import CompareSettings, ReadSettings


@click.command(cls=SectionedCommand)
@options.input_argument
@options.setting(
    CompareSettings,
    "isovalue",
    "-i",
    "--isovalue",
    section="Comparison",
    type=Isovalue(),
    help=options.ISOVALUE_HELP,
)
@options.setting(
    CompareSettings,
    "methods",
    section="Comparison",
    type=NameList(),
    metavar="LIST",
    again=NameList.again,
    help=f"Which methods, as in dmc,dc:particle; all without it: {', '.join(METHODS)}.",
)
@options.setting(
    CompareSettings, "inside", section="Comparison", help="The side of the isovalue that is the object."
)
@options.setting(
    CompareSettings,
    "border",
    section="Comparison",
    help="Leave the meshes open at the volume's border, or close them.",
)
@options.setting(
    CompareSettings,
    "repeats",
    section="Comparison",
    type=int,
    metavar="N",
    help="Extract each surface N times; the least time counts.",
)
@click.option(
    "--format",
    "table_format",
    cls=SectionedOption,
    section="Output",
    type=click.Choice(["text", "json", "csv", "markdown"]),
    default="text",
    help="How the table is written.",
)
@click.option(
    "--figures",
    cls=SectionedOption,
    section="Output",
    metavar="DIR",
    shell_complete=complete_files,
    help="Draw the papers' figures into this folder, as SVG and PNG; needs matplotlib.",
)
@options.read_options
@options.noise_options
@options.device_option
@options.threads_option
@options.verbosity_options
def compare(
    input: str, table_format: str, figures: str | None, quiet: bool, verbose: int, **values: Any
) -> None:
    """Compare methods of contouring on the volume INPUT: counts, time, memory, shape, topology.

    A method is a name, behind a colon the value of one of its options, and +simplify for its quads without
    the papers' patterns. Times are of extraction alone, from values in memory to a mesh in memory; memory is
    what arrays take beside the volume. Dual marching cubes forms no tunnels inside a cell: how many the
    trilinear surface has, and where, is told. JSON has all that a report has of each mesh besides.

    \b
    Examples:
      dmc compare sample_data/nrrd/tooth.nrrd -i 500
      dmc compare synth:genus_two:64 -i 0.001 --methods dmc,dmc:centroid --format markdown
    """
    read = options.gather(ReadSettings, values)
    settings = options.gather(CompareSettings, values, input=input, read=read)
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        with progress.stage("loading"):
            from dmc_cli.app import compare_methods

            if figures is not None:
                from dmc_cli.figures import draw_figures, prepare_figures

                prepare_figures(figures)
        comparison = compare_methods(settings, progress)
        if figures is not None:
            with progress.stage("drawing"):
                draw_figures(comparison, figures)
    if table_format == "json":
        click.echo(json_text(comparison.report(), indent=2))
    elif table_format == "csv":
        click.echo(csv_table(comparison.rows()), nl=False)
    else:
        table = text_table if table_format == "text" else markdown_table
        echo_lines(table(comparison.rows(), comparison.tunnels()))
