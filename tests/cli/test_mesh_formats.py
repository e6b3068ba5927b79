"""Every format of meshes as its users meet it: by suffix, to standard output, with warnings, and measured."""

import json

import numpy as np
import pytest

from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io.read import read_mesh
from tests.mesh_io.layouts import LAYOUTS

SPHERE = ("convert", "synth:sphere:14", "-i", 0.1)


@pytest.mark.parametrize(("name", "ascii"), LAYOUTS)
def test_a_format_is_chosen_told_and_measured(run, tmp_path, name, ascii):
    path, report = tmp_path / f"a{FORMATS[name].suffix.upper()}", tmp_path / "r.json"
    text = ["--ascii"] if ascii else []
    assert run(*SPHERE, path, *text, "--report", report).exit_code == 0
    told = json.loads(report.read_text())
    assert ("W-QUADS-SPLIT" in told["warning_codes"]) == (not FORMATS[name].holds_quads)
    assert told["settings"]["normals"] == FORMATS[name].holds_normals
    assert "W-NORMALS-LEFT-OUT" not in told["warning_codes"]
    measured = json.loads(run("measure", path, "--json").stdout)
    counts = {"quads": told["mesh"]["quads"], "triangles": 0}
    if not FORMATS[name].holds_quads:
        counts = {"quads": 0, "triangles": 2 * told["mesh"]["quads"]}
    assert {key: measured["mesh"][key] for key in counts} == counts
    assert measured["mesh"]["vertices"] == told["mesh"]["vertices"]
    assert measured["mesh"]["volume"] == pytest.approx(told["mesh"]["volume"], rel=1e-5)
    assert (measured["topology"]["genus"], measured["topology"]["boundary_edges"]) == (0, 0)


@pytest.mark.parametrize("name", FORMATS)
def test_normals_that_are_asked_for_and_left_out_are_told(run, tmp_path, name):
    result = run(*SPHERE, tmp_path / "a.dat", "--output-format", name, "--normals")
    assert ("W-NORMALS-LEFT-OUT" in result.stderr) == (not FORMATS[name].holds_normals)
    mesh = run("mesh", tmp_path / "a.dat", "-", "--output-format", "stl")
    assert mesh.exit_code in (0, 3)  # a name that tells no format cannot be read


@pytest.mark.parametrize("name", FORMATS)
def test_standard_output_takes_the_same_bytes(run, tmp_path, name):
    path = tmp_path / "a.dat"
    run(*SPHERE, path, "--output-format", name)
    result = run(*SPHERE, "-", "--output-format", name, "-q")
    assert result.stdout_bytes == path.read_bytes()
    assert result.stderr == ""
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.dat"]


def test_the_summary_says_that_quads_are_split(run, tmp_path):
    told = " ".join(run(*SPHERE, tmp_path / "a.stl").stderr.split())
    assert "STL files hold no quads: each of" in told
    assert "W-QUADS-SPLIT" in told


@pytest.mark.parametrize("name", ["glb", "3mf", "pial"])
def test_text_of_a_binary_format_is_refused_before_any_work(run, tmp_path, name):
    result = run(*SPHERE, tmp_path / f"a.{name}", "--ascii")
    assert result.exit_code == 2
    assert "files are binary; expected one of ply, obj, off" in " ".join(result.stderr.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["glb", "3mf", "msh", "inp", "nas", "k", "usda"])
def test_isovalues_share_a_file_as_groups(run, tmp_path, name):
    path = tmp_path / f"a.{name}"
    assert run("convert", "synth:sphere:14", path, "-i", 0.1, "-i", 0.3).exit_code == 0
    measured = json.loads(run("measure", path, "--json").stdout)
    assert measured["topology"]["components"] == 2


def test_labels_have_their_colours_in_files_of_one_and_of_all(run, tmp_path):
    labels = np.zeros((9, 9, 16), np.uint8)
    labels[2:7, 2:7, 2:7], labels[2:7, 2:7, 9:14] = 1, 2
    np.save(tmp_path / "map.npy", labels)
    (tmp_path / "names.tsv").write_text("index\tname\tcolor\n1\tfirst\t#ff1000\n2\tsecond\t#008040\n")
    known = ["--labels", "all", "--label-names", tmp_path / "names.tsv", "--spacing", "1,1,1"]
    for output in ("{name}.ply", "all.glb"):
        result = run("convert", tmp_path / "map.npy", tmp_path / output, *known)
        assert result.exit_code == 0, result.stderr
    for name, color in (("first", (255, 16, 0)), ("second", (0, 128, 64))):
        values = read_mesh(tmp_path / f"{name}.ply").vertex_values
        assert [set(values[channel].tolist()) for channel in ("red", "green", "blue")] == [{c} for c in color]
    assert b'"baseColorFactor":[1.0,0.005182,0.0,1.0]' in (tmp_path / "all.glb").read_bytes()


def test_labels_in_another_unit_than_a_format_has_are_refused(run, tmp_path):
    np.save(tmp_path / "map.npy", np.ones((4, 4, 4), np.uint8))
    result = run("convert", tmp_path / "map.npy", tmp_path / "a.gii", "--labels", "1", "--unit", "um")
    assert (result.exit_code, "GIfTI files are in millimetres" in result.stderr) == (2, True)
