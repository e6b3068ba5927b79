"""Report what this installation can do: `dmc doctor`."""

import click

from dmc_cli.cli import options
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.sections import SectionedCommand
from dmc_cli.cli.summary import doctor_lines
from dmc_cli.cli.terminal import echo_lines
from dmc_cli.printable import json_text


@click.command(cls=SectionedCommand)
@click.option("--warm-up", is_flag=True, help="Compile all kernels now, for the CPU and the first GPU.")
@options.json_option
@options.verbosity_options
def doctor(warm_up: bool, as_json: bool, quiet: bool, verbose: int) -> None:
    """Report versions, devices, codecs and the kernel cache; with --warm-up compile all kernels.

    \b
    Examples:
      dmc doctor
      dmc doctor --warm-up
    """
    from dmc_cli.cli.description import diagnose

    if warm_up:
        from dmc_cli.app import compile_kernels

        with shown_progress(quiet=quiet, verbose=verbose) as progress:
            compile_kernels(progress)
    diagnosis = diagnose()
    if as_json:
        click.echo(json_text(diagnosis, indent=2))
    else:
        echo_lines(doctor_lines(diagnosis))
