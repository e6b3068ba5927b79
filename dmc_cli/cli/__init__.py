"""Run the command line: the only place that knows click, the terminal and the exit status.

One file per command, which is imported when the command is run or its help is asked for. A command turns
its options into settings, calls the library and prints what came back; what takes long to import is imported
inside it. So `dmc --help` answers at once.

lazy           commands, imported when they are run
group          errors to messages and exit status
signals        signals to exceptions
terminal       what is printed, escaped
light_nibabel  of nibabel no more than is asked for
parameters     arguments to values
sections       options under the headings of a help text
options/       the options that commands share, each from its settings field
convert, measure, mesh, compare, info, synth, reproduce, doctor, completion  a command each
comparison_table  the table of a comparison
templates      names of a batch's outputs
batch_file     a batch's options out of a TOML file
batch_plan     the items of a batch
batch          the command that runs them
isovalue       what to tell who gave no isovalue to measure against
labels         the surfaces of a label map
conversions    what an input becomes at each isovalue
progress       how far a run is
histogram      how many nodes have which value, drawn
description    volumes and installations as values that JSON can hold
summary/       reports and descriptions in a few lines
"""

import gc
import os
import sys
from contextlib import suppress
from typing import NoReturn

import click

from dmc_cli.cli.group import HELP_NAMES, DmcGroup, Failure
from dmc_cli.cli.lazy import LazyCommand
from dmc_cli.cli.signals import Stopped, die_on_signals, raise_on_signals
from dmc_cli.cli.terminal import open_closed_streams
from dmc_cli.version import VERSION


@click.group(cls=DmcGroup, context_settings={"help_option_names": HELP_NAMES, "show_default": True})
@click.version_option(VERSION, prog_name="dmc")
def dmc() -> None:
    """From a scan to a mesh in one command.

    Reads a volume, from files of scanners, microscopes or simulations or from a synthetic field, and writes
    its isosurface as a mesh, on CPU or CUDA. `dmc convert --help` lists the formats and the methods of
    contouring.

    \b
    Examples:
      dmc info scan.nii.gz
      dmc convert scan.nii.gz bone.ply -i 300
    """


_COMMANDS = {
    "convert": "Turn a volume into a mesh.",
    "info": "Describe a volume.",
    "synth": "Write a synthetic volume.",
    "measure": "Measure a mesh file.",
    "mesh": "Rework a mesh file: parts, formats, units, relaxation.",
    "compare": "Compare methods of contouring on a volume.",
    "reproduce": "Make the papers' tables again.",
    "batch": "Convert many inputs in one run.",
    "doctor": "Report versions, devices, codecs and the kernel cache.",
    "completion": "Print a shell's completion script.",
}
"""The commands in the order of the documents, and what `dmc --help` says of each."""

for command, short_help in _COMMANDS.items():
    dmc.add_command(LazyCommand(command, short_help))


_OBJECTS_BETWEEN_COLLECTIONS = 100_000
"""How many more objects than before let Python look for cycles: importing Warp makes half a million objects
that stay, and looking through them every few hundred, as is the default, takes a tenth of a short run."""


def main() -> None:
    """Run the command line as a program: signals and their exit status included."""
    from dmc_cli.cli.light_nibabel import import_nibabel_lightly

    open_closed_streams()
    os.environ.setdefault(
        "OPENBLAS_NUM_THREADS", "1"
    )  # NumPy's, which would make one thread per core as it loads
    import_nibabel_lightly()
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS, 10, 10)
    try:
        raise_on_signals()
        dmc()
    except Stopped as stop:  # before or after a command
        die_on_signals()
        with suppress(OSError):  # nobody reads it
            Failure(stop.message, stop.exit_status).show()
        status: object = stop.exit_status
    except SystemExit as end:
        status = end.code
    finally:
        die_on_signals()
    _leave(status)


def _leave(status: object) -> NoReturn:
    """End the process at once: taking Warp and its modules apart would cost a tenth of a short run."""
    if isinstance(status, int):
        try:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
        except OSError:
            pass  # Python tells it when it ends by itself
    sys.exit(status)  # type: ignore[arg-type]
