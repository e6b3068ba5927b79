"""The forecast beside what a convert takes: ten volumes, all sets of options, at most a fifth off."""

import json
import subprocess
import sys

import pytest

from dmc_cli.methods import METHODS
from tests.memory.peaks import Peaks, can_measure
from tests.memory.volumes import VOLUMES, noise

OPTIONS = {
    "plain": [],
    "no normals": ["--no-normals"],
    "text": ["--ascii"],
    "OBJ": ["--output-format", "obj"],
    "OFF": ["--output-format", "off"],
    "halfedges": ["--halfedges", "HALFEDGES.npz"],
    "report": ["--report", "REPORT.json"],
    "check": ["--check", "--dry-run"],
    "3x3y": ["--simplify", "3x3y"],
    "3333": ["--simplify", "3333", "--no-normals"],
    "all": ["--simplify", "all", "--report", "REPORT.json"],
    "paper": ["--simplify", "all", "--simplify-rules", "paper", "--topology", "asymptotic"],
    "sampled": ["--placement", "sampled"],
    "iterative": ["--placement", "iterative", "--dry-run"],
    "relax 1": ["--relax", "1"],
}
"""Sets of options for every volume."""

SLOW_OPTIONS = {
    "halfedge text": ["--halfedges", "HALFEDGES.txt"],
    "relax 3": ["--relax", "3", "--no-normals"],
    "more": ["--remesh", "1"],
    "quads": ["--quads", "50%"],
    "quads, told": ["--quads", "50%", "--report", "REPORT.json"],
    "bound": ["--quads", "50%", "--max-error", "1"],
    "everything": [
        *["--remesh", "1", "--relax", "1", "--halfedges", "HALFEDGES.npz"],
        *["--check", "--report", "REPORT.json", "--ascii"],
    ],
}
"""Sets of options for one volume."""

MOST = 1.2
"""How far a forecast may be from the peak, either way."""


@pytest.fixture(scope="module")
def measure():
    """Return what runs a convert in a process of its own and returns its peaks."""
    if not can_measure():
        pytest.skip("this system does not tell the peak of a process's memory, or does not set it back")
    command = [sys.executable, "-m", "tests.memory.peaks", "--serve"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as server:

        def ask(words):
            print(json.dumps([str(word) for word in words]), file=server.stdin, flush=True)
            answer = json.loads(server.stdout.readline())
            assert "error" not in answer, answer["error"]
            return Peaks(**answer)

        yield ask
        server.stdin.close()


def row(measure, path, case, options, folder):
    """Return the last forecast and the peak of a convert, in MiB."""
    folder.mkdir(exist_ok=True)
    options = [word.replace("HALFEDGES", f"{folder}/h").replace("REPORT", f"{folder}/r") for word in options]
    words = ["convert", path, folder / "mesh.ply", *case.options, *options, "--force", "--quiet"]
    peaks = measure(words)
    return max(peaks.forecasts[-1].values()) / 2**20, peaks.peak / 2**20


def test_a_few_forecasts_are_near_the_peak(measure, tmp_path):
    case = VOLUMES["white noise"]
    path = case.write(tmp_path / "volume", noise((80, 80, 80)))
    for key in ("plain", "OBJ", "halfedges"):
        told, peak = row(measure, path, case, OPTIONS[key], tmp_path / "out")
        assert 1 / MOST <= told / peak <= MOST, key


@pytest.mark.parametrize(("method", "key"), [("mc", "plain"), ("nets", "report")])
def test_a_few_forecasts_of_other_methods_are_near_the_peak(measure, tmp_path, method, key):
    """Triangles are counted, and vertices with several fans sorted out, without copies of the faces."""
    case = VOLUMES["white noise"]
    path = case.write(tmp_path / "volume", noise((100, 100, 100)))
    told, peak = row(measure, path, case, [*OPTIONS[key], "--method", method], tmp_path / "out")
    assert 1 / MOST <= told / peak <= MOST


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("method", [name for name in METHODS if name != "dmc"])
@pytest.mark.parametrize("name", ["white noise", "smooth, mapped", "doubles without data", "flat, closed"])
def test_the_forecast_of_other_methods_is_near_the_peak(name, method, measure, tmp_path):
    case = VOLUMES[name]
    path = case.write(tmp_path / "volume", case.values())
    rows = {
        key: row(measure, path, case, [*OPTIONS[key], "--method", method], tmp_path / "out")
        for key in ("plain", "no normals", "OBJ", "halfedges", "report", "check")
    }
    wrong = {key: found for key, found in rows.items() if not 1 / MOST <= found[0] / found[1] <= MOST}
    assert not wrong


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", VOLUMES)
def test_the_forecast_is_near_the_peak(name, measure, tmp_path):
    case = VOLUMES[name]
    path = case.write(tmp_path / "volume", case.values())
    slow = SLOW_OPTIONS if name == "shorts, compressed" else {}
    rows = {
        key: row(measure, path, case, options, tmp_path / "out")
        for key, options in {**OPTIONS, **slow}.items()
    }
    lines = [
        f"{key:13} forecast {told:6.0f} MiB, peak {peak:6.0f}: {told / peak:.2f}"
        for key, (told, peak) in rows.items()
    ]
    print("\n".join([name, *lines]))
    wrong = [told for told, peak in rows.values() if not 1 / MOST <= told / peak <= MOST]
    assert not wrong, "\n".join(lines)
