"""Methods of the dual of the grid take every option of a conversion, and say what they do not promise."""

import json

import jsonschema
import numpy as np
import pytest

from dmc_cli.mesh_io import read_mesh
from tests.contouring.dual_grid.test_agreement import DUAL_METHODS
from tests.test_methods import SCHEMA

VOLUME = ("synth:noise:14", "-i", 0.3)

OPTIONS = {
    "closed": ["--border", "closed", "--inside", "below"],
    "gradient": ["--orientation", "gradient", "--space", "voxel"],
    "halfedges": ["--halfedges", "FOLDER/h.npz"],
    "text of halfedges": ["--halfedges", "FOLDER/h.txt", "--simplify", "all"],
    "simplify": ["--simplify", "all", "--report", "FOLDER/r.json"],
    "as the papers do": ["--simplify", "3x3y", "--simplify-rules", "paper"],
    "relax": ["--relax", "2", "--simplify", "3333"],
    "remesh": ["--remesh", "1"],
    "text": ["--ascii", "--no-normals"],
}


@pytest.fixture(params=DUAL_METHODS)
def method(request):
    return request.param


@pytest.mark.parametrize("name", [key for key in OPTIONS if key != "remesh"])
def test_every_option_is_heeded_and_the_mesh_is_checked(run, tmp_path, method, name):
    words = [word.replace("FOLDER", str(tmp_path)) for word in OPTIONS[name]]
    result = run("convert", VOLUME[0], tmp_path / "a.ply", *VOLUME[1:], "--method", method, "--check", *words)
    assert result.exit_code == 0, result.stderr
    mesh = read_mesh(str(tmp_path / "a.ply"))
    assert len(mesh.faces) > 1000
    assert (mesh.normals is None) == ("--no-normals" in words)


@pytest.mark.slow
def test_remeshing(run, tmp_path, method):
    words = ["--method", method, "--check", *OPTIONS["remesh"]]
    assert run("convert", VOLUME[0], tmp_path / "a.ply", *VOLUME[1:], *words).exit_code == 0


@pytest.mark.parametrize("suffix", ["obj", "off", "ply"])
def test_every_format_holds_the_mesh(run, tmp_path, method, suffix):
    words = ["--method", method, "--border", "closed"]
    assert run("convert", "synth:sphere:12", tmp_path / f"a.{suffix}", "-i", 0, *words).exit_code == 0
    mesh = read_mesh(str(tmp_path / f"a.{suffix}"))
    assert (mesh.faces[:, 3] >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.points, axis=1), 0.75, atol=0.04)


def test_the_report_tells_what_is_not_manifold(run, tmp_path, method):
    words = ["--method", method, "--report", tmp_path / "r.json"]
    result = run("convert", VOLUME[0], tmp_path / "a.ply", *VOLUME[1:], *words)
    report = json.loads((tmp_path / "r.json").read_text())
    jsonschema.validate(report, SCHEMA)
    topology = report["topology"]
    edges, vertices = topology["non_manifold_edges"], topology["non_manifold_vertices"]
    assert edges > 100
    assert vertices > 100
    assert f"not manifold ({edges} edge(s), {vertices} vertices)" in result.stderr
    surface = report["surface"]
    assert surface["active_cells"] == report["mesh"]["vertices"] + surface["unused_vertices"]
    assert surface["polygons"] is None


@pytest.mark.parametrize(
    ("needed", "advice"),
    [
        ("manifold", "edges with more than two faces were found; expected none (--method dmc"),
        ("on-surface", "at most 1e-05 (--method dmc"),
    ],
)
def test_what_is_not_promised_is_refused_with_the_methods_that_promise_it(
    run, tmp_path, method, needed, advice
):
    result = run(
        "convert", VOLUME[0], tmp_path / "a.ply", *VOLUME[1:], "--method", method, "--require", needed
    )
    assert result.exit_code == 6
    assert advice in result.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("option", "value"), [("topology", "manifold"), ("placement", "exact")])
def test_options_of_other_methods_are_refused(run, tmp_path, method, option, value):
    words = ["--method", method, f"--{option}", value]
    result = run("convert", VOLUME[0], tmp_path / "a.ply", *VOLUME[1:], *words)
    assert result.exit_code == 2
    assert f"{option} is '{value}'" in result.stderr


def test_colours_differ_across_twins(run, tmp_path, method):
    words = ["--method", method, "--halfedges", tmp_path / "h.npz"]
    assert run("convert", VOLUME[0], tmp_path / "a.ply", *VOLUME[1:], *words).exit_code == 0
    with np.load(tmp_path / "h.npz") as archive:
        dump = dict(archive)
    twin = dump["halfedges"][:, 3]
    linked = np.flatnonzero(twin >= 0)
    for name in ("face_color", "face_color24"):
        color = dump[name]
        assert (color[linked // 4] != color[twin[linked] // 4]).all()
    assert dump["face_color"].max() <= 4
