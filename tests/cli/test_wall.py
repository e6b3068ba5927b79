"""`--wall` of `convert` and `mesh`: how thick walls are, and that a print has none that is thinner."""

import json

import pytest

from dmc_cli.app.measurement import measure_file
from dmc_cli.settings import MeasureSettings

BALL = ("synth:sphere:24", "-i", 0, "--border", "closed")
"""A ball of radius 0.75 in the volume's unit."""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def report():
    with open("r.json", encoding="utf-8") as file:
        return json.load(file)


def test_the_report_has_what_measuring_the_file_finds(run):
    result = run("convert", *BALL, "a.ply", "--wall", 1.45, "--report", "r.json")
    assert result.exit_code == 0
    found = report()["thickness"]
    assert found["limit"] == 1.45
    assert 1.3 < found["min"] <= found["median"] < 1.55
    assert found == measure_file(MeasureSettings(mesh="a.ply", wall=1.45))["thickness"]
    assert f"thickness at least {found['min']:.3g}" in result.stderr
    assert run("mesh", "a.ply", "b.ply", "--wall", 1.45, "--report", "s.json").exit_code == 0
    with open("s.json", encoding="utf-8") as file:
        assert json.load(file)["thickness"] == found


@pytest.mark.parametrize("command", ["convert", "mesh"])
@pytest.mark.parametrize(("wall", "status"), [(1.0, 0), (2.0, 6)])
def test_a_print_has_no_wall_that_is_thinner(run, folder, command, wall, status):
    run("convert", *BALL, "a.ply")
    first = BALL if command == "convert" else ("a.ply",)
    words = ("--require", "print", "--wall", wall, "--report", "r.json")
    assert run(command, *first, "b.ply", *words).exit_code == status
    (verdict,) = report()["requirements"]
    assert verdict["parts"][-1]["require"] == f"thickness.min>={wall:g}"
    assert verdict["met"] is (status == 0)
    assert (folder / "b.ply").exists() is (status == 0)


@pytest.mark.parametrize("command", ["convert", "mesh"])
def test_walls_are_measured_where_something_is_required_of_them(run, command):
    run("convert", *BALL, "a.ply")
    first = BALL if command == "convert" else ("a.ply",)
    assert run(command, *first, "b.ply", "--require", "thickness.min>=1").exit_code == 0
    assert run(command, *first, "c.ply", "--require", "thickness.min>=2").exit_code == 6
    assert run(command, *first, "d.ply", "--report", "r.json").exit_code == 0
    assert report()["thickness"] is None


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--wall", 1), "nothing tells how thick walls are"),
        (("--wall", 0, "--report", "r.json"), "expected a positive length"),
        (("--wall", "inf", "--report", "r.json"), "expected a positive length"),
        (("--wall", 1, "--report", "r.json", "--labels", "all"), "leave them out with labels"),
    ],
)
def test_a_wall_that_will_not_do_is_refused(run, folder, words, told):
    result = run("convert", "synth:sphere:8", "a.ply", *words)
    assert (result.exit_code, told in result.stderr) == (2, True), result.stderr
    assert list(folder.iterdir()) == []
