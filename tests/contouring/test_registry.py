"""The methods of the registry are those that the settings and the command line know."""

from typing import get_args

import pytest

from dmc_cli import settings
from dmc_cli.contouring import METHODS, kernel_modules
from dmc_cli.errors import SettingsError


def test_every_method_is_a_choice_and_the_reverse():
    assert tuple(METHODS) == get_args(settings.Method)
    assert settings.SurfaceSettings(isovalue=0.0).method == "dmc"


@pytest.mark.parametrize("name", METHODS)
def test_a_method_says_what_it_is_and_needs(name):
    method = METHODS[name]
    assert method.title
    assert set(method.kernels("exact")) <= set(kernel_modules(method=name))


def test_other_methods_are_refused_with_the_list(run, tmp_path):
    result = run("convert", "synth:torus:8", tmp_path / "a.ply", "-i", 0, "--method", "cubes")
    assert result.exit_code == 2
    assert "'cubes'" in result.stderr
    assert all(f"'{name}'" in result.stderr for name in METHODS)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(SettingsError, match="method is 'cubes'"):
        settings.SurfaceSettings(isovalue=0.0, method="cubes")


def test_the_report_names_the_method(run, tmp_path):
    import json

    words = ("-i", 0, "--method", "dmc", "--report", tmp_path / "a.json")
    assert run("convert", "synth:torus:8", tmp_path / "a.ply", *words).exit_code == 0
    assert json.loads((tmp_path / "a.json").read_text())["surface"]["method"] == "dmc"
