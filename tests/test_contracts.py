"""The import contracts of pyproject.toml name every module that they are about: a new one is not left out."""

import pytest

from dmc_cli import mesh_formats, volume_formats
from dmc_cli.methods import METHODS
from tests.docs.readme import ROOT

tomllib = pytest.importorskip("tomllib")  # from Python 3.11 on

PACKAGE = ROOT / "dmc_cli"
TOOLS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]
CONTRACTS = {contract["name"]: contract for contract in TOOLS["importlinter"]["contracts"]}
ENTERED = " is entered by its __init__ alone"


def modules_in(folder):
    """The modules and packages that lie in a folder, by their full names."""
    name = ".".join(folder.relative_to(ROOT).parts)
    files = [path.stem for path in folder.glob("*.py") if path.stem not in ("__init__", "__main__")]
    return {f"{name}.{found}" for found in files} | packages_in(folder)


def packages_in(folder):
    """The packages alone."""
    name = ".".join(folder.relative_to(ROOT).parts)
    return {f"{name}.{path.parent.name}" for path in folder.glob("*/__init__.py")}


SHARED_STAGES = {f"dmc_cli.contouring.{name}" for name in ("dual_grid", "label_surfaces", "stages")}
"""Folders of contouring that are no method: what methods have in common, and surfaces of labels."""


def modules_of(folder, formats, keys):
    """The modules in a folder that have the functions of its formats."""
    places = {getattr(each, key) for each in formats.values() for key in keys} - {""}
    return {f"dmc_cli.{folder}.{place.partition(':')[0]}" for place in places}


def test_every_module_has_a_layer():
    layers = CONTRACTS["imports go one way: the data flow is the package"]["layers"]
    named = [name.strip() for layer in layers for name in layer.split("|")]
    assert sorted(named) == sorted(modules_in(PACKAGE))


def test_click_and_rich_are_forbidden_to_every_module_but_the_command_line():
    contract = CONTRACTS["only the command line knows click and rich"]
    assert sorted(contract["source_modules"]) == sorted(modules_in(PACKAGE) - {"dmc_cli.cli"})


def test_every_folder_below_the_command_line_is_entered_by_its_init():
    for folder in packages_in(PACKAGE) - {"dmc_cli.cli"}:
        contract = CONTRACTS[f"{folder.removeprefix('dmc_cli.')}/{ENTERED}"]
        assert contract["protected_modules"] == [f"{folder}.*"]
        assert contract["allowed_importers"] == [folder]


def test_every_folder_of_contouring_but_shared_ones_is_a_method_that_nobody_imports():
    contract = CONTRACTS["a method of contouring is imported by nobody, and so knows nothing of another"]
    folders = packages_in(PACKAGE / "contouring") - SHARED_STAGES
    assert sorted(contract["protected_modules"]) == sorted(folders)
    assert contract["allowed_importers"] == []
    assert {place.partition(":")[0] for place in METHODS.values()} == folders


@pytest.mark.parametrize(
    ("kind", "folder", "registry", "keys"),
    [
        ("volumes", "volume_io", volume_formats, ("layout", "read", "entries")),
        ("meshes", "mesh_io", mesh_formats, ("encode", "read")),
    ],
)
def test_every_format_is_independent_and_its_folder_closed(kind, folder, registry, keys):
    found = modules_of(folder, registry.FORMATS, keys)
    assert found <= set(CONTRACTS[f"a format of {kind} knows nothing of another"]["modules"])
    contract = CONTRACTS[f"a format of {kind} that is a folder{ENTERED}"]
    folders = packages_in(PACKAGE / folder)
    assert sorted(contract["allowed_importers"]) == sorted(folders)
    assert sorted(contract["protected_modules"]) == sorted(f"{each}.*" for each in folders)


def test_every_algorithm_on_meshes_has_a_place_among_the_others():
    layers = CONTRACTS["an algorithm on meshes knows nothing of another, but of those that it is built on"][
        "layers"
    ]
    named = {name.strip() for layer in layers for name in layer.split("|")}
    assert packages_in(PACKAGE / "processing") <= named
