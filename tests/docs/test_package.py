"""The public API and the map of the package are true."""

import ast
import json
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

import dmc_cli
from dmc_cli.contouring import dual_marching_cubes, stages as shared_stages
from dmc_cli.version import VERSION
from tests.docs.readme import README, ROOT

MAP = re.findall(r"^    (\w+) +\S", dmc_cli.__doc__, re.MULTILINE)
STAGES = re.findall(r"^\| \[(\w+)\]\(dmc_cli/\w+", README.read_text("utf-8"), re.MULTILINE)
TIMED = {
    **{"volume_io": "read", "classification": "surface", "halfedges": "halfedges", "coloring": "coloring"},
    **{
        "patterns": "simplify",
        "remeshing": "remesh",
        "decimation": "size",
        "relaxation": "relax",
        "normals": "normals",
    },
    **{"measures": "report", "mesh_io": "write"},
}
"""Stages of the README, by what a report calls the time that they take."""


def test_the_map_names_every_module_and_none_twice():
    modules = {module.name for module in pkgutil.iter_modules(dmc_cli.__path__)} - {"__main__"}
    assert set(MAP) == modules
    assert len(MAP) == len(set(MAP))


def test_the_readme_tells_the_stages_in_the_order_in_which_a_run_takes_them(tmp_path, run):
    path = tmp_path / "report.json"
    words = [
        "--halfedges",
        tmp_path / "a.npz",
        "--remesh",
        1,
        "--quads",
        "90%",
        "--relax",
        1,
        "--report",
        path,
    ]
    assert run("convert", "synth:sphere:12", tmp_path / "a.ply", "-i", 0, *words).exit_code == 0
    timed = list(json.loads(path.read_text())["timings_ms"])
    timed.remove("report")  # the mesh is measured before it is changed, too
    told = [TIMED[stage] for stage in STAGES if stage in TIMED]
    assert set(told) == set(TIMED.values())
    assert [stage for stage in told if stage != "report"] == [stage for stage in timed if stage in told]
    assert told[-3:] == ["normals", "report", "write"]


def test_the_readme_tells_the_stages_of_the_surface_in_the_order_of_its_folder():
    listed = re.findall(r"^(\w+) ", shared_stages.__doc__ + dual_marching_cubes.__doc__, re.MULTILINE)
    stages = [stage for stage in STAGES if stage in listed and stage != "coloring"]
    assert len(stages) == 5
    assert stages == sorted(stages, key=listed.index)


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
