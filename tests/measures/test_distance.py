"""Distances between meshes: exact constructions, plain point-triangle distances, symmetry, sampling."""

import numpy as np
import pytest
import trimesh
import warp as wp
from hypothesis import given, strategies as st

from dmc_cli.errors import CallError, SettingsError
from dmc_cli.measures.distance import measure_distance
from dmc_cli.measures.nearest import NearestFaces
from dmc_cli.measures.sampling import sample_surface
from dmc_cli.runtime.device import Device
from tests import shapes
from tests.measures.splits import split_triangles
from tests.mesh.meshes import on_device


def between(first, second, density=None, device="cpu", threads=2):
    place = Device(device, threads)
    return measure_distance(on_device(first, place), on_device(second, place), density)


def samples_of(shape, density, device="cpu"):
    return sample_surface(on_device(shape, Device(device, 2)), density).numpy()


def nearest_of(shape, queries, device="cpu"):
    points = wp.array(np.asarray(queries, float), dtype=wp.vec3d, device=device)
    return NearestFaces(on_device(shape, Device(device, 2))).distances(points)


def triangles_of(shape):
    """The triangles of a shape at float32 positions, split as the measures split quads, (T, 3, 3)."""
    return np.asarray(shape[0], np.float32).astype(float)[split_triangles(shape)]


def plain_distances(shape, queries):
    """Distance of each point from the nearest triangle, by trimesh's closest points."""
    triangles = triangles_of(shape)
    areas = np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    triangles = triangles[areas > 0]
    found = []
    for p in np.asarray(queries, float):
        near = trimesh.triangles.closest_point(triangles, np.broadcast_to(p, (len(triangles), 3)))
        found.append(np.linalg.norm(near - p, axis=1).min())
    return np.array(found)


SHAPES = {
    "cube": shapes.cube(),
    "torus": shapes.torus(23, 11),
    "house": shapes.house(),
    "sphere": shapes.halved(shapes.sphere(7), 3),
}


@pytest.mark.parametrize("name", SHAPES)
def test_distances_are_those_of_the_nearest_triangle(device, name):
    shape = SHAPES[name]
    rng = np.random.default_rng(1)
    queries = np.concatenate([rng.uniform(-3, 3, (150, 3)), samples_of(shape, 3.0)[:50]])
    found = nearest_of(shape, queries, device)
    assert found == pytest.approx(plain_distances(shape, queries), abs=1e-12)
    assert found[150:].max() < 1e-6


coordinate = st.floats(-4, 4, width=16)
point = st.tuples(coordinate, coordinate, coordinate)


@given(st.lists(point, min_size=6, max_size=6), st.lists(point, min_size=1, max_size=3))
def test_distances_from_any_faces_are_those_of_dense_samples(points, queries):
    """Also from faces without an area: no point of a face is nearer, and one about as near is found."""
    faces = np.array([[0, 1, 2, 3], [3, 4, 5, -1]], np.int32)
    shape = np.array(points), faces
    found = nearest_of(shape, queries)
    steps = np.linspace(0, 1, 33)
    u, v = (a.ravel() for a in np.meshgrid(steps, steps))
    corners = triangles_of(shape)
    weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)
    dense = np.einsum("sk,tkx->tsx", weights, corners).reshape(-1, 3)
    least = np.linalg.norm(dense[None] - np.array(queries)[:, None], axis=2).min(axis=1)
    assert (found <= least + 1e-9).all()
    assert (found >= least - 0.6).all()
    if (dense.max(axis=0) == dense.min(axis=0)).all():
        assert found == pytest.approx(least, abs=1e-12)


def test_a_moved_plate_is_as_far_as_it_moved(device):
    plate = shapes.grid(6, 4)
    found = between(plate, shapes.moved(plate, (0, 0, 0.25)), 50.0, device)
    for way in (found.to_other, found.from_other):
        assert way.samples == pytest.approx(24 * 50, abs=1)
        for value in (way.mean, way.rms, way.percentile_95, way.max):
            assert value == pytest.approx(0.25)
    assert found.both.samples == 2 * found.to_other.samples
    assert found.density == 50.0


def test_ways_differ_where_a_part_is_missing(device):
    """From the half plate nothing is far; from the whole one a quarter of the area is, on average by half."""
    whole, half = shapes.grid(4, 1), shapes.grid(2, 1)
    found = between(half, whole, 2000.0, device)
    assert found.to_other.max == 0.0
    assert found.from_other.max == 2.0
    assert found.from_other.mean == pytest.approx(0.5 * 1.0, rel=2e-3)
    assert found.from_other.rms == pytest.approx(np.sqrt(0.5 * 4 / 3), rel=2e-3)
    assert found.from_other.percentile_95 == pytest.approx(2 - 0.05 * 4, rel=5e-3)
    assert found.both.mean == pytest.approx(1.0 / 3, rel=2e-3)
    assert found.both.max == 2.0


def test_the_largest_distance_is_at_a_vertex_that_no_sample_meets(device):
    tip = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-4, 5]]), np.array([[0, 1, 2, -1]], np.int32)
    found = between(tip, shapes.moved(shapes.grid(2, 2), (-0.5, -1, 0)), 10.0, device)
    assert found.to_other.max == 5.0
    assert found.to_other.percentile_95 < 5.0


def test_a_quarter_of_a_million_samples_are_on_the_larger_mesh():
    found = between(shapes.cube(), shapes.grid(1, 1))
    assert found.to_other.samples == pytest.approx(250_000, abs=1)
    assert found.from_other.samples == pytest.approx(250_000 / 6, abs=1)
    assert found.density == pytest.approx(250_000 / 6)


def test_meshes_change_places():
    first, second = shapes.torus(21, 14), shapes.sphere(9)
    there, back = between(first, second, 20.0), between(second, first, 20.0)
    assert there.to_other == back.from_other
    assert there.from_other == back.to_other
    assert there.both.max == back.both.max


@pytest.mark.parametrize("density", [0.3, 7.0, 111.0])
def test_samples_are_spread_by_area(device, density):
    shape = shapes.halved(shapes.torus(17, 12), 3)
    triangles = triangles_of(shape)
    areas = (
        np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
        / 2
    )
    found = samples_of(shape, density, device)
    assert len(found) == pytest.approx(areas.sum() * density, abs=0.6)
    assert nearest_of(shape, found).max(initial=0.0) < 1e-6


def test_samples_of_a_quad_are_uniform():
    points = np.array([[0, 0, 0], [3, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    found = samples_of((points, np.array([[0, 1, 2, 3]], np.int32)), 5000.0)
    assert len(found) == 10000
    for x in (0.5, 1.0, 2.0):
        inside = min(x, 1.0) + max(0.0, x - 1) - max(0.0, x - 1) ** 2 / 4
        assert (found[:, 0] < x).mean() == pytest.approx(inside / 2, abs=2e-3)
    assert (found[:, 1] < 0.5).mean() == pytest.approx((1.5 - 0.25) / 2, abs=2e-3)


def test_threads_do_not_show(device):
    first, second = shapes.torus(101, 53), shapes.moved(shapes.torus(67, 91), (0.1, 0.2, 0))
    one = between(first, second, 100.0, device, threads=1)
    assert all(between(first, second, 100.0, device, threads=n) == one for n in (2, 3, 5))


def test_meshes_without_an_area_have_their_vertices():
    line = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], float), np.array([[0, 1, 2, -1]], np.int32)
    found = between(line, shapes.moved(line, (0, 3, 4)))
    assert found.density is None
    assert (found.to_other.samples, found.to_other.mean, found.to_other.max) == (0, None, 5.0)


@pytest.mark.parametrize("density", [0.0, -1.0, np.nan, np.inf, 1e12])
def test_a_density_that_cannot_be_is_refused(density):
    with pytest.raises(SettingsError, match="density is"):
        between(shapes.cube(), shapes.cube(), density)


def test_a_mesh_without_faces_is_refused():
    with pytest.raises(CallError, match="without faces"):
        between(shapes.cube(), (np.zeros((0, 3)), np.zeros((0, 4), np.int32)))
