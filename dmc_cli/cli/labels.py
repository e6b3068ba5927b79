"""Convert the labels of a label map: `dmc convert --labels`."""

from typing import Any

import click
from click.core import ParameterSource

from dmc_cli.cli import options
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.summary import label_lines
from dmc_cli.cli.terminal import echo_lines
from dmc_cli.errors import SettingsError
from dmc_cli.settings import LabelSettings, OutputSettings, PartSettings, ReadSettings

_OF_ISOVALUES = {"Surface", "Mesh"}
"""Sections of options that are of a surface at an isovalue."""


def convert_labels(input: str, path: str, values: dict[str, Any], *, quiet: bool, verbose: int) -> None:
    """Make the surfaces of labels, and print a summary; the arguments are those of the command.

    Raises:
        SettingsError: An option was given that has no effect on labels.
    """
    _refuse_others(click.get_current_context())
    settings = options.gather(
        LabelSettings,
        values,
        input=input,
        read=options.gather(ReadSettings, values),
        part=options.gather(PartSettings, values),
        output=options.gather(OutputSettings, values, path=path),
    )
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        with progress.stage("loading"):
            from dmc_cli.app import convert_labels as run
        result = run(settings, progress)
    if not quiet:
        echo_lines(label_lines(result.report), err=True)


def _refuse_others(context: click.Context) -> None:
    """Raise SettingsError if an option of surfaces at isovalues was given."""
    for parameter in context.command.params:
        if getattr(parameter, "section", "") not in _OF_ISOVALUES or parameter.name is None:
            continue
        if context.get_parameter_source(parameter.name) is not ParameterSource.DEFAULT:
            raise SettingsError(
                f"{parameter.opts[-1]} was given with labels, but it is of the surface at an isovalue; leave"
                " one of the two out"
            )
