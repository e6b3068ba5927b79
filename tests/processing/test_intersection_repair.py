"""Faces that intersect are pulled apart; nothing else moves."""

import json
from dataclasses import replace

import numpy as np
import pytest
import warp as wp

import dmc_cli.report.measures
from dmc_cli.contouring import connect_faces
from dmc_cli.measures import find_intersections, measure_topology
from dmc_cli.mesh import connect
from dmc_cli.processing import repair_intersections
from dmc_cli.runtime import select_device
from dmc_cli.settings import SurfaceSettings
from tests import shapes
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import smooth_noise
from tests.mesh.meshes import on_device


def folded(device="cpu", threads=2, border="closed"):
    """A surface of which some vertices were moved into the next cell, so that faces intersect."""
    chosen = SurfaceSettings(isovalue=0.0, border=border)
    surface = connect_faces(extract_on(device, smooth_noise(20), chosen, threads=threads))
    cell = surface.placement.cell.numpy().copy()
    moved = np.arange(40, len(cell), 23)
    moved = moved[cell[moved] % surface.placement.frame.grid.nx < 16]
    cell[moved] += 1
    placement = replace(surface.placement, cell=wp.array(cell, dtype=wp.int64, device=device))
    return replace(surface.mesh, positions=placement.positions()), placement


def test_no_face_intersects_another_afterwards(device):
    mesh, placement = folded(device)
    before = find_intersections(mesh)
    assert len(before) > 5
    result = repair_intersections(mesh, placement, find_intersections)
    assert result.pairs_before == len(before)
    assert result.pairs_after == len(find_intersections(result.mesh)) == 0
    assert 0 < result.left_surface <= result.moved or result.rounds <= 3
    assert measure_topology(result.mesh) == measure_topology(mesh)
    local = result.placement.local.numpy()
    assert ((local >= 0) & (local <= 1)).all()
    np.testing.assert_allclose(result.placement.positions().numpy(), result.mesh.positions.numpy())


def test_only_vertices_of_such_faces_move_and_no_array_is_changed():
    mesh, placement = folded()
    points, cells = mesh.positions.numpy().copy(), placement.cell.numpy().copy()
    touched = set(mesh.faces.numpy()[np.unique(find_intersections(mesh))].ravel().tolist())
    result = repair_intersections(mesh, placement, find_intersections)
    differs = (result.mesh.positions.numpy() != points).any(axis=1)
    assert result.rounds > 1 or set(np.flatnonzero(differs).tolist()) <= touched
    assert differs.sum() <= result.moved
    np.testing.assert_array_equal(mesh.positions.numpy(), points)
    np.testing.assert_array_equal(placement.cell.numpy(), cells)


def test_a_mesh_without_intersections_is_handed_back():
    surface = extract_on("cpu", smooth_noise(16), SurfaceSettings(isovalue=0.0, border="closed"))
    assert len(find_intersections(surface.mesh)) == 0
    result = repair_intersections(surface.mesh, surface.placement, find_intersections)
    assert result.mesh is surface.mesh
    assert (result.pairs_before, result.moved, result.rounds) == (0, 0, 0)


def test_vertices_of_a_boundary_stay():
    mesh, placement = folded(border="open")
    twin = mesh.require_halfedges().twin.numpy()
    ends = np.flatnonzero((twin < 0) & (mesh.corners.numpy() >= 0))
    corners = mesh.corners.numpy()
    boundary = np.unique([corners[ends], corners[ends - ends % 4 + (ends % 4 + 1) % 4]])
    result = repair_intersections(mesh, placement, find_intersections)
    assert result.moved > 0
    after, before = result.mesh.positions.numpy(), mesh.positions.numpy()
    np.testing.assert_array_equal(after[boundary], before[boundary])


@pytest.mark.parametrize("threads", [1, 3])
def test_any_number_of_threads_gives_the_same_bytes(threads):
    found = []
    for count in (2, threads):
        mesh, placement = folded(threads=count)
        result = repair_intersections(mesh, placement, find_intersections)
        found.append(result.mesh.positions.numpy().tobytes() + result.placement.local.numpy().tobytes())
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("options", "repairs"),
    [
        ((), False),
        (("--require", "no-self-intersections"), True),
        (("--require", "print", "--border", "closed"), True),
        (("--repair-intersections",), True),
        (("--repair-intersections", "--relax", 2, "--method", "nets"), True),
        (("--repair-intersections", "--method", "mc"), True),
        (("--require", "no-self-intersections", "--no-repair-intersections"), False),
        (("--simplify", "3x3y"), True),
        (("--relax", 1), True),
        (("--quads", "90%"), True),
        (("--relax", 1, "--no-repair-intersections"), False),
        (("--simplify", "all", "--simplify-rules", "paper", "--border", "closed"), False),
    ],
)
def test_it_is_done_where_quads_are_changed_or_it_is_required(run, tmp_path, options, repairs):
    out, report = tmp_path / "a.ply", tmp_path / "r.json"
    words = ("convert", "synth:noise:20", "--sigma", 1, "-i", 0, out, "--report", report)
    assert run(*words, *options).exit_code in (0, 6)
    found = json.loads(report.read_text())
    assert (found["repair"] is not None) == repairs
    if repairs:
        assert found["repair"]["pairs_after"] == found["quality"]["self_intersections"]


def test_the_mesh_does_not_depend_on_a_report(run, tmp_path):
    words = ("convert", "synth:noise:24", "-i", 0, "--relax", 3)
    run(*words, tmp_path / "a.ply")
    run(*words, tmp_path / "b.ply", "--report", tmp_path / "r.json")
    run(*words, tmp_path / "c.ply", "--no-repair-intersections")
    assert json.loads((tmp_path / "r.json").read_text())["repair"]["moved"] > 0
    first, second, third = ((tmp_path / f"{name}.ply").read_bytes() for name in "abc")
    assert first == second != third


def test_intersections_are_searched_once(run, tmp_path, monkeypatch):
    """The report has the count of the repair, which is that of the mesh that is written."""
    monkeypatch.setattr(dmc_cli.report.measures, "count_intersections", None)
    words = ("convert", "synth:noise:24", "-i", 0, tmp_path / "a.ply", "--relax", 1)
    result = run(*words, "--report", tmp_path / "r.json")
    assert result.exit_code == 0, result.stderr
    assert run("measure", tmp_path / "a.ply", "--json").exit_code == 0
    told = json.loads((tmp_path / "r.json").read_text())["quality"]["self_intersections"]
    monkeypatch.undo()
    found = json.loads(run("measure", tmp_path / "a.ply", "--json").stdout)
    assert found["quality"]["self_intersections"] == told


def test_what_was_repaired_is_told(run, tmp_path):
    words = ("convert", "synth:noise:24", "-i", 0, tmp_path / "a.ply", "--repair-intersections")
    result = run(*words, "--report", tmp_path / "r.json")
    found = json.loads((tmp_path / "r.json").read_text())["repair"]
    assert found["pairs_before"] > 0
    told = f"repair    {found['pairs_before']} pair(s) of faces intersected, {found['pairs_after']} do now;"
    assert told in result.stderr


@pytest.mark.parametrize("volume", [(), ("--volume", "synth:noise:24", "-i", 0)])
def test_a_mesh_file_is_repaired_on_its_volume_or_without_one(run, tmp_path, volume):
    out, report = tmp_path / "a.ply", tmp_path / "r.json"
    run("convert", "synth:noise:24", "-i", 0, out, "--quiet")
    words = (*volume, "--repair-intersections", "--report", report)
    assert run("mesh", out, tmp_path / "b.ply", *words).exit_code == 0
    found = json.loads(report.read_text())
    assert found["repair"]["pairs_before"] > found["repair"]["pairs_after"]
    assert found["quality"]["self_intersections"] == found["repair"]["pairs_after"]
    assert volume or found["repair"]["left_surface"] == found["repair"]["moved"]


def test_a_mesh_that_cannot_be_repaired_stays_as_it_is():
    points, quads = shapes.sphere(8)
    flat = connect(on_device((points * [1, 1, 0], quads), select_device("cpu", 1)))
    before = flat.positions.numpy().copy()
    result = repair_intersections(flat, None, find_intersections)
    assert result.pairs_after == result.pairs_before > 0
    assert (result.moved, result.left_surface) == (0, 0)
    assert np.array_equal(result.mesh.positions.numpy(), before)
