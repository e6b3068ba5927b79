"""Convert the labels of a label map: `dmc convert --labels`."""

from collections.abc import Collection
from typing import Any

import click
from click.core import ParameterSource

from dmc_cli.cli import options
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.summary import label_lines
from dmc_cli.cli.terminal import echo_lines
from dmc_cli.errors import SettingsError
from dmc_cli.settings import SIZES, LabelSettings, MeshSettings, OutputSettings, PartSettings, ReadSettings

_OF_ISOVALUES = {"Surface", "Mesh"}
"""Sections of options that are of a surface at an isovalue."""


def convert_labels(input: str, path: str, values: dict[str, Any], *, quiet: bool, verbose: int) -> None:
    """Make the surfaces of labels, and print a summary; the arguments are those of the command.

    Raises:
        SettingsError: An option was given that has no effect on labels.
    """
    context = click.get_current_context()
    refuse_others(context, given_options(context))
    settings = label_settings(input, path, values, options.gather(ReadSettings, values))
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        with progress.stage("loading"):
            from dmc_cli.app import convert_labels as run
        result = run(settings, progress)
    if not quiet:
        echo_lines(label_lines(result.report), err=True)


def are_of_labels(values: dict[str, Any]) -> bool:
    """Return whether options ask for the surfaces of labels."""
    return any(values.get(name) for name in ("labels", "conforming", "label_names"))


def label_settings(input: str, path: str, values: dict[str, Any], read: ReadSettings) -> LabelSettings:
    """Return the conversion of the labels of an input to a file or a template."""
    return options.gather(
        LabelSettings,
        values,
        input=input,
        read=read,
        part=options.gather(PartSettings, values),
        mesh=options.gather(MeshSettings, {name: values.get(name) for name in SIZES}),
        output=options.gather(OutputSettings, values, path=path),
    )


def given_options(context: click.Context) -> set[str]:
    """Return the names of the options that were given."""
    names = {parameter.name for parameter in context.command.params if parameter.name is not None}
    return {name for name in names if context.get_parameter_source(name) is not ParameterSource.DEFAULT}


def refuse_others(context: click.Context, given: Collection[str]) -> None:
    """Raise SettingsError if an option of surfaces at isovalues is among those that were given."""
    for parameter in context.command.params:
        is_of_isovalues = getattr(parameter, "section", "") in _OF_ISOVALUES and parameter.name not in SIZES
        if is_of_isovalues and parameter.name in given:
            raise SettingsError(
                f"{parameter.opts[-1]} was given with labels, but it is of the surface at an isovalue; leave"
                " one of the two out"
            )
