"""Describe a volume: `dmc info`."""

from typing import Any

import click

from dmc_cli.cli import options
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.sections import SectionedCommand, SectionedOption
from dmc_cli.cli.summary import info_lines
from dmc_cli.cli.terminal import echo_lines
from dmc_cli.errors import SettingsError
from dmc_cli.printable import json_text
from dmc_cli.settings import ReadSettings


@click.command(cls=SectionedCommand)
@options.input_argument
@options.isovalues_option
@click.option(
    "--isovalues",
    "lists_isovalues",
    cls=SectionedOption,
    section="Surface",
    is_flag=True,
    help="List active cells, area and components over the range of values, or at the values of -i.",
)
@click.option(
    "--components",
    "lists_components",
    cls=SectionedOption,
    section="Surface",
    is_flag=True,
    help="List the components of what lies at or above each value of -i: nodes, volume and bounds.",
)
@options.read_options
@options.noise_options
@options.threads_option
@options.json_option
@options.verbosity_options
def info(
    input: str,
    lists_isovalues: bool,
    lists_components: bool,
    as_json: bool,
    quiet: bool,
    verbose: int,
    **values: Any,
) -> None:
    """Describe the volume INPUT: size, type, spacing, space, value range, series found.

    \b
    Examples:
      dmc info sample_data/nrrd/tooth.nrrd
      dmc info synth:iwp:64 --json
      dmc info sample_data/nrrd/tooth.nrrd --isovalues -i 200:1000:200
      dmc info sample_data/nrrd/tooth.nrrd --components -i 700
    """
    from dmc_cli.cli.description import describe

    settings = options.gather(ReadSettings, values)
    isovalues = options.isovalues_of(values)
    if isovalues != [None] and not (lists_isovalues or lists_components):
        raise SettingsError(
            "isovalues were given, but nothing to list of them; expected --isovalues or --components, too"
        )
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        description = describe(
            input,
            settings,
            progress,
            isovalues if lists_isovalues else None,
            isovalues if lists_components else None,
        )
    if as_json:
        click.echo(json_text(description, indent=2))
    else:
        echo_lines(info_lines(description))
