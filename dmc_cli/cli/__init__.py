"""The command line: the only place that knows click, the terminal and the exit status.

One file a command. A command turns its options into settings, calls the library and prints what
came back; what takes long to import is imported inside it, so that `dmc --help` answers at once.
"""

import sys

import click

from dmc_cli.cli import batch, completion, convert, doctor, info, measure, reproduce, synth
from dmc_cli.cli.group import DmcGroup
from dmc_cli.cli.signals import Stopped, die_on_signals, raise_on_signals


@click.group(cls=DmcGroup, context_settings={"help_option_names": ["-h", "--help"], "show_default": True})
@click.version_option(package_name="dmc-cli", prog_name="dmc")
def dmc() -> None:
    """From a scan to a quad mesh in one command.

    Reads a CT or MR volume (DICOM, NIfTI, NRRD, MetaImage, raw) or a synthetic field and writes its
    isosurface as quadrilaterals only, by dual marching cubes on CPU or CUDA.

    \b
    Examples:
      dmc info scan.nii.gz
      dmc convert scan.nii.gz bone.ply -i 300
    """


for command in (
    convert.convert,
    info.info,
    synth.synth,
    measure.measure,
    reproduce.reproduce,
    batch.batch,
    doctor.doctor,
    completion.completion,
):
    dmc.add_command(command)


def main() -> None:
    """Run the command line as a program: signals and their exit status included."""
    try:
        raise_on_signals()
        dmc()
    except Stopped as stop:  # before or after a command
        sys.exit(stop.exit_status)
    finally:
        die_on_signals()
