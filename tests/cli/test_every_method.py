"""Every method of the registry takes every option of a conversion, or says which method does."""

import json

import jsonschema
import numpy as np
import pytest

from dmc_cli.mesh_io import read_mesh
from dmc_cli.methods import METHODS, method_named
from tests.conftest import ROOT
from tests.test_methods import SCHEMA

VOLUME = "synth:noise:10"

OPTIONS = {
    "closed, below": ["--border", "closed", "--inside", "below"],
    "gradient, no normals": ["--orientation", "gradient", "--no-normals", "--ascii"],
    "voxel": ["--space", "voxel", "--border", "closed"],
    "unit": ["--unit", "um", "--require", "on-surface"],
    "halfedges": ["--halfedges", "FOLDER/h.npz", "--border", "closed"],
    "text of halfedges": ["--halfedges", "FOLDER/h.txt"],
    "report": ["--report", "FOLDER/r.json", "--curvature"],
}

KEYS = {
    "input": "path files format shape dtype spacing_mm space affine no_data_nodes sha256",
    "surface": "method isovalue stored_isovalue polygons unused_vertices crossed_edges active_cells"
    " multi_polygon_cells ambiguous_faces flipped_faces fallback_vertices",
    "mesh": "vertices quads triangles area volume bounds unit",
    "topology": "components euler_characteristic genus boundary_edges boundary_loops non_manifold_edges"
    " non_manifold_vertices valence_histogram irregular_percent",
    "quality": "shape_mean shape_min mean_ratio_mean scaled_jacobian_min min_angle max_angle warpage_max"
    " self_intersections",
    "deviation": "mean rms max max_relative mean_mm max_mm",
    "timings_ms": "compile read surface normals report write total",
    "memory": "peak_rss_bytes device_bytes",
    "versions": "dmc_cli warp numpy python",
}
"""What scripts may rely on in a report, section by section."""


@pytest.fixture(params=METHODS)
def method(request):
    return request.param


def convert(run, folder, method, *words, volume=VOLUME, isovalue=0.3, name="a.ply"):
    words = [str(word).replace("FOLDER", str(folder)) for word in words]
    given = ["convert", volume, folder / name, "-i", isovalue, "--method", method, "--force", *words]
    return run(*given)


def is_promised(method, promise):
    return bool(getattr(method_named(method), promise))


@pytest.mark.parametrize("name", OPTIONS)
def test_every_option_is_heeded_and_the_mesh_is_checked(run, tmp_path, method, name):
    result = convert(run, tmp_path, method, "--check", *OPTIONS[name])
    if name == "unit" and not is_promised(method, "on_surface"):
        assert result.exit_code == 6
        assert "on-surface: " in result.stderr
        assert list(tmp_path.iterdir()) == []
        return
    assert result.exit_code == 0, result.stderr
    mesh = read_mesh(str(tmp_path / "a.ply"))
    assert len(mesh.faces) > 500
    assert bool(mesh.triangle_count) == (method_named(method).faces == "triangles")
    assert (mesh.normals is None) == ("--no-normals" in OPTIONS[name])


@pytest.mark.parametrize("suffix", ["obj", "off", "ply"])
def test_every_format_holds_the_mesh(run, tmp_path, method, suffix):
    assert (
        convert(run, tmp_path, method, volume="synth:sphere:12", isovalue=0, name=f"a.{suffix}").exit_code
        == 0
    )
    mesh = read_mesh(str(tmp_path / f"a.{suffix}"))
    assert ((mesh.faces[:, 3] < 0) == (method_named(method).faces == "triangles")).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.points, axis=1), 0.75, atol=0.06)


@pytest.mark.parametrize("dtype", ["int8", "uint16", "int64", "float32"])
def test_values_of_every_type_are_taken(run, tmp_path, method, dtype):
    """The same values in any type, cut between two of them, give the same vertices, in the same bytes."""
    values = np.random.default_rng(3).integers(0, 9, (6, 7, 8))
    np.save(tmp_path / "a.npy", values.astype(dtype))
    np.save(tmp_path / "b.npy", values.astype(np.float64))
    for name in ("a", "b"):
        result = convert(
            run, tmp_path, method, volume=tmp_path / f"{name}.npy", isovalue=4.5, name=f"{name}.ply"
        )
        assert result.exit_code == 0, result.stderr
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_missing_data_end_an_open_surface_and_are_capped_by_a_closed_one(run, tmp_path, method):
    values = np.random.default_rng(2).standard_normal((7, 8, 34)).astype(np.float32)
    values[np.random.default_rng(1).random(values.shape) < 0.08] = np.nan
    np.save(tmp_path / "a.npy", values)
    found = {}
    for border in ("open", "closed"):
        words = ["--border", border, "--report", "FOLDER/r.json", "--check"]
        result = convert(run, tmp_path, method, *words, volume=tmp_path / "a.npy")
        assert result.exit_code == 0, result.stderr
        found[border] = json.loads((tmp_path / "r.json").read_text())
        assert found[border]["input"]["no_data_nodes"] == np.isnan(values).sum()
        assert "W-NO-DATA" in found[border]["warning_codes"]
    assert found["open"]["topology"]["boundary_edges"] > 100
    assert found["closed"]["topology"]["boundary_edges"] == 0
    if is_promised(method, "manifold"):
        for report in found.values():
            assert (
                report["topology"]["non_manifold_vertices"] == report["topology"]["non_manifold_edges"] == 0
            )


def test_the_report_has_every_key(run, tmp_path, method):
    assert convert(run, tmp_path, method, "--report", "FOLDER/r.json", "--border", "closed").exit_code == 0
    report = json.loads((tmp_path / "r.json").read_text())
    jsonschema.validate(report, SCHEMA)
    for section, keys in KEYS.items():
        assert set(keys.split()) <= set(report[section]), section
    assert report["surface"]["method"] == report["settings"]["method"] == method
    kind = method_named(method).faces
    assert report["mesh"][kind] == report["mesh"]["quads"] + report["mesh"]["triangles"]
    assert sum(one["faces"] for one in report["components"]) == report["mesh"][kind]
    assert report["mesh"]["volume"] == pytest.approx(sum(one["volume"] for one in report["components"]))
    assert sum(report["topology"]["valence_histogram"].values()) == report["mesh"]["vertices"]
    if is_promised(method, "manifold"):
        assert report["topology"]["genus"] is not None


def test_the_keys_are_those_of_the_contract():
    page = ROOT.parent / "shared" / "cli.md"
    if not page.exists():
        pytest.skip("../shared/cli.md is not there")
    lines = page.read_text().splitlines()
    for section, keys in KEYS.items():
        start = next(n for n, line in enumerate(lines) if line.startswith(f"    {section} "))
        told = lines[start]
        for line in lines[start + 1 :]:
            if not line.startswith("     "):
                break
            told += line
        assert [key for key in keys.split() if key not in told] == [], section


@pytest.mark.parametrize("needed", ["manifold", "closed", "all-quads", "on-surface"])
def test_what_is_required_is_met_or_no_mesh_is_written(run, tmp_path, method, needed):
    result = convert(run, tmp_path, method, "--border", "closed", "--require", needed)
    promised = {
        "manifold": is_promised(method, "manifold"),
        "closed": True,
        "all-quads": method_named(method).faces == "quads",
        "on-surface": is_promised(method, "on_surface"),
    }
    assert result.exit_code == (0 if promised[needed] else 6), result.stderr
    assert (tmp_path / "a.ply").exists() == promised[needed]
    if not promised[needed]:
        assert f"{needed}: " in result.stderr
        assert "(--method dmc" in result.stderr


@pytest.mark.parametrize(
    ("option", "value"), [("simplify", "all"), ("remesh", "2"), ("quads", "50%"), ("relax", "1")]
)
def test_what_acts_on_quads_is_refused_for_triangles(run, tmp_path, method, option, value):
    result = convert(run, tmp_path, method, f"--{option}", value, volume="synth:torus:12", isovalue=0)
    if method_named(method).faces == "quads":
        assert result.exit_code == 0, result.stderr
        return
    assert result.exit_code == 2
    assert f"{option} is '{value}'".replace("'", "" if value.isdigit() else "'") in result.stderr
    assert f"the method {method} makes triangles; leave {option} out, or choose" in result.stderr
    assert "Traceback" not in result.output
    assert list(tmp_path.iterdir()) == []


def test_any_number_of_threads_writes_the_same_files(run, tmp_path, method):
    words = ["--halfedges", "FOLDER/h.npz", "--threads"]
    found = set()
    for threads in (1, 2, 3):
        assert convert(run, tmp_path, method, *words, threads, volume="synth:noise:18").exit_code == 0
        found.add((tmp_path / "a.ply").read_bytes() + (tmp_path / "h.npz").read_bytes())
    assert len(found) == 1


def test_a_halfedge_dump_is_of_the_mesh(run, tmp_path, method):
    words = ["--halfedges", "FOLDER/h.npz", "--border", "closed"]
    assert convert(run, tmp_path, method, *words).exit_code == 0
    with np.load(tmp_path / "h.npz") as archive:
        tables = dict(archive)
    mesh, (origin, face, following, twin) = read_mesh(str(tmp_path / "a.ply")), tables["halfedges"].T
    np.testing.assert_array_equal(tables["quads"], mesh.faces)
    np.testing.assert_array_equal(tables["vertices"], mesh.points)
    np.testing.assert_array_equal(origin, mesh.faces.ravel())
    used = np.flatnonzero(origin >= 0)
    assert (twin[origin < 0] == -1).all()
    assert (following[origin < 0] == -1).all()
    h = used
    for _ in range(3 if method_named(method).faces == "triangles" else 4):
        h = following[h]
    np.testing.assert_array_equal(h, used)
    assert (face[following[used]] == face[used]).all()
    # closed: every halfedge has a twin, which runs back
    np.testing.assert_array_equal(twin[twin[used]], used)
    np.testing.assert_array_equal(origin[twin[used]], origin[following[used]])
    np.testing.assert_array_equal(origin[tables["vertex_halfedge"]], np.arange(len(mesh.points)))
    assert ("face_color" in tables) == (method_named(method).color is not None)
    if method_named(method).color is not None:
        color = tables["face_color"]
        assert (color[face[used]] != color[face[twin[used]]]).all()


def test_several_isovalues_in_one_run_write_what_single_runs_do(run, tmp_path, method):
    """An index of bricks leaves out what an isovalue does not cross."""
    words = ["--border", "closed"]
    template = ["--halfedges", "FOLDER/{isovalue}.npz", "-i", 0.9]
    given = {"volume": "synth:noise:30", "name": "{isovalue}.ply"}
    result = convert(run, tmp_path, method, *words, *template, **given)
    assert result.exit_code == 0, result.stderr
    for isovalue in (0.3, 0.9):
        single = ["--halfedges", "FOLDER/single.npz"]
        given = {"volume": "synth:noise:30", "isovalue": isovalue, "name": "single.ply"}
        assert convert(run, tmp_path, method, *words, *single, **given).exit_code == 0
        for suffix in (".ply", ".npz"):
            several = (tmp_path / f"{isovalue}{suffix}").read_bytes()
            assert several == (tmp_path / f"single{suffix}").read_bytes()


@pytest.mark.parametrize("border", ["open", "closed"])
def test_an_empty_surface_is_refused_or_written_without_faces(run, tmp_path, method, border):
    words = ["--border", border, "--halfedges", "FOLDER/h.npz", "--report", "FOLDER/r.json", "--check"]
    refused = convert(run, tmp_path, method, *words, isovalue=99)
    assert refused.exit_code == 5, refused.output
    assert not (tmp_path / "a.ply").exists()
    result = convert(run, tmp_path, method, *words, "--allow-empty", isovalue=99)
    assert result.exit_code == 0, result.output
    report = json.loads((tmp_path / "r.json").read_text())
    jsonschema.validate(report, SCHEMA)
    assert report["components"] == []
    assert report["mesh"]["vertices"] == 0
    assert b"element vertex 0\n" in (tmp_path / "a.ply").read_bytes()
    with np.load(tmp_path / "h.npz") as tables:
        assert all(len(tables[name]) == 0 for name in tables)


def test_a_budget_that_is_too_small_ends_the_run_before_the_work(run, tmp_path, method):
    result = convert(run, tmp_path, method, "--memory", "300KiB", volume="synth:noise:30")
    assert result.exit_code == 7, result.output
    assert "a mesh of " in result.stderr or "the volume" in result.stderr
    assert list(tmp_path.iterdir()) == []
