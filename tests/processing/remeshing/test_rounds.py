"""`--remesh` lowers irregular vertices and keeps every promise, after each round."""

import numpy as np
import pytest
import warp as wp
from hypothesis import given, settings
from scipy.spatial import cKDTree

from dmc_cli.contouring.dual_marching_cubes.halfedges.build import build_halfedges
from dmc_cli.errors import SettingsError
from dmc_cli.field.field import cell_values
from dmc_cli.field.projection import point_at
from dmc_cli.field.trilinear import single_precision, trilinear_value
from dmc_cli.measures.quality import measure_quality
from dmc_cli.measures.topology import measure_topology
from dmc_cli.mesh.check_halfedges import NO_TWIN, check_halfedges
from dmc_cli.mesh.valences import irregular_percent
from dmc_cli.processing.distance_guard import FARTHEST, track_vertices
from dmc_cli.processing.patterns.simplify import simplify
from dmc_cli.processing.relaxation.relax import relax
from dmc_cli.processing.remeshing import rounds
from dmc_cli.processing.remeshing.rounds import remesh
from dmc_cli.processing.tangent_step import SurfaceContext, make_context
from dmc_cli.runtime.device import Device
from dmc_cli.settings import MeshSettings, ReadSettings, SurfaceSettings
from dmc_cli.volume_io.read import read_volume
from tests.contouring.dual_marching_cubes.agreement import as_arrays, extract_on
from tests.contouring.dual_marching_cubes.real import REAL_VOLUMES, read_real_volume
from tests.fields import one_cell, one_inside_node, paper_field, plane, smooth_noise, white_noise
from tests.mesh.meshes import colored, euler_and_components, quad_normals, vertex_pair_uses
from tests.reference import table
from tests.strategies import volumes_with_settings

PATTERNS = MeshSettings(simplify="all")
GOALS = {row["volume"]: float(row["irregular_percent_after"]) / 3 for row in table("regression_real.csv")}


def by_patterns(surface):
    """The mesh that the rounds start from; its arrays are copies."""
    result = simplify(surface, build_halfedges(surface), PATTERNS)
    return result.surface, result.halfedges


def turned_pairs(surface, halfedges):
    """Twins whose quads' normals are more than 90 degrees apart."""
    normals = quad_normals(surface.vertices.numpy().astype(float), surface.quads.numpy())
    twin = halfedges.twin.numpy()
    with_twin = np.flatnonzero(twin != NO_TWIN)
    return int(((normals[with_twin // 4] * normals[twin[with_twin] // 4]).sum(axis=1) < 0).sum() // 2)


def assert_whole(before, after, *, one_fan=True):
    """Fail unless a mesh is as sound as the one before it."""
    (old, old_halfedges), (new, new_halfedges) = before, after
    quads, twin = new.quads.numpy(), new_halfedges.twin.numpy()
    check_halfedges(quads, twin, new_halfedges.vertex_halfedge.numpy(), one_fan=one_fan)
    assert euler_and_components(quads, twin) == euler_and_components(
        old.quads.numpy(), old_halfedges.twin.numpy()
    )
    count = new.vertices.shape[0]
    assert (np.unique(quads) == np.arange(count)).all()
    found = measure_topology(new.device, new.quads, new_halfedges.twin, count)
    was = measure_topology(old.device, old.quads, old_halfedges.twin, old.vertices.shape[0])
    assert found.non_manifold_edges <= was.non_manifold_edges
    assert found.non_manifold_vertices <= was.non_manifold_vertices
    corners = np.sort(quads, axis=1)
    assert (corners[:, 1:] != corners[:, :-1]).all(), "a vertex twice in a quad"
    assert duplicates(quads) <= duplicates(old.quads.numpy())
    assert (vertex_pair_uses(quads) > 2).sum() <= (vertex_pair_uses(old.quads.numpy()) > 2).sum()
    valence, old_valence = new_halfedges.valence.numpy(), old_halfedges.valence.numpy()
    assert (valence == valences_by_edges(quads, twin, count)).all()
    assert (valence < 3).sum() <= (old_valence < 3).sum()
    assert (valence > 8).sum() <= (old_valence > 8).sum()
    local = new.vertex_local.numpy()
    assert np.isfinite(new.vertices.numpy()).all()
    assert ((local >= 0) & (local <= 1)).all()


def duplicates(quads):
    return len(quads) - len(np.unique(np.sort(quads, axis=1), axis=0))


def valences_by_edges(quads, twin, count):
    """Outgoing halfedges, and incoming ones without a twin."""
    heads = np.roll(quads, -1, axis=1).ravel()
    return np.bincount(quads.ravel(), minlength=count) + np.bincount(heads[twin == NO_TWIN], minlength=count)


def values_at_vertices(volume, surface):
    """The trilinear interpolant at each vertex, double precision; the border is open."""
    _, ny, nx = volume.values.shape
    cell, local = surface.vertex_cell.numpy(), surface.vertex_local.numpy().astype(float)
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
    arrays = as_arrays(before[0])
    irregular = [irregular_percent(before[0].device, before[1].valence)]
    for count in (0, 1, 4):
        result = remesh(*before, count)
        assert_whole(before, (result.surface, result.halfedges))
        irregular.append(irregular_percent(result.surface.device, result.halfedges.valence))
    assert irregular[-1] < irregular[1] == irregular[0]
    for key, value in as_arrays(before[0]).items():
        np.testing.assert_array_equal(value, arrays[key], err_msg=f"{key} was changed")


@settings(max_examples=25)
@given(volumes_with_settings())
def test_any_mesh_stays_whole(volume_and_settings):
    volume, chosen = volume_and_settings
    before = by_patterns(extract_on("cpu", volume, chosen))
    result = remesh(*before, 3)
    one_fan = chosen.topology == "manifold" or chosen.border == "closed"
    assert_whole(before, (result.surface, result.halfedges), one_fan=one_fan)


def test_shapes_get_better_than_by_relaxation_alone(extract):
    before = by_patterns(extract(paper_field("genus_two", 48), threads=2))
    relaxed = relax(*before, 5)
    result = remesh(*before, 20)
    qualities = [
        measure_quality(mesh.device, mesh.vertices, mesh.quads) for mesh in (relaxed, result.surface)
    ]
    assert qualities[1].shape_mean > qualities[0].shape_mean
    assert result.surface.quads.shape[0] >= 0.9 * before[0].quads.shape[0]
    assert turned_pairs(result.surface, result.halfedges) == turned_pairs(*before) == 0


def test_vertices_stay_on_the_surface(extract):
    volume = paper_field("genus_two", 48)
    result = remesh(*by_patterns(extract(volume, threads=2)), 10)
    found = values_at_vertices(volume, result.surface)
    assert np.abs(found).max() <= 1e-5 * np.ptp(volume.values)


@pytest.mark.parametrize("name", ["white", "smooth"])
@pytest.mark.parametrize("rounds", [0, 6])
def test_no_vertex_is_left_behind_and_no_quad_leaves_the_surface(extract, name, rounds):
    before = by_patterns(extract(NOISE[name](), border="closed", threads=2))
    result = remesh(*before, rounds)
    assert (result.operations > 0) == (rounds > 0)
    assert farthest_vertex(before[0], result.surface) <= 1
    assert high_quads(before[0]) > 0
    assert high_quads(result.surface) == 0


def index_positions(surface):
    """Where the vertices are, in node indices."""
    cell, grid = surface.vertex_cell.numpy(), surface.grid
    nodes = np.stack([cell % grid.nx, cell // grid.nx % grid.ny, cell // (grid.nx * grid.ny)], axis=1)
    return nodes + surface.vertex_local.numpy().astype(float)


def points_of(corners, count):
    """Points spread evenly over bilinear quads, `count` along each side, as (quads, count^2, 3)."""
    u, v = (x.ravel()[None, :, None] for x in np.meshgrid(*[np.linspace(0, 1, count)] * 2))
    a, b, c, d = corners.transpose(1, 0, 2)[:, :, None, :]
    return (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d


def farthest_vertex(old, new):
    """The largest distance in cells of an old vertex from the new quads, at points spread over these."""
    corners, vertices = index_positions(new)[new.quads.numpy()], index_positions(old)
    found = cKDTree(points_of(corners, 5).reshape(-1, 3)).query(vertices)[0]
    centres = cKDTree(corners.mean(axis=1))
    for n in np.flatnonzero(found > 0.8):
        near = centres.query(vertices[n], k=min(24, len(corners)))[1]
        gaps = points_of(corners[np.atleast_1d(near)], 17) - vertices[n]
        found[n] = min(found[n], np.linalg.norm(gaps, axis=2).min())
    return found.max(initial=0)


def high_quads(surface):
    """How many quads' centres are more than half a cell from the surface.

    The interpolant is continuous: between a centre and a point with a value of another sign is the surface.
    """
    centres = index_positions(surface)[surface.quads.numpy()].mean(axis=1)
    device = surface.device
    distance = device.empty(len(centres), wp.float32)
    inputs = [make_context(surface), wp.array(centres, dtype=wp.vec3d, device=device.name)]
    device.launch(distances_kernel, len(centres), inputs, [distance])
    return int((distance.numpy() > 0.5).sum())


@wp.func
def value_at(context: SurfaceContext, x: wp.vec3d) -> wp.float32:
    point = point_at(context.grid, x)
    f = single_precision(
        cell_values(context.field, context.grid, point.cell[0], point.cell[1], point.cell[2])
    )
    return trilinear_value(f, point.local[0], point.local[1], point.local[2])


@wp.kernel
def distances_kernel(
    first: wp.int32,
    context: SurfaceContext,
    point: wp.array(dtype=wp.vec3d),
    distance_out: wp.array(dtype=wp.float32),
):
    n = first + wp.tid()
    here = value_at(context, point[n])
    best = wp.where(here == 0.0, 0.0, 9.0)
    for reach in range(1, 11):
        side = wp.where(best < 9.0, 0, 2 * reach + 1)
        for m in range(side * side * side):
            i = wp.vec3i(m % side - reach, m / side % side - reach, m / (side * side) - reach)
            if wp.max(wp.abs(i[0]), wp.max(wp.abs(i[1]), wp.abs(i[2]))) == reach:
                way = wp.vec3d(wp.float64(i[0]), wp.float64(i[1]), wp.float64(i[2])) * wp.float64(0.05)
                length = wp.float32(wp.length(way))
                is_across = here * value_at(context, point[n] + way) <= 0.0
                if is_across and length <= 0.5:
                    best = wp.min(best, length)
    distance_out[n] = best


def test_a_tracked_point_stays_with_a_nearest_quad_within_reach(extract):
    before = by_patterns(extract(smooth_noise(32, 1.0), border="closed", threads=2))
    surface, halfedges = before
    places = (surface.vertex_cell, surface.vertex_local)
    tracked = track_vertices(surface.grid, halfedges.vertex_halfedge, *places, surface.device)
    relaxed = relax(*before, 5, tracked=tracked)
    corners = index_positions(relaxed)[relaxed.quads.numpy()[tracked.nearest_quad.numpy()]]
    gaps = points_of(corners, 3) - tracked.point.numpy()[:, None, :]
    assert np.linalg.norm(gaps, axis=2).min(axis=1).max() <= FARTHEST + 1e-4


@pytest.mark.slow
def test_a_scan_gets_better_in_every_respect(extract, sample_data):
    volume = read_volume(str(sample_data / "nrrd" / "tooth.nrrd"), ReadSettings())
    before = by_patterns(extract(volume, 500.0, border="closed", threads=2))
    assert_goals(before, remesh(*before, 5), GOALS["nrrd_tooth/tooth.nhdr"])


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
    one, *others = [remesh(*by_patterns(extract(volume, threads=n)), 2) for n in (1, 2, 3)]
    for other in others:
        assert one.operations == other.operations > 0
        for key, value in as_arrays(one.surface).items():
            np.testing.assert_array_equal(value, as_arrays(other.surface)[key])
        np.testing.assert_array_equal(one.halfedges.twin.numpy(), other.halfedges.twin.numpy())


def test_colors_stay_proper(extract):
    mesh = colored(extract(smooth_noise(20, 1.0), border="closed", threads=2))
    patterns = mesh.simplified()
    result = remesh(patterns.surface, patterns.halfedges, 6, patterns.color, patterns.color24)
    twin, color = result.halfedges.twin.numpy(), np.repeat(result.color.numpy(), 4)
    assert color.max() < 5
    assert (color != color[twin]).all()
    assert result.color24.shape == result.color.shape


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
    monkeypatch.setattr(
        rounds, "mark_high", lambda mesh, context, device: wp.full(mesh.vertex_count, 1, wp.uint8)
    )
    remesh(*by_patterns(extract_on("cpu", one_inside_node(), SurfaceSettings(isovalue=0.0))), 0)
    assert told[::2] == list(range(8))
    assert told[1::2] == [("may fold", int(turn >= 3), 0.35) for turn in range(8)]
    told.clear()
    monkeypatch.setattr(
        rounds, "mark_high", lambda mesh, context, device: device.zeros(mesh.vertex_count, wp.uint8)
    )
    remesh(*by_patterns(extract_on("cpu", one_inside_node(), SurfaceSettings(isovalue=0.0))), 0)
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
    result = remesh(*before, 4)
    assert_whole(before, (result.surface, result.halfedges))


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
    after = (result.surface, result.halfedges)
    assert_whole(before, after)
    assert irregular_percent(result.surface.device, result.halfedges.valence) < most_irregular
    relaxed = relax(*before, 5)
    qualities = [
        measure_quality(mesh.device, mesh.vertices, mesh.quads) for mesh in (relaxed, result.surface)
    ]
    assert qualities[1].shape_mean > qualities[0].shape_mean
    assert qualities[1].shape_min > qualities[0].shape_min
    assert result.surface.quads.shape[0] >= 0.9 * before[0].quads.shape[0]
    assert farthest_vertex(before[0], result.surface) <= 1
    assert high_quads(result.surface) == 0
    assert turned_pairs(*after) <= turned_pairs(*before)


@pytest.mark.slow
@pytest.mark.real
@pytest.mark.parametrize("name", GOALS, ids=lambda name: name.split("/")[-1])
def test_scans_keep_less_than_a_third_of_what_the_patterns_leave(extract, shared_data, name):
    volume = read_real_volume(shared_data, name)
    before = by_patterns(extract(volume, REAL_VOLUMES[name][0], border="closed", threads=2))
    assert_goals(before, remesh(*before, 20), GOALS[name])


@pytest.mark.slow
def test_genus_two_keeps_few_irregular_vertices(extract):
    before = by_patterns(extract(paper_field("genus_two", 256), threads=2))
    assert_goals(before, remesh(*before, 20), 1.2)
