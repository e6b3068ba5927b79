"""`dmc mesh`: the mesh of a file becomes another one, by parts, sides, units, formats and on its volume."""

import json

import numpy as np
import pytest

from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.selection import flip_faces, keep_faces
from dmc_cli.settings import ReworkSettings
from tests.conftest import ROOT

NOISE = "synth:noise:24"
TORUS = "synth:torus:24"


@pytest.fixture
def noise(run, tmp_path):
    """A mesh of many components."""
    path = tmp_path / "noise.ply"
    options = ("--border", "closed", "--sigma", 1, "--quiet")
    assert run("convert", NOISE, path, "-i", 0.15, *options).exit_code == 0
    return path


@pytest.fixture
def torus(run, tmp_path):
    path = tmp_path / "torus.ply"
    assert run("convert", TORUS, path, "-i", 0, "--quiet").exit_code == 0
    return path


def measured(run, path, *options):
    return json.loads(run("measure", path, "--json", *options).stdout)


def assert_components(found, expected):
    """Fail unless the components are the same; sums depend on which faces come together."""
    assert len(found) == len(expected)
    for a, b in zip(found, expected, strict=True):
        assert (a["faces"], a["bounds"]) == (b["faces"], b["bounds"])
        assert (a["area"], a["volume"]) == pytest.approx((b["area"], b["volume"]))


def assert_same(a, b):
    np.testing.assert_array_equal(a.points.astype(np.float32), b.points.astype(np.float32))
    np.testing.assert_array_equal(a.faces, b.faces)
    assert (a.space, a.unit) == (b.space, b.unit)


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_without_an_option_the_mesh_is_as_it_was(run, torus, tmp_path, suffix):
    out = tmp_path / f"out{suffix}"
    result = run("mesh", torus, out)
    assert (result.exit_code, result.stdout) == (0, "")
    before, after = read_mesh(torus), read_mesh(out)
    assert_same(before, after)
    if suffix == ".ply":
        np.testing.assert_array_equal(before.normals, after.normals)
        assert out.read_bytes() == torus.read_bytes()


def test_the_largest_components_stay(run, noise, tmp_path):
    out = tmp_path / "out.ply"
    components = measured(run, noise)["components"]
    assert len(components) > 3
    for count in (1, 3):
        assert run("mesh", noise, out, "--keep", count, "--force").exit_code == 0
        assert_components(measured(run, out)["components"], components[:count])
    assert run("mesh", noise, out, "--keep", "largest", "--force").exit_code == 0
    assert measured(run, out)["mesh"]["quads"] == components[0]["faces"]


def test_components_with_few_faces_go(run, noise, tmp_path):
    out = tmp_path / "out.ply"
    components = measured(run, noise)["components"]
    least = components[len(components) // 2]["faces"]
    assert run("mesh", noise, out, "--min-faces", least).exit_code == 0
    kept = [each for each in components if each["faces"] >= least]
    assert_components(measured(run, out)["components"], kept)
    result = run("mesh", noise, tmp_path / "none.ply", "--min-faces", 10**9)
    assert result.exit_code == 3
    assert "no component has 1000000000 faces" in result.stderr
    assert not (tmp_path / "none.ply").exists()


def test_values_normals_and_groups_go_along(torus):
    mesh = read_mesh(torus)
    is_kept = np.arange(len(mesh.faces)) % 3 == 0
    some = keep_faces(
        type(mesh)(
            points=mesh.points,
            faces=mesh.faces,
            normals=mesh.normals,
            vertex_values={"number": np.arange(len(mesh.points), dtype=np.int32)},
            face_values={"number": np.arange(len(mesh.faces), dtype=np.int32)},
            groups={"first": 2, "none": 1, "rest": len(mesh.faces) - 3},
            colors={"none": (1, 2, 3), "rest": (4, 5, 6)},
        ),
        np.where(np.arange(len(mesh.faces)) == 2, False, is_kept),
    )
    vertex, face = some.vertex_values["number"], some.face_values["number"]
    np.testing.assert_array_equal(face, np.flatnonzero(is_kept))
    np.testing.assert_array_equal(vertex[some.faces], mesh.faces[face])
    np.testing.assert_array_equal(some.points, mesh.points[vertex])
    np.testing.assert_array_equal(some.normals, mesh.normals[vertex])
    assert some.groups == {"first": 1, "rest": len(face) - 1}
    assert some.colors == {"rest": (4, 5, 6)}


def test_faces_are_turned_round(run, torus, tmp_path):
    out = tmp_path / "out.ply"
    assert run("mesh", torus, out, "--flip").exit_code == 0
    before, after = measured(run, torus), measured(run, out)
    assert after["mesh"]["volume"] == -before["mesh"]["volume"]
    assert after["topology"] == before["topology"]
    np.testing.assert_array_equal(read_mesh(out).normals, -read_mesh(torus).normals)
    assert_same(flip_faces(flip_faces(read_mesh(torus))), read_mesh(torus))


def test_units_and_axes(run, tmp_path):
    scan, path, out = ROOT / "sample_data" / "dicom" / "head_ct", tmp_path / "a.ply", tmp_path / "out.ply"
    assert run("convert", scan, path, "-i", 300, "--quiet").exit_code == 0
    assert run("mesh", path, out, "--unit", "um", "--space", "ras").exit_code == 0
    before, after = read_mesh(path), read_mesh(out)
    assert (before.space, after.space, after.unit) == ("LPS", "RAS", "um")
    np.testing.assert_allclose(after.points, before.points.astype(float) * (-1e3, -1e3, 1e3), rtol=1e-7)
    np.testing.assert_array_equal(after.normals, before.normals * np.float32((-1, -1, 1)))
    assert run("mesh", out, path, "--unit", "mm", "--space", "lps", "--force").exit_code == 0
    np.testing.assert_allclose(read_mesh(path).points, before.points, rtol=2e-7)


@pytest.mark.parametrize("unit", ["mm", "um"])
def test_on_its_volume_a_mesh_is_what_convert_makes_of_it(run, torus, tmp_path, unit):
    """Vertices of a file are rounded, so places agree to that."""
    direct, out = tmp_path / "direct.ply", tmp_path / "out.ply"
    operations = ("--simplify", "all", "--relax", 3, "--unit", unit)
    assert run("convert", TORUS, direct, "-i", 0, *operations, "--quiet").exit_code == 0
    if unit == "um":
        assert run("mesh", torus, torus.with_name("um.ply"), "--unit", "um").exit_code == 0
        torus = torus.with_name("um.ply")
    assert run("mesh", torus, out, "--volume", TORUS, "-i", 0, *operations).exit_code == 0
    expected, found = read_mesh(direct), read_mesh(out)
    np.testing.assert_array_equal(found.faces, expected.faces)
    np.testing.assert_allclose(found.points, expected.points, atol=1e-4 * (1e3 if unit == "um" else 1))
    assert np.einsum("ij,ij->i", found.normals, expected.normals).min() > 0.999


def test_the_normals_of_a_volume_look_the_way_of_the_faces(run, torus, tmp_path):
    flipped, out = tmp_path / "flipped.ply", tmp_path / "out.ply"
    assert run("mesh", torus, flipped, "--flip", "--no-normals").exit_code == 0
    assert run("mesh", flipped, out, "--volume", TORUS, "-i", 0).exit_code == 0
    dots = np.einsum("ij,ij->i", read_mesh(out).normals, read_mesh(torus).normals)
    assert dots.max() < -0.999


def test_the_report_and_what_is_required(run, torus, tmp_path):
    out, report = tmp_path / "out.ply", tmp_path / "r.json"
    result = run("mesh", torus, out, "--report", report, "--require", "closed,all-quads")
    assert result.exit_code == 0
    found = json.loads(report.read_text())
    assert found["settings"]["input"] == str(torus)
    assert found["input"]["faces"] == found["mesh"]["quads"] > 0
    assert found["topology"]["genus"] == 1
    assert found["deviation"] is None
    assert "topology  manifold, closed" in result.stderr
    part = tmp_path / "part.ply"
    mesh = read_mesh(torus)
    from dmc_cli.mesh_io import write_mesh

    write_mesh(str(part), keep_faces(mesh, np.arange(len(mesh.faces)) > 10))
    result = run("mesh", part, tmp_path / "no.ply", "--require", "closed", "--report", report, "--force")
    assert result.exit_code == 6
    assert "closed: " in result.stderr
    assert not (tmp_path / "no.ply").exists()
    assert json.loads(report.read_text())["topology"]["boundary_edges"] > 0


def test_the_deviation_is_told_where_there_is_a_volume(run, torus, tmp_path):
    report = tmp_path / "r.json"
    words = ("--volume", TORUS, "-i", 0, "--require", "on-surface", "--report", report)
    assert run("mesh", torus, tmp_path / "out.ply", *words).exit_code == 0
    assert json.loads(report.read_text())["deviation"]["max_relative"] < 1e-5


@pytest.mark.parametrize(
    ("words", "status", "told"),
    [
        (("--relax", 3), 2, "relax is 3, but no volume was given"),
        (("--simplify", "all"), 2, "simplify is 'all', but no volume was given"),
        (("--remesh", 2), 2, "remesh is 2, but no volume was given"),
        (("--keep", 0), 2, "keep is 0; expected how many components stay"),
        (("--keep", "some"), 2, "expected largest, or a number"),
        (("--min-faces", -1), 2, "min_faces is -1"),
        (("--space", "ras"), 2, "does not say how its axes lie in the patient"),
        (("--volume", TORUS), 2, "-i"),
        (("-i", 3), 2, "no volume"),
        (("--volume", TORUS, "-i", 0.2), 3, "is not on the isosurface"),
        (("--volume", TORUS, "-i", 0, "--simplify", "all", "--simplify-rules", "paper"), 2, "'paper'"),
    ],
)
def test_what_cannot_be_done_is_told_and_nothing_written(run, torus, tmp_path, words, status, told):
    result = run("mesh", torus, tmp_path / "out.ply", *words)
    assert result.exit_code == status
    assert told in result.stderr
    assert not (tmp_path / "out.ply").exists()


def test_an_output_is_no_input(run, torus):
    before = torus.read_bytes()
    result = run("mesh", torus, torus, "--force")
    assert (result.exit_code, torus.read_bytes()) == (2, before)
    assert "which is read" in result.stderr


def test_a_mesh_that_exists_is_kept_without_force(run, torus, tmp_path):
    out = tmp_path / "out.ply"
    out.write_text("mine")
    assert run("mesh", torus, out).exit_code == 9
    assert out.read_text() == "mine"
    assert run("mesh", torus, out, "--dry-run", "--force").exit_code == 0
    assert out.read_text() == "mine"


def test_triangles_are_not_relaxed(run, torus, tmp_path):
    path = tmp_path / "triangles.ply"
    assert run("convert", TORUS, path, "-i", 0, "--method", "mc", "--quiet").exit_code == 0
    result = run("mesh", path, tmp_path / "out.ply", "--volume", TORUS, "-i", 0, "--relax", 2)
    assert result.exit_code == 2
    assert "triangles" in result.stderr


def test_settings_refuse_what_is_none():
    with pytest.raises(Exception, match="keep is -3"):
        ReworkSettings(mesh="a.ply", path="b.ply", keep=-3)


def test_values_are_listed_beside_those_of_the_file(run, torus, tmp_path):
    out, more = tmp_path / "out.ply", tmp_path / "more.ply"
    words = ("--volume", TORUS, "-i", 0, "--values", "deviation,valence,quality,thickness")
    assert run("mesh", torus, out, *words).exit_code == 0
    assert run("convert", TORUS, more, "-i", 0, *words[4:]).exit_code == 0
    found, expected = read_mesh(out), read_mesh(more)
    for name in ("valence", "thickness"):
        np.testing.assert_allclose(found.vertex_values[name], expected.vertex_values[name], rtol=1e-4)
    np.testing.assert_allclose(found.face_values["quality"], expected.face_values["quality"], rtol=1e-4)
    assert run("mesh", out, more, "--keep", 1, "--values", "valence", "--force").exit_code == 0
    assert set(read_mesh(more).vertex_values) == {"deviation", "valence", "thickness"}
    result = run("mesh", torus, tmp_path / "no.ply", "--values", "deviation")
    assert result.exit_code == 2
    assert "no volume was given to hold the mesh against" in result.stderr
