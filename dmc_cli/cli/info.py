"""Describe a volume: `dmc info`."""

from typing import Any

import click

from dmc_cli.cli import options
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.sections import SectionedCommand
from dmc_cli.cli.summary import info_lines
from dmc_cli.cli.terminal import echo_lines
from dmc_cli.printable import json_text
from dmc_cli.settings import ReadSettings


@click.command(cls=SectionedCommand)
@options.input_argument
@options.read_options
@options.noise_options
@options.threads_option
@options.json_option
@options.verbosity_options
def info(input: str, as_json: bool, quiet: bool, verbose: int, **values: Any) -> None:
    """Describe the volume INPUT: size, type, spacing, space, value range, series found.

    \b
    Examples:
      dmc info sample_data/nrrd/tooth.nrrd
      dmc info synth:iwp:64 --json
    """
    from dmc_cli.cli.description import describe

    settings = options.gather(ReadSettings, values)
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        description = describe(input, settings, progress)
    if as_json:
        click.echo(json_text(description, indent=2))
    else:
        echo_lines(info_lines(description))
