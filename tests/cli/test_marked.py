"""`--marked` of `convert`, `batch` and `mesh`: faces that are to blame, also of a mesh that is refused."""

import json

import pytest

from dmc_cli.mesh_io import read_mesh

OPEN = ("synth:iwp:12", "-i", 0)
"""A surface that ends at the volume's border."""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def blame(path):
    return read_mesh(str(path)).face_values["unmet"]


@pytest.mark.parametrize("suffix", ["ply", "vtp", "vtu", "vtk"])
def test_what_is_refused_is_marked_and_not_written(run, folder, suffix):
    words = ("--require", "closed,all-quads", "--marked", f"m.{suffix}", "--report", "r.json")
    assert run("convert", *OPEN, "a.ply", *words).exit_code == 6
    assert not (folder / "a.ply").exists()
    found, _ = json.loads((folder / "r.json").read_text())["requirements"]
    counts = blame(f"m.{suffix}")
    assert set(counts.tolist()) == {0, 1}
    assert counts.nonzero()[0].tolist()[: len(found["faces"])] == found["faces"]
    assert counts.sum() == found["face_count"]


def test_what_is_met_marks_nothing(run, folder):
    words = ("--border", "closed", "--require", "closed", "--marked", "m.ply")
    assert run("convert", *OPEN, "a.ply", *words).exit_code == 0
    assert (folder / "a.ply").exists()
    assert not blame("m.ply").any()


def test_a_dry_run_writes_none(run, folder):
    assert (
        run("convert", *OPEN, "a.ply", "--require", "closed", "--marked", "m.ply", "--dry-run").exit_code == 6
    )
    assert list(folder.iterdir()) == []


def test_a_batch_has_a_file_an_item_and_makes_its_folder(run, folder):
    words = ("-o", "{stem}.ply", "--require", "closed", "--marked", "marks/{stem}.vtp")
    assert run("batch", "synth:iwp:12", "synth:sphere:12", "-i", 0, *words).exit_code == 8
    assert blame("marks/synth_iwp_12.vtp").any()
    assert not blame("marks/synth_sphere_12.vtp").any()


def test_a_mesh_that_is_reworked_is_marked_as_it_would_be_written(run, folder):
    run("convert", *OPEN, "a.ply")
    words = ("a.ply", "b.ply", "--unit", "um", "--require", "closed", "--marked", "m.ply")
    assert run("mesh", *words).exit_code == 6
    assert not (folder / "b.ply").exists()
    assert blame("m.ply").any()
    assert read_mesh("m.ply").unit == "um"


@pytest.mark.parametrize("command", ["convert", "mesh"])
@pytest.mark.parametrize(
    ("words", "status", "told"),
    [
        (("--require", "closed", "--marked", "m.obj"), 2, "hold none"),
        (("--marked", "m.ply"), 2, "nothing is required"),
        (("--require", "closed", "--marked", "out.ply", "--force"), 2, "out.ply"),
        (("--require", "closed", "--marked", "in.ply", "--force"), 2, "in.ply"),
        (("--require", "closed", "--marked", "no/m.ply"), 9, "does not exist"),
    ],
)
def test_a_name_that_will_not_do_is_refused_before_the_work(run, folder, command, words, status, told):
    run("convert", *OPEN, "in.ply")
    before = (folder / "in.ply").read_bytes()
    first = ("in.ply",) if command == "mesh" else OPEN
    if command == "convert" and "in.ply" in words:
        words = tuple("out.ply" if word == "in.ply" else word for word in words)
        told = "out.ply"
    result = run(command, *first, "out.ply", *words)
    assert (result.exit_code, told in result.stderr) == (status, True), result.stderr
    assert [path.name for path in folder.iterdir()] == ["in.ply"]
    assert (folder / "in.ply").read_bytes() == before


def test_labels_have_no_marks(run, folder):
    result = run(
        "convert", "synth:sphere:8", "a.ply", "--labels", "all", "--require", "closed", "--marked", "m.ply"
    )
    assert (result.exit_code, "leave them out with labels" in result.stderr) == (2, True)
