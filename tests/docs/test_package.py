"""The public API and the map of the package are true."""

import ast
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

import dmc_cli
from dmc_cli.version import VERSION
from tests.docs.readme import README, ROOT

MAP = re.findall(r"^    (\w+) +\S", dmc_cli.__doc__, re.MULTILINE)
STAGES = re.findall(r"^\| \[\w+\]\(dmc_cli/(\w+)", README.read_text("utf-8"), re.MULTILINE)


def test_the_map_names_every_module_and_none_twice():
    modules = {module.name for module in pkgutil.iter_modules(dmc_cli.__path__)} - {"__main__"}
    assert set(MAP) == modules
    assert len(MAP) == len(set(MAP))


def test_the_readme_tells_the_stages_in_the_order_of_the_map():
    places = [MAP.index(stage) for stage in STAGES]
    assert len(places) > 5
    assert places == sorted(places)


@pytest.mark.parametrize("name", dmc_cli.__all__)
def test_every_public_name_is_there_and_has_a_docstring(name):
    value = getattr(dmc_cli, name)
    assert value.__doc__
    assert value.__name__ == name
    assert value.__module__.startswith("dmc_cli.")
    assert name in dir(dmc_cli)


def test_all_is_what_type_checkers_see():
    tree = ast.parse(Path(dmc_cli.__file__).with_suffix(".pyi").read_text("utf-8"))
    names = [alias.asname for node in tree.body for alias in node.names]
    assert sorted(dmc_cli.__all__) == sorted(names)


def test_the_version_is_the_one_to_cite():
    assert f"\nversion: {VERSION}\n" in (ROOT / "CITATION.cff").read_text("utf-8")


def test_other_names_are_not_there():
    with pytest.raises(AttributeError, match="attribute contour"):
        dmc_cli.contour  # noqa: B018


def test_importing_the_package_is_light():
    probe = "import sys, dmc_cli; print(*sorted({'warp', 'numpy', 'click'} & set(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", probe], capture_output=True, encoding="utf-8", check=True)
    assert run.stdout.strip() == ""
