"""Distances of points from quads and the quads nearest to them agree with brute force, and quotas add up."""

import numpy as np
import pytest
import warp as wp
from hypothesis import given, strategies as st

from dmc_cli.processing.decimation.guard import assign_listed, distance_from_triangles, nearest_round
from dmc_cli.processing.decimation.rounds import share_out
from tests.mesh.hand_made import working
from tests.shapes import torus

wp.set_module_options({"enable_backward": False})


@wp.kernel
def distance_kernel(
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    quad: wp.array(dtype=wp.int32),
    point: wp.array(dtype=wp.vec3),
    told: wp.array(dtype=wp.float32),
):
    n = wp.tid()
    told[n] = distance_from_triangles(corners, position, quad[n], point[n])


@wp.kernel
def nearest_kernel(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    quad: wp.array(dtype=wp.int32),
    point: wp.array(dtype=wp.vec3),
    told: wp.array(dtype=wp.int32),
):
    n = wp.tid()
    told[n] = nearest_round(corners, twin, position, quad[n], point[n])


@wp.kernel
def assign_kernel(
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    face_gone: wp.array(dtype=wp.uint8),
    patch: wp.array2d(dtype=wp.int32),
    patched: wp.int32,
    place: wp.array(dtype=wp.vec3),
    nearest_quad: wp.array(dtype=wp.int32),
    listed: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    count: wp.int32,
    farthest: wp.float32,
    new_nearest: wp.array2d(dtype=wp.int32),
    told: wp.array(dtype=wp.int32),
):
    is_near = assign_listed(
        corners,
        position,
        face_gone,
        patch,
        patched,
        place,
        nearest_quad,
        listed,
        b,
        count,
        farthest,
        new_nearest,
    )
    told[0] = wp.where(is_near, 1, 0)


def integers(values):
    return wp.array(np.array(values, dtype=np.int32), dtype=wp.int32, device="cpu")


def vectors(values):
    return wp.array(np.float32(values).reshape(-1, 3), dtype=wp.vec3, device="cpu")


def distances(corners, position, quads, points):
    """Return how far points are from quads, one of each."""
    told = wp.zeros(len(points), dtype=wp.float32, device="cpu")
    inputs = [corners, position, integers(quads), vectors(points)]
    wp.launch(distance_kernel, len(points), [*inputs, told], device="cpu")
    return told.numpy()


class Crowd:
    """A rough torus of 48 quads, points near it, and how far each is from each quad."""

    def __init__(self, seed, count):
        self.rng = np.random.default_rng(seed)
        points, self.quads = torus(8, 6)
        points = points + self.rng.normal(size=points.shape) * 0.1
        self.mesh = working((points, self.quads)).arrays
        self.old = self.rng.integers(0, 48, count)
        self.points = points[self.quads[self.old, 0]] + self.rng.normal(size=(count, 3)) * 0.3
        pairs = np.tile(np.arange(48), count), np.repeat(self.points, 48, axis=0)
        self.distance = distances(self.mesh.corners, self.mesh.position, *pairs).reshape(count, 48)

    def assign(self, listed, patch, gone, farthest):
        """Return whether all listed points are near enough, and which quads they have then."""
        region, patches, lists = 1, np.full((3, 60), 10**6), np.full((3, 60), 10**6)
        patches[region, : len(patch)], lists[region, : len(listed)] = patch, listed
        is_gone = wp.array(np.isin(np.arange(48), gone).astype(np.uint8), dtype=wp.uint8, device="cpu")
        found, told = integers(np.full((3, 60), -7)), integers([-1])
        mesh, points = self.mesh, [vectors(self.points), integers(self.old), integers(lists)]
        inputs = [mesh.corners, mesh.position, is_gone, integers(patches), len(patch), *points, region]
        wp.launch(assign_kernel, 1, [*inputs, len(listed), farthest, found, told], device="cpu")
        assert (found.numpy()[[0, 2]] == -7).all()
        assert (found.numpy()[region, len(listed) :] == -7).all()
        return bool(told.numpy()[0]), found.numpy()[region, : len(listed)]


def sampled_distance(point, triangles, steps=60):
    """The least distance of a point from a grid of points on triangles, (2, 3, 3)."""
    u, v = np.meshgrid(np.linspace(0, 1, steps), np.linspace(0, 1, steps))
    u, v = u[u + v <= 1 + 1e-12], v[u + v <= 1 + 1e-12]
    weights = np.stack([1 - u - v, u, v], axis=1)
    return min(np.linalg.norm(weights @ triangle - point, axis=1).min() for triangle in triangles)


def test_a_points_distance_from_a_quad_is_that_of_the_worse_split():
    rng = np.random.default_rng(5)
    count = 200
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    quads = square + rng.uniform(-0.3, 0.3, (count, 4, 3))
    points = rng.uniform(-1, 2, (count, 3))
    told = distances(integers(np.arange(4 * count)), vectors(quads), np.arange(count), points)
    for n, (a, b, c, d) in enumerate(quads):
        splits = [[(a, b, c), (a, c, d)], [(a, b, d), (b, c, d)]]
        expected = max(sampled_distance(points[n], np.array(split)) for split in splits)
        assert expected - 0.03 <= told[n] <= expected + 1e-5


def test_the_nearest_quad_round_one_is_that_of_it_and_its_neighbours():
    crowd = Crowd(2, 300)
    told = wp.zeros(300, dtype=wp.int32, device="cpu")
    mesh = crowd.mesh
    inputs = [mesh.corners, mesh.twin, mesh.position, integers(crowd.old), vectors(crowd.points)]
    wp.launch(nearest_kernel, 300, [*inputs, told], device="cpu")
    places = set()
    for n, q in enumerate(crowd.old):
        round_q = np.flatnonzero(np.isin(crowd.quads, crowd.quads[q]).any(axis=1))  # all valences are 4
        assert len(round_q) == 9
        assert told.numpy()[n] in round_q
        assert crowd.distance[n, told.numpy()[n]] == crowd.distance[n, round_q].min()
        places.add(np.flatnonzero(round_q == told.numpy()[n])[0])
    assert len(places) > 6


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 40])
@pytest.mark.parametrize("patched", [1, 16, 20])
def test_a_point_keeps_its_quad_while_it_is_near_enough_and_has_the_nearest_of_the_patch_else(count, patched):
    crowd = Crowd(count, 50)
    patch, listed = crowd.rng.permutation(48)[:patched], crowd.rng.permutation(50)[:count]
    gone = np.setdiff1d(crowd.rng.permutation(48)[:12], patch)
    outcomes = set()
    for farthest in np.float32([0.0001, 0.05, 0.2, 0.4, 0.8, 1.6, 8]):
        expected = []
        for n in listed:
            old, nearest = crowd.old[n], patch[crowd.distance[n, patch].argmin()]
            if old not in gone and crowd.distance[n, old] <= farthest:
                expected.append(old)
            elif crowd.distance[n, nearest] <= farthest:
                expected.append(nearest)
            else:
                expected.append(-1)
        is_near, found = crowd.assign(listed, patch, gone, farthest)
        assert is_near == (-1 not in expected)
        if is_near:
            assert found.tolist() == expected
        outcomes.add(is_near)
    assert outcomes == ({True} if count == 0 else {True, False})


@given(st.lists(st.integers(0, 1000), min_size=1, max_size=30), st.integers(0, 40_000))
def test_quotas_add_up_and_no_region_has_more_than_it_offers(candidates, more):
    offered = np.array(candidates, dtype=np.int64)
    quota = share_out(offered, more)
    assert (quota >= 0).all()
    assert (quota <= offered).all()
    assert quota.sum() == min(more, offered.sum())
