"""`dmc measure`: what it prints of a mesh file, as text and as JSON."""

import json

import numpy as np
import pytest

from dmc_cli.mesh_io.read import read_mesh

TORUS = "synth:torus:24"


@pytest.fixture
def torus(run, tmp_path):
    path = tmp_path / "torus.ply"
    assert run("convert", TORUS, path, "-i", 0, "--quiet").exit_code == 0
    return path


def test_a_mesh_has_the_measures_of_the_report_that_it_was_written_with(run, tmp_path):
    path, report = tmp_path / "torus.ply", tmp_path / "torus.json"
    run("convert", TORUS, path, "-i", 0, "--report", report)
    expected = json.loads(report.read_text())
    found = json.loads(run("measure", path, "--volume", TORUS, "-i", 0, "--json").stdout)
    for section in ("topology", "quality"):
        assert found[section].keys() == expected[section].keys()
        for key, value in expected[section].items():
            assert found[section][key] == (
                pytest.approx(value, rel=1e-4) if isinstance(value, float) else value
            )
    assert found["mesh"]["quads"] == expected["mesh"]["quads"]
    assert found["mesh"]["area"] == pytest.approx(expected["mesh"]["area"])
    assert found["deviation"]["max_relative"] < 1e-6
    assert found["deviation"].keys() == expected["deviation"].keys()


def test_the_text_tells_topology_shape_and_deviation(run, torus):
    result = run("measure", torus, "--volume", TORUS, "-i", 0)
    assert (result.exit_code, result.stderr) == (0, "")
    words = (
        "closed, 1 component(s), genus 1, Euler characteristic 0",
        "% irregular",
        "degrees",
        "deviation mean",
    )
    assert all(word in result.stdout for word in words)
    assert "deviation" not in run("measure", torus).stdout


def test_triangles_are_counted(run, torus, tmp_path):
    mesh = read_mesh(torus)
    faces = [f"4 {a} {b} {c} {d}" for a, b, c, d in mesh.faces.tolist()]
    a, b, c, d = mesh.faces[0].tolist()
    faces[:1] = [f"3 {a} {b} {c}", f"3 {a} {c} {d}"]
    points = [f"{x} {y} {z}" for x, y, z in mesh.points.tolist()]
    path = tmp_path / "mixed.off"
    path.write_text("\n".join(["OFF", f"{len(points)} {len(faces)} 0", *points, *faces]) + "\n")
    assert ", 2 triangles" in run("measure", path).stdout
    assert json.loads(run("measure", path, "--json").stdout)["mesh"]["triangles"] == 2


def test_a_volume_needs_an_isovalue_and_its_range_is_named(run, torus):
    result = run("measure", torus, "--volume", TORUS)
    assert result.exit_code == 2
    assert "to 0.2" in result.stderr


def test_what_the_volume_warns_of_is_told(run, torus):
    result = run("measure", torus, "--volume", TORUS, "-i", 0, "--spacing", "2,2,2")
    assert "warning   --spacing has no effect: the field tells its own" in result.stdout


def test_an_isovalue_needs_a_volume(run, torus):
    result = run("measure", torus, "-i", 0)
    assert result.exit_code == 2
    assert "--volume" in result.stderr


@pytest.mark.parametrize("content", [None, b"", b"ply\nnonsense", b"OFF\n1 0 0\n0 0 0\n"])
def test_what_is_no_mesh_ends_with_status_3(run, tmp_path, content):
    path = tmp_path / "mesh.off"
    if content is not None:
        path.write_bytes(content)
    result = run("measure", path)
    assert result.exit_code == 3
    assert result.stderr.startswith("Error: ")
    assert result.stdout == ""


def test_a_missing_volume_ends_with_status_3(run, torus, tmp_path):
    assert run("measure", torus, "--volume", tmp_path / "missing.nii", "-i", 0).exit_code == 3


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("inside", ["above", "below"])
def test_a_mesh_of_either_side_is_on_the_surface_beside_nodes_without_data(run, tmp_path, inside, border):
    k, j, i = np.indices((10, 11, 12)) - 5.0
    values = 4.2 - np.sqrt(i**2 + j**2 + k**2)
    values[2, 5, 5] = values[9, 9, 9] = np.nan
    volume, mesh = tmp_path / "ball.npy", tmp_path / "ball.ply"
    np.save(volume, values)
    sides = ("--inside", inside)
    assert run("convert", volume, mesh, "-i", 0, *sides, "--border", border, "-q").exit_code == 0
    found = json.loads(run("measure", mesh, "--volume", volume, "-i", 0, *sides, "--json").stdout)
    assert found["deviation"]["max_relative"] < 1e-6
    assert found["deviation"]["mean_mm"] < 1e-5
    assert 0 < found["deviation"]["rounding_mm"] < 1e-5
