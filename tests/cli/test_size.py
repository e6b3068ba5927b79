"""`--edge-length` and `--max-error` on the command line, in `convert` and `mesh`."""

import json

import numpy as np
import pytest

from dmc_cli.mesh import vertex_normals
from dmc_cli.mesh_io import read_mesh

SYNTH = ("convert", "synth:genus_two:32")


def read(path):
    return json.loads(path.read_text())


def words_of(result):
    return " ".join(result.stderr.split())


@pytest.fixture
def fine(run, tmp_path):
    path = tmp_path / "fine.ply"
    assert run(*SYNTH, path, "-i", 0).exit_code == 0
    return path


def test_sides_are_about_as_long_as_was_asked_for(run, tmp_path):
    report = tmp_path / "report.json"
    plain = tmp_path / "plain.json"
    assert run(*SYNTH, tmp_path / "a.ply", "-i", 0, "--report", plain).exit_code == 0
    area, quads = (read(plain)["mesh"][key] for key in ("area", "quads"))
    length = 2 * (area / quads) ** 0.5
    result = run(*SYNTH, tmp_path / "b.ply", "-i", 0, "--edge-length", length, "--report", report)
    assert result.exit_code == 0
    size = read(report)["size"]
    assert size["quads"] == size["quads_wanted"] == round(area / length**2)
    assert size["edge_length_wanted"] == length
    assert abs(size["edge_length"] / length - 1) < 0.1
    assert size["to_before"]["max"] < length
    assert f"{size['quads_wanted']} asked for, sides" in words_of(result)


@pytest.mark.parametrize("unit", [("--unit", "um"), ("--space", "voxel")])
def test_a_length_is_in_millimetres_whatever_the_coordinates(run, tmp_path, unit):
    sizes = []
    for n, more in enumerate([(), unit]):
        report = tmp_path / f"{n}.json"
        # 700 quads: of fewer the mean side is more of a chance
        words = ("-i", 0, "--edge-length", 0.1, "--report", report, *more)
        assert run(*SYNTH, tmp_path / f"{n}.ply", *words).exit_code == 0
        sizes.append(read(report)["size"])
    assert sizes[1]["quads"] == sizes[0]["quads"] < sizes[0]["quads_before"]
    assert sizes[1]["edge_length"] == pytest.approx(sizes[0]["edge_length"], rel=0.02)


def test_nothing_is_further_than_the_bound_as_dmc_measure_finds(run, tmp_path, fine):
    coarse, report = tmp_path / "coarse.ply", tmp_path / "report.json"
    result = run(*SYNTH, coarse, "-i", 0, "--max-error", 0.02, "--report", report, "--relax", 3)
    assert result.exit_code == 0
    size = read(report)["size"]
    assert size["quads"] < size["quads_before"] / 2
    assert (size["quads_wanted"], size["reached"], size["max_error"]) == (None, None, 0.02)
    assert size["stopped_by"] in ("max_error", "shape", "topology")
    measured = run("measure", coarse, "--against", fine, "--json")
    found = json.loads(measured.stdout)["distance"]
    assert 0 < found["to_other"]["max"] <= 0.02
    assert 0 < found["from_other"]["max"] <= 0.02
    assert found["to_other"]["max"] == pytest.approx(size["to_before"]["max"], rel=0.05)
    assert "nowhere more than 0.02" in words_of(result)


def test_a_bound_and_a_number_stop_at_whichever_comes_first(run, tmp_path):
    report = tmp_path / "report.json"
    words = (*SYNTH, tmp_path / "a.ply", "-i", 0, "--report", report, "--force")
    assert run(*words, "--max-error", 1, "--quads", "50%").exit_code == 0
    assert read(report)["size"]["reached"]
    assert run(*words, "--max-error", 0.002, "--quads", 100).exit_code == 0
    size = read(report)["size"]
    assert not size["reached"]
    assert size["quads"] > 100
    assert read(report)["warning_codes"] == ["W-QUADS-LEFT"]


@pytest.mark.parametrize("option", ["--edge-length", "--max-error"])
@pytest.mark.parametrize("length", ["0", "-1", "nan", "inf"])
def test_what_is_no_length_is_refused(run, tmp_path, option, length):
    result = run(*SYNTH, tmp_path / "a.ply", "-i", 0, f"{option}={length}")
    assert result.exit_code == 2
    assert "expected a positive length in mm" in words_of(result)
    assert not (tmp_path / "a.ply").exists()


def test_a_number_and_a_length_are_one_too_many(run, tmp_path):
    result = run(*SYNTH, tmp_path / "a.ply", "-i", 0, "--quads", 100, "--edge-length", 1)
    assert result.exit_code == 2
    assert "expected one of them" in words_of(result)


def test_a_mesh_without_a_volume_is_its_own_surface(run, tmp_path, fine):
    report, coarse = tmp_path / "report.json", tmp_path / "b.ply"
    result = run("mesh", fine, coarse, "--quads", "25%", "--report", report)
    assert result.exit_code == 0
    size = read(report)["size"]
    assert size["quads"] == size["quads_wanted"] == read(report)["mesh"]["quads"]
    assert size["to_before"]["max"] < size["edge_length"] / 2
    assert read(report)["topology"]["boundary_edges"] == 0
    assert read(report)["quality"]["self_intersections"] == 0
    mesh = read_mesh(coarse)
    np.testing.assert_allclose(mesh.normals, vertex_normals(mesh.points, mesh.faces), atol=1e-6)


def test_a_bound_holds_without_a_volume_in_millimetres(run, tmp_path, fine):
    small, coarse = tmp_path / "um.ply", tmp_path / "b.ply"
    assert run("mesh", fine, small, "--unit", "um").exit_code == 0
    assert run("mesh", small, coarse, "--unit", "mm", "--max-error", 0.02).exit_code == 0
    found = json.loads(run("measure", coarse, "--against", fine, "--json").stdout)
    assert found["distance"]["both"]["max"] <= 0.02
    assert found["mesh"]["quads"] < len(read_mesh(fine).faces) / 2


def test_triangles_have_no_size(run, tmp_path, fine):
    triangles = tmp_path / "fine.stl"
    assert run("mesh", fine, triangles).exit_code == 0
    result = run("mesh", triangles, tmp_path / "b.ply", "--quads", "25%")
    assert result.exit_code == 2
    assert "triangles" in words_of(result)
    assert not (tmp_path / "b.ply").exists()


def test_dmc_mesh_has_a_size_and_tells_it(run, tmp_path, fine):
    report = tmp_path / "report.json"
    words = ("--volume", SYNTH[1], "-i", 0, "--max-error", 0.05, "--edge-length", 0.15, "--unit", "um")
    result = run("mesh", fine, tmp_path / "b.ply", *words, "--report", report)
    assert result.exit_code == 0
    size = read(report)["size"]
    assert size["quads"] == read(report)["mesh"]["quads"] < size["quads_before"]
    assert size["from_before"]["max"] <= 0.05
    assert f"size {size['quads']} of {size['quads_before']} quads" in words_of(result)


def test_dmc_mesh_tells_what_it_repaired_and_what_is_met(run, tmp_path, fine):
    words = ("--volume", SYNTH[1], "-i", 0, "--quads", "50%", "--repair-intersections")
    result = run("mesh", fine, tmp_path / "b.ply", *words, "--require", "size.quads<=3000,components<=1")
    assert result.exit_code == 0
    assert "required size.quads<=3000, components<=1: met" in words_of(result)
    refused = run("mesh", fine, tmp_path / "c.ply", *words, "--require", "size.to_before.max<=1e-9")
    assert refused.exit_code == 6
    assert not (tmp_path / "c.ply").exists()


def test_a_patch_with_more_points_than_it_has_room_for_is_left_alone(run, tmp_path):
    """Of few quads some have many points of the fine mesh: fitting must not look beyond its list."""
    out = tmp_path / "a.ply"
    result = run("convert", "synth:genus_two:40", out, "-i", 0, "--border", "closed", "--max-error", 0.02)
    assert result.exit_code == 0
