"""Write a synthetic volume to a file: `dmc synth`."""

from typing import Any, get_args

import click

from dmc_cli.cli import options
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.sections import SectionedCommand
from dmc_cli.cli.terminal import echo_lines
from dmc_cli.settings import ReadSettings, SyntheticField, SynthSettings


@click.command(cls=SectionedCommand)
@click.argument("field", type=click.Choice(get_args(SyntheticField)))
@options.output_argument
@options.setting(
    SynthSettings, "nodes", "-n", "--nodes", section="Field", type=int, help="Nodes along each axis."
)
@options.noise_options
@options.setting(
    SynthSettings, "output_format", section="Output", help="The format, where the suffix does not tell."
)
@options.force_option
@options.verbosity_options
def synth(quiet: bool, verbose: int, **values: Any) -> None:
    """Write the synthetic volume FIELD to OUTPUT: .nii, .nii.gz, .nrrd, .mha or .raw.

    The field lies on [-1,1]^3 and is stored as float32.

    \b
    Examples:
      dmc synth iwp iwp.nrrd -n 128
      dmc synth noise noise.nii.gz -n 64 --seed 7 --sigma 2
    """
    from dmc_cli.files import check_output
    from dmc_cli.volume_io import choose_volume_format, read_volume, write_volume

    settings = options.gather(SynthSettings, values)
    choose_volume_format(settings.path, settings.output_format)
    check_output(settings.path, force=settings.force)
    read = options.gather(ReadSettings, values)
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        volume = read_volume(f"synth:{settings.field}:{settings.nodes}", read, progress)
        with progress.stage("writing"):
            write_volume(settings.path, volume, output_format=settings.output_format, force=settings.force)
    if not quiet:
        low, high = volume.value_range() or (0.0, 0.0)
        told = f"{settings.path}: {settings.nodes}^3 nodes, values {low:g} to {high:g}"
        echo_lines([told], err=True)
