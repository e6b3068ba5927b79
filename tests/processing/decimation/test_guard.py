"""Distances of points from quads agree with brute force, and quotas add up."""

import numpy as np
import warp as wp
from hypothesis import given, strategies as st

from dmc_cli.processing.decimation.guard import distance_from_triangles
from dmc_cli.processing.decimation.rounds import share_out

wp.set_module_options({"enable_backward": False})


@wp.kernel
def distance_kernel(
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    point: wp.array(dtype=wp.vec3),
    told: wp.array(dtype=wp.float32),
):
    n = wp.tid()
    told[n] = distance_from_triangles(corners, position, n, point[n])


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
    told = wp.zeros(count, dtype=wp.float32, device="cpu")
    corners = wp.array(np.arange(4 * count, dtype=np.int32), dtype=wp.int32, device="cpu")
    position = wp.array(quads.reshape(-1, 3).astype(np.float32), dtype=wp.vec3, device="cpu")
    point = wp.array(points.astype(np.float32), dtype=wp.vec3, device="cpu")
    wp.launch(distance_kernel, count, [corners, position, point, told], device="cpu")
    for n, (a, b, c, d) in enumerate(quads):
        splits = [[(a, b, c), (a, c, d)], [(a, b, d), (b, c, d)]]
        expected = max(sampled_distance(points[n], np.array(split)) for split in splits)
        assert expected - 0.03 <= told.numpy()[n] <= expected + 1e-5


@given(st.lists(st.integers(0, 1000), min_size=1, max_size=30), st.integers(0, 40_000))
def test_quotas_add_up_and_no_region_has_more_than_it_offers(candidates, more):
    offered = np.array(candidates, dtype=np.int64)
    quota = share_out(offered, more)
    assert (quota >= 0).all()
    assert (quota <= offered).all()
    assert quota.sum() == min(more, offered.sum())
