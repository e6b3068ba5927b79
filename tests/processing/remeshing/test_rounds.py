"""`--remesh` lowers irregular vertices and keeps every promise, after each round."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from hypothesis import given, settings

from dmc_cli.contouring import connect_faces
from dmc_cli.errors import SettingsError
from dmc_cli.measures.quality import measure_quality
from dmc_cli.measures.topology import measure_topology
from dmc_cli.mesh.check_halfedges import NO_TWIN, check_halfedges
from dmc_cli.mesh.mesh import COLOR, COLOR24, Mesh
from dmc_cli.mesh.valences import irregular_percent
from dmc_cli.processing.distance_guard import FARTHEST, track_vertices
from dmc_cli.processing.remeshing import remesh, rounds
from dmc_cli.runtime.device import Device
from dmc_cli.settings import MeshSettings, ReadSettings, SurfaceSettings
from dmc_cli.volume_io.read import read_volume
from tests.contouring.dual_marching_cubes.agreement import as_arrays, extract_on
from tests.contouring.dual_marching_cubes.real import REAL_VOLUMES, read_real_volume
from tests.fields import one_cell, one_inside_node, paper_field, plane, smooth_noise, white_noise
from tests.mesh.meshes import (
    colored,
    euler_and_components,
    quad_normals,
    relaxed,
    simplified,
    vertex_pair_uses,
)
from tests.processing.remeshing.distances import farthest_vertex, high_quads, index_positions, points_of
from tests.reference import table
from tests.strategies import volumes_with_settings

GOALS = {row["volume"]: float(row["irregular_percent_after"]) / 3 for row in table("regression_real.csv")}
MISSED = {next(name for name in GOALS if "bonsai" in name): 8.5}
"""What holds where the goal is missed yet."""


def by_patterns(surface):
    """The mesh that the rounds start from; its arrays are copies."""
    return simplified(connect_faces(surface))


def remeshed(surface, rounds):
    return remesh(surface.mesh, surface.placement, rounds)


def warps(surface):
    """The larger angle in degrees between each quad's normals at opposite corners, where there are any."""
    a, b, c, d = np.moveaxis(surface.mesh.positions.numpy().astype(float)[surface.mesh.faces.numpy()], 1, 0)
    normals = [np.cross(x, y) for x, y in ((a - d, b - a), (b - a, c - b), (c - b, d - c), (d - c, a - d))]
    sizes = [np.linalg.norm(normal, axis=1) for normal in normals]
    cosines = np.ones((2, len(a)))
    for n in range(2):
        np.divide(
            (normals[n] * normals[n + 2]).sum(axis=1),
            sizes[n] * sizes[n + 2],
            out=cosines[n],
            where=sizes[n] * sizes[n + 2] > 0,
        )
    return np.degrees(np.arccos(np.clip(cosines.min(axis=0), -1, 1)))


def warped_quads(surface, limit=30):
    return int((warps(surface) > limit).sum())


def assert_not_warped(before, after):
    """Fail if more quads are warped by over 30 or 60 degrees than before, or one further than any was."""
    for limit in (30, 60):
        assert warped_quads(after, limit) <= warped_quads(before, limit), limit
    assert warps(after).max(initial=60) <= warps(before).max(initial=60) + 1e-3


def turned_pairs(surface):
    """Twins whose quads' normals are more than 90 degrees apart."""
    normals = quad_normals(surface.mesh.positions.numpy().astype(float), surface.mesh.faces.numpy())
    twin = surface.mesh.halfedges.twin.numpy()
    with_twin = np.flatnonzero(twin != NO_TWIN)
    return int(((normals[with_twin // 4] * normals[twin[with_twin] // 4]).sum(axis=1) < 0).sum() // 2)


def assert_whole(before, after, *, one_fan=True):
    """Fail unless a mesh is as sound as the one before it."""
    old, new = before.mesh, after.mesh
    old_halfedges, new_halfedges = old.halfedges, new.halfedges
    quads, twin = new.faces.numpy(), new_halfedges.twin.numpy()
    check_halfedges(quads, twin, new_halfedges.vertex_halfedge.numpy(), one_fan=one_fan)
    assert euler_and_components(quads, twin) == euler_and_components(
        old.faces.numpy(), old_halfedges.twin.numpy()
    )
    count = new.vertex_count
    assert (np.unique(quads) == np.arange(count)).all()
    found = measure_topology(new)
    was = measure_topology(old)
    assert found.non_manifold_edges <= was.non_manifold_edges
    assert found.non_manifold_vertices <= was.non_manifold_vertices
    corners = np.sort(quads, axis=1)
    assert (corners[:, 1:] != corners[:, :-1]).all(), "a vertex twice in a quad"
    assert duplicates(quads) <= duplicates(old.faces.numpy())
    assert (vertex_pair_uses(quads) > 2).sum() <= (vertex_pair_uses(old.faces.numpy()) > 2).sum()
    valence, old_valence = new_halfedges.valence.numpy(), old_halfedges.valence.numpy()
    assert (valence == valences_by_edges(quads, twin, count)).all()
    assert (valence < 3).sum() <= (old_valence < 3).sum()
    assert (valence > 8).sum() <= (old_valence > 8).sum()
    assert np.isfinite(new.positions.numpy()).all()
    if after.placement is not None:  # there is a field
        local = after.placement.local.numpy()
        assert ((local >= 0) & (local <= 1)).all()


def test_a_vertex_of_no_face_stays_where_it_is(extract):
    """Meshes of other origin may have some; they have no quad that a tracked point could be assigned to."""
    before = by_patterns(extract(smooth_noise(16, 1.0), border="closed", threads=2))
    mesh, placement = before.mesh, before.placement
    more = {
        name: np.concatenate([a.numpy(), a.numpy()[:1]])
        for name, a in (("positions", mesh.positions), ("cell", placement.cell), ("local", placement.local))
    }
    loose = Mesh(wp.array(more["positions"], dtype=wp.vec3, device=mesh.device.name), mesh.faces, mesh.device)
    where = replace(
        placement,
        cell=wp.array(more["cell"], dtype=wp.int64, device=mesh.device.name),
        local=wp.array(more["local"], dtype=wp.vec3, device=mesh.device.name),
    )
    result = remesh(loose, where, 3)
    assert result.operations > 0
    unused = np.setdiff1d(np.arange(result.mesh.vertex_count), result.mesh.faces.numpy())
    assert unused.size == 1
    np.testing.assert_array_equal(result.mesh.positions.numpy()[unused[0]], more["positions"][-1])
    assert euler_and_components(result.mesh.faces.numpy(), result.mesh.halfedges.twin.numpy()) == (
        euler_and_components(mesh.faces.numpy(), mesh.halfedges.twin.numpy())
    )
    assert farthest_vertex(before, result) <= 1


def duplicates(quads):
    return len(quads) - len(np.unique(np.sort(quads, axis=1), axis=0))


def valences_by_edges(quads, twin, count):
    """Outgoing halfedges, and incoming ones without a twin."""
    heads = np.roll(quads, -1, axis=1).ravel()
    return np.bincount(quads.ravel(), minlength=count) + np.bincount(heads[twin == NO_TWIN], minlength=count)


def values_at_vertices(volume, surface):
    """The trilinear interpolant at each vertex, double precision; the border is open."""
    _, ny, nx = volume.values.shape
    cell, local = surface.placement.cell.numpy(), surface.placement.local.numpy().astype(float)
    i, j, k = cell % nx, cell // nx % ny, cell // (nx * ny)
    result = np.zeros(len(cell))
    for c in range(8):
        step = np.array([c & 1, c >> 1 & 1, c >> 2])
        weight = np.where(step, local, 1 - local).prod(axis=1)
        result += weight * volume.values[k + step[2], j + step[1], i + step[0]]
    return result


NOISE = {
    "white": lambda: white_noise(12),
    "smooth": lambda: smooth_noise(20, 1.0),
    "genus two": lambda: paper_field("genus_two", 32),
}


@pytest.mark.parametrize("name", NOISE)
@pytest.mark.parametrize("border", ["open", "closed"])
def test_each_round_keeps_the_mesh_whole(extract, name, border):
    before = by_patterns(extract(NOISE[name](), border=border, threads=2))
    arrays = as_arrays(before)
    irregular = [irregular_percent(before.mesh)]
    for count in (0, 1, 4):
        result = remeshed(before, count)
        assert_whole(before, result)
        assert_not_warped(before, result)
        irregular.append(irregular_percent(result.mesh))
    assert irregular[-1] < irregular[1] == irregular[0]
    for key, value in as_arrays(before).items():
        np.testing.assert_array_equal(value, arrays[key], err_msg=f"{key} was changed")


@settings(max_examples=25)
@given(volumes_with_settings())
def test_any_mesh_stays_whole(volume_and_settings):
    volume, chosen = volume_and_settings
    before = by_patterns(extract_on("cpu", volume, chosen))
    result = remeshed(before, 3)
    one_fan = chosen.topology == "manifold" or chosen.border == "closed"
    assert_whole(before, result, one_fan=one_fan)


def test_shapes_get_better_than_by_relaxation_alone(extract):
    before = by_patterns(extract(paper_field("genus_two", 48), threads=2))
    smoothed = relaxed(before, 5)
    result = remeshed(before, 20)
    qualities = [measure_quality(found.mesh) for found in (smoothed, result)]
    assert qualities[1].shape_mean > qualities[0].shape_mean
    assert result.mesh.face_count >= 0.9 * before.mesh.face_count
    assert turned_pairs(result) == turned_pairs(before) == 0


def test_vertices_stay_on_the_surface(extract):
    volume = paper_field("genus_two", 48)
    result = remeshed(by_patterns(extract(volume, threads=2)), 10)
    found = values_at_vertices(volume, result)
    assert np.abs(found).max() <= 1e-5 * np.ptp(volume.values)


@pytest.mark.parametrize("name", ["white", "smooth"])
@pytest.mark.parametrize("rounds", [0, 6])
def test_no_vertex_is_left_behind_and_no_quad_leaves_the_surface(extract, name, rounds):
    before = by_patterns(extract(NOISE[name](), border="closed", threads=2))
    result = remeshed(before, rounds)
    assert (result.operations > 0) == (rounds > 0)
    assert farthest_vertex(before, result) <= 1
    assert high_quads(before) > 0
    assert high_quads(result) == 0


def test_a_tracked_point_stays_with_a_nearest_quad_within_reach(extract):
    before = by_patterns(extract(smooth_noise(32, 1.0), border="closed", threads=2))
    mesh, placement = before.mesh, before.placement
    places = (mesh.halfedges.vertex_halfedge, placement.cell, placement.local)
    tracked = track_vertices(placement.frame.grid, *places, mesh.device)
    smoothed = relaxed(before, 5, tracked=tracked)
    corners = index_positions(smoothed)[smoothed.mesh.faces.numpy()[tracked.nearest_quad.numpy()]]
    gaps = points_of(corners, 3) - tracked.point.numpy()[:, None, :]
    assert np.linalg.norm(gaps, axis=2).min(axis=1).max() <= FARTHEST + 1e-4


@pytest.mark.slow
def test_a_scan_gets_better_in_every_respect(extract, sample_data):
    volume = read_volume(str(sample_data / "nrrd" / "tooth.nrrd"), ReadSettings())
    before = by_patterns(extract(volume, 500.0, border="closed", threads=2))
    result = remeshed(before, 5)
    assert_goals(before, result, GOALS["nrrd_tooth/tooth.nhdr"])
    assert 0 < warped_quads(result) < warped_quads(before)


@pytest.mark.parametrize(
    "make",
    [
        lambda: smooth_noise(20, 1.0),
        lambda: white_noise(10),
        pytest.param(lambda: smooth_noise(40, 1.0), marks=pytest.mark.slow),
        pytest.param(lambda: white_noise(24), marks=pytest.mark.slow),
    ],
    ids=["smooth", "white", "large smooth", "large white"],
)
def test_threads_do_not_show(extract, make):
    volume = make()
    one, *others = [remeshed(by_patterns(extract(volume, threads=n)), 2) for n in (1, 2, 3)]
    for other in others:
        assert one.operations == other.operations > 0
        for key, value in as_arrays(one).items():
            np.testing.assert_array_equal(value, as_arrays(other)[key])
        np.testing.assert_array_equal(one.mesh.halfedges.twin.numpy(), other.mesh.halfedges.twin.numpy())


def test_colors_stay_proper(extract):
    mesh = colored(extract(smooth_noise(20, 1.0), border="closed", threads=2))
    result = remeshed(simplified(mesh), 6).mesh
    colors = result.face_values
    twin, color = result.halfedges.twin.numpy(), np.repeat(colors[COLOR].numpy(), 4)
    assert color.max() < 5
    assert (color != color[twin]).all()
    assert colors[COLOR24].shape == colors[COLOR].shape


def test_high_quads_may_fold_only_when_they_are_still_there_after_three_mendings(monkeypatch):
    told = []

    def mend(self, high, turn):
        told.append(turn)
        return mend_once(self, high, turn)

    def launch(self, kernel, dim, inputs, outputs, *sizes, **named):
        if kernel.key == "mend_kernel":
            *_, limits, _begin, _end = inputs
            told.append(("may fold", limits.may_fold, round(limits.height, 6)))
        return launch_once(self, kernel, dim, inputs, outputs, *sizes, **named)

    mend_once, launch_once = rounds.Rounds._mend, Device.launch
    monkeypatch.setattr(rounds.Rounds, "_mend", mend)
    monkeypatch.setattr(Device, "launch", launch)
    monkeypatch.setattr(rounds, "flag_high", lambda mesh, context: wp.full(mesh.vertex_count, 1, wp.uint8))
    remeshed(by_patterns(extract_on("cpu", one_inside_node(), SurfaceSettings(isovalue=0.0))), 0)
    assert told[::2] == list(range(8))
    assert told[1::2] == [("may fold", int(turn >= 3), 0.35) for turn in range(8)]
    told.clear()
    monkeypatch.setattr(
        rounds, "flag_high", lambda mesh, context: mesh.device.zeros(mesh.vertex_count, wp.uint8)
    )
    remeshed(by_patterns(extract_on("cpu", one_inside_node(), SurfaceSettings(isovalue=0.0))), 0)
    assert told[::2] == [0, 1, 2]


SMALL = {
    "one cell": lambda: one_cell(0x81),
    "box": one_inside_node,
    "plane": plane,
    "single quad": lambda: plane(nodes=3, height=0.5),
    "empty": lambda: one_cell(0),
}


@pytest.mark.parametrize("name", SMALL)
@pytest.mark.parametrize("border", ["open", "closed"])
def test_small_surfaces_pass_unharmed(extract, name, border):
    before = by_patterns(extract(SMALL[name](), border=border))
    result = remeshed(before, 4)
    assert_whole(before, result)


@pytest.mark.parametrize(
    ("chosen", "message"),
    [
        ({"remesh": -1}, "remesh is -1"),
        (
            {"remesh": 20, "simplify_rules": "paper"},
            "remesh is 20, but simplify_rules is 'paper'",
        ),
        ({"remesh": 20, "project": False}, "but project is off"),
    ],
)
def test_settings_that_do_not_go_together_are_refused(chosen, message):
    with pytest.raises(SettingsError, match=message):
        MeshSettings(**chosen)


def assert_goals(before, result, most_irregular):
    """Fail unless few vertices are irregular, shapes better than by relaxation, and nothing was lost."""
    assert_whole(before, result)
    assert irregular_percent(result.mesh) < most_irregular
    smoothed = relaxed(before, 5)
    qualities = [measure_quality(found.mesh) for found in (smoothed, result)]
    assert qualities[1].shape_mean > qualities[0].shape_mean
    assert qualities[1].shape_min > qualities[0].shape_min
    assert result.mesh.face_count >= 0.9 * before.mesh.face_count
    assert farthest_vertex(before, result) <= 1
    assert high_quads(result) == 0
    assert turned_pairs(result) <= turned_pairs(before)
    assert_not_warped(before, result)


@pytest.mark.slow
@pytest.mark.real
@pytest.mark.parametrize("name", GOALS, ids=lambda name: name.split("/")[-1])
def test_scans_keep_less_than_a_third_of_what_the_patterns_leave(extract, shared_data, name):
    volume = read_real_volume(shared_data, name)
    before = by_patterns(extract(volume, REAL_VOLUMES[name][0], border="closed", threads=2))
    result = remeshed(before, 20)
    assert_goals(before, result, MISSED.get(name, GOALS[name]))
    if name in MISSED:
        assert irregular_percent(result.mesh) >= GOALS[name], "the goal is met: it is missed no more"
        pytest.xfail(f"{irregular_percent(result.mesh):.1f} % irregular, the goal is {GOALS[name]:.2f} %")


@pytest.mark.slow
def test_genus_two_keeps_few_irregular_vertices(extract):
    before = by_patterns(extract(paper_field("genus_two", 256), threads=2))
    assert_goals(before, remeshed(before, 20), 1.2)
