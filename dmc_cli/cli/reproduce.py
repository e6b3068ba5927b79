"""Print the papers' tables with ours beside them: `dmc reproduce`."""

from typing import Any, get_args

import click

from dmc_cli.cli import options
from dmc_cli.cli.parameters import ChoiceList, complete_files
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.sections import SectionedCommand, SectionedOption
from dmc_cli.cli.terminal import echo_lines
from dmc_cli.methods import method_named
from dmc_cli.printable import json_text
from dmc_cli.settings import PaperTable, ReproduceSettings


@click.command(cls=SectionedCommand)
@options.setting(
    ReproduceSettings,
    "table",
    section="Tables",
    type=ChoiceList(get_args(PaperTable)),
    metavar="LIST",
    again=ChoiceList.again,
    help="The tables to make, as in 3,8; all without it.",
)
@options.setting(
    ReproduceSettings,
    "up_to",
    section="Tables",
    type=int,
    metavar="N",
    help="Leave out data sets with more nodes along an axis.",
)
@options.setting(
    ReproduceSettings,
    "placement",
    section="Tables",
    type=click.Choice(method_named("dmc").options["placement"]),
    help="Where the vertices lie; in the paper: sampled.",
)
@options.setting(
    ReproduceSettings,
    "scans",
    "--scan",
    section="Tables",
    multiple=True,
    metavar="NAME=FILE",
    help="A scan of table I of Schmitz et al. 2009: engine, bonsai, backpack or stent. Repeatable.",
)
@click.option(
    "--figures",
    cls=SectionedOption,
    section="Output",
    metavar="DIR",
    shell_complete=complete_files,
    help="Draw the papers' figures into this folder, as SVG and PNG; needs matplotlib.",
)
@options.json_option
@options.device_option
@options.threads_option
@options.verbosity_options
def reproduce(as_json: bool, figures: str | None, quiet: bool, verbose: int, **values: Any) -> None:
    """Make the tables of Grosso & Zint 2021 again: printed figure, found figure, difference and its reason.

    Only the synthetic data: their scans were never published. Tables 2, 4, 5 and 9 have times; theirs were
    taken on an RTX 2080 Ti. Table I is that of Schmitz et al. 2009, of scans that you have.

    \b
    Examples:
      dmc reproduce --up-to 64
      dmc reproduce --table 3,8 --up-to 128 --json
      dmc reproduce --table 8 --up-to 64 --figures figures
    """
    settings = options.gather(ReproduceSettings, values)
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        with progress.stage("loading"):
            from dmc_cli.reproduction import (
                drawn_data,
                gather_spreads,
                reproduce_tables,
                rows_as_json,
                rows_as_text,
            )

            if figures is not None:
                from dmc_cli.figures import draw_reproduction, prepare_figures

                drawn_data(settings)  # refused before the work, if at all
                prepare_figures(figures)
        rows = reproduce_tables(settings, progress)
        if figures is not None:
            draw_reproduction(gather_spreads(settings, progress), figures)
    if as_json:
        click.echo(json_text(rows_as_json(rows), indent=2))
    else:
        echo_lines(rows_as_text(rows))
