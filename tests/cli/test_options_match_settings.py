"""Every setting has an option of the same name, default and choices, and the reverse."""

from dataclasses import MISSING, fields
from typing import get_args, get_type_hints

import click
import pytest

from dmc_cli import mesh_formats, settings, volume_formats
from dmc_cli.cli import dmc
from dmc_cli.methods import METHODS, method_named, option_values

OF_COMMAND = {
    "convert": (
        settings.ReadSettings,
        settings.SurfaceSettings,
        settings.PartSettings,
        settings.MeshSettings,
        settings.OutputSettings,
        settings.ConvertSettings,
        settings.LabelSettings,
    ),
    "info": (settings.ReadSettings,),
    "synth": (settings.SynthSettings,),
    "measure": (settings.ReadSettings, settings.MeasureSettings),
    "reproduce": (settings.ReproduceSettings,),
}
REGISTERED = {
    (settings.ReadSettings, "input_format"): volume_formats.FORMATS,
    (settings.OutputSettings, "output_format"): mesh_formats.FORMATS,
    (settings.SurfaceSettings, "placement"): option_values("placement"),
    (settings.ReproduceSettings, "placement"): method_named("dmc").options["placement"],
}
"""Choices that no annotation has, but a registry."""

NOT_SETTINGS = {"input", "quiet", "verbose", "help", "as_json", "isovalue", "lists_isovalues", "figures"}
NOT_SETTINGS |= {"lists_components"}
GATHERED = {"read", "surface", "part", "mesh", "output", "share"}  # fields that are settings themselves
PAIRS = [
    (command, owner, field)
    for command, owners in OF_COMMAND.items()
    for owner in owners
    for field in fields(owner)
]


def parameters(command):
    return {parameter.name: parameter for parameter in dmc.commands[command].load().params}


@pytest.mark.parametrize(
    ("command", "owner", "field"), PAIRS, ids=[f"{c}-{o.__name__}-{f.name}" for c, o, f in PAIRS]
)
def test_every_setting_has_its_option(command, owner, field):
    if field.name in GATHERED:
        return
    option = parameters(command)[field.name]
    if isinstance(option, click.Argument):
        return
    default = None if field.default is MISSING else field.default
    assert option.default == default or (default is None and option.get_default(click.Context(dmc)) is None)
    if field.name == "method":  # the settings refuse others
        assert option.metavar == f"[{'|'.join(METHODS)}]"
    if isinstance(option.type, click.Choice):
        if (owner, field.name) in REGISTERED:
            assert tuple(option.type.choices) == tuple(REGISTERED[owner, field.name])
            return
        hint = get_type_hints(owner)[field.name]
        choices = (
            get_args(hint) if all(isinstance(c, str) for c in get_args(hint)) else get_args(get_args(hint)[0])
        )
        assert tuple(option.type.choices) == choices


@pytest.mark.parametrize("command", OF_COMMAND)
def test_every_option_fills_a_setting(command):
    known = {field.name for owner in OF_COMMAND[command] for field in fields(owner)} | NOT_SETTINGS
    assert set(parameters(command)) <= known


def test_a_batch_takes_every_option_of_convert():
    assert set(parameters("convert")) - set(parameters("batch")) == {"input", "path"}
    assert set(parameters("batch")) - set(parameters("convert")) == {"inputs", "output", "jobs", "junit"}


def test_the_synthetic_fields_are_those_that_can_be_made():
    from dmc_cli.volume_io.synthetic import FIELD_NAMES

    assert get_args(settings.SyntheticField) == FIELD_NAMES


def test_the_volume_formats_are_those_that_can_be_written():
    from dmc_cli.volume_io.volume_file import SUFFIXES

    assert set(get_args(settings.VolumeFormat)) == set(SUFFIXES.values())
