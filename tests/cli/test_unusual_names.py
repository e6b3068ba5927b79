"""Names that no disk takes, links in a circle, names that are no text: one message each."""

import json
import os

import numpy as np
import pytest

LONG = "x" * 300
OUTPUT = ["out.ply", "-i", "0"]
TORUS = ["convert", "synth:torus:12"]

CASES = [
    (["info", "{}"], 3),
    (["info", "{}", "--input-format", "dicom"], 3),
    (["info", "{}/scan.nii"], 3),
    (["convert", "{}", *OUTPUT], 3),
    (["convert", "{}", "out.ply"], 3),
    (["measure", "{}.ply"], 3),
    (["measure", "mesh.ply", "--volume", "{}", "-i", "0"], 3),
    ([*TORUS, "{}", "-i", "0", "--output-format", "ply"], 9),
    ([*TORUS, "{}/out.ply", "-i", "0"], 9),
    ([*TORUS, *OUTPUT, "--report", "{}"], 9),
    ([*TORUS, *OUTPUT, "--halfedges", "{}.npz"], 9),
    (["synth", "torus", "{}.nii", "--nodes", "12"], 9),
    (["batch", "{}", "-i", "0"], 8),
    (["batch", "synth:torus:12", "-i", "0", "-o", "{}.ply"], 8),
    (["batch", "{}.toml"], 2),
]


@pytest.fixture
def folder(tmp_path, monkeypatch, run):
    """Where `loop`, with any suffix, is a link to itself."""
    monkeypatch.chdir(tmp_path)
    for name in ("loop", "loop.ply", "loop.npz", "loop.nii", "loop.toml"):
        (tmp_path / name).symlink_to(name)
    return tmp_path


@pytest.mark.parametrize("name", [LONG, "loop"], ids=["long", "loop"])
@pytest.mark.parametrize(("words", "status"), CASES, ids=[" ".join(words) for words, _ in CASES])
def test_a_name_that_leads_nowhere_is_told(folder, run, name, words, status):
    if "mesh.ply" in words:
        assert run(*TORUS, "mesh.ply", "-i", 0).exit_code == 0
    before = sorted(os.listdir(folder))
    result = run(*[word.format(name) for word in words])
    assert result.exit_code == status, result.stderr
    assert result.stderr.count("Error: ") == 1
    assert "Traceback" not in result.output
    assert sorted(os.listdir(folder)) == before


def test_names_that_are_no_text_are_read_and_written(folder, run_process):
    scan, mesh, dump = (os.fsdecode(name) for name in (b"sc\xffan.npy", b"m\xffesh.obj", b"d\xff.npz"))
    report = os.fsdecode(b"r\xff.json")
    np.save(scan, np.random.default_rng(0).random((12, 12, 12)))
    words = ["convert", scan, mesh, "-i", "0.5", "--report", report, "--halfedges", dump]
    result = run_process(*words, cwd=folder)
    assert result.returncode == 0, result.stderr
    found = json.loads((folder / report).read_text("utf-8"))
    assert found["input"]["path"] == scan
    assert {scan, mesh, dump, report} <= set(os.listdir(folder))
    outcome = run_process("batch", scan, "-i", "0.5", cwd=folder)
    assert outcome.returncode == 0, outcome.stderr
    assert json.loads(outcome.stdout)["output"] in os.listdir(folder)
