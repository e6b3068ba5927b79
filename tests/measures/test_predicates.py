"""Signs of determinants against exact fractions, and pairs of triangles against plain exact geometry."""

import numpy as np
import pytest
import warp as wp
from hypothesis import given, strategies as st

from dmc_cli.measures.predicates import line_side, plane_side, triangles_meet
from tests.measures.exact import exact_line_side, exact_plane_side, exact_triangles_meet


@wp.kernel(module="unique", enable_backward=False)
def plane_side_kernel(points: wp.array2d[wp.vec3f], found: wp.array[wp.int32]):
    n = wp.tid()
    found[n] = plane_side(points[n, 0], points[n, 1], points[n, 2], points[n, 3])


@wp.kernel(module="unique", enable_backward=False)
def line_side_kernel(points: wp.array2d[wp.vec3f], found: wp.array2d[wp.int32]):
    n = wp.tid()
    for axis in range(3):
        found[n, axis] = line_side(points[n, 0], points[n, 1], points[n, 2], axis)


@wp.kernel(module="unique", enable_backward=False)
def triangles_meet_kernel(points: wp.array2d[wp.vec3f], found: wp.array[wp.bool]):
    n = wp.tid()
    found[n] = triangles_meet(
        points[n, 0], points[n, 1], points[n, 2], points[n, 3], points[n, 4], points[n, 5]
    )


def evaluated(kernel, points, dtype, *columns):
    """What a kernel finds for rows of points, (N, K, 3)."""
    given = wp.array(np.asarray(points, np.float32), dtype=wp.vec3f, device="cpu")
    found = wp.zeros((len(points), *columns), dtype=dtype, device="cpu")
    wp.launch(kernel, len(points), [given], [found], device="cpu")
    return found.numpy()


def near_planes(seed, count=300):
    """Points of planes that are oblique, moved by the least step of float32, or not at all."""
    rng = np.random.default_rng(seed)
    base = rng.integers(-50, 50, (count, 3, 3)).astype(np.float32)
    weights = rng.integers(-4, 5, (count, 2))
    last = base[:, 0] + np.einsum("nk,nkx->nx", weights, base[:, 1:] - base[:, :1])
    points = np.concatenate([base, last[:, None]], axis=1).astype(np.float32) * np.float32(0.1)
    step = rng.integers(-1, 2, points.shape)
    return np.where(
        step == 0, points, np.nextafter(points, np.where(step > 0, np.inf, -np.inf).astype(np.float32))
    )


@pytest.mark.parametrize("seed", range(3))
def test_the_side_of_a_plane_is_exact(seed):
    points = near_planes(seed)
    expected = [exact_plane_side(*row) for row in points]
    assert evaluated(plane_side_kernel, points, wp.int32).tolist() == expected
    assert min(expected.count(sign) for sign in (-1, 1)) > 50


def test_points_in_a_plane_are_in_it():
    rng = np.random.default_rng(5)
    points = rng.integers(-5000, 5000, (200, 4, 3)).astype(np.float32)
    points[:, 3] = points[:, 0] + (points[:, 1] - points[:, 2]) * rng.integers(1, 9, (200, 1))
    assert not evaluated(plane_side_kernel, points, wp.int32).any()


coordinate = st.one_of(
    st.sampled_from([0.0, 1e-45, -1e-45, float(np.float32(3e38)), 1.0, 0.1]),
    st.floats(allow_nan=False, allow_infinity=False, width=32),
    st.integers(-3, 3).map(float),
)


@given(st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=4, max_size=4))
def test_any_coordinates_have_an_exact_sign(points):
    rows = np.array([points], np.float32)
    assert evaluated(plane_side_kernel, rows, wp.int32).tolist() == [exact_plane_side(*rows[0])]
    expected = [exact_line_side(*rows[0, :3], axis) for axis in range(3)]
    assert evaluated(line_side_kernel, rows, wp.int32, 3)[0].tolist() == expected


small = st.integers(0, 2).map(float)


@given(st.lists(st.tuples(small, small, small), min_size=6, max_size=6))
def test_small_triangles_meet_as_by_exact_geometry(points):
    rows = np.array([points], np.float32)
    assert evaluated(triangles_meet_kernel, rows, wp.bool).tolist() == [exact_triangles_meet(*points)]


@pytest.mark.parametrize("flat", [False, True])
def test_many_triangles_meet_as_by_exact_geometry(flat):
    rng = np.random.default_rng(int(flat))
    points = rng.integers(0, 4, (2000, 6, 3)).astype(np.float32)
    if flat:
        points[:, :, 2] = points[:, :, 0] + 2 * points[:, :, 1]
    found = evaluated(triangles_meet_kernel, points, wp.bool).tolist()
    assert found == [exact_triangles_meet(*row) for row in points.tolist()]
    assert 300 < sum(found) < 1700


def test_the_order_of_corners_does_not_matter():
    rng = np.random.default_rng(7)
    points = rng.integers(0, 3, (3000, 6, 3)).astype(np.float32)
    expected = evaluated(triangles_meet_kernel, points, wp.bool)
    for order in ([1, 2, 0, 3, 4, 5], [0, 2, 1, 3, 4, 5], [3, 4, 5, 0, 1, 2], [0, 1, 2, 5, 3, 4]):
        assert (evaluated(triangles_meet_kernel, points[:, order], wp.bool) == expected).all()
    turned = points[:, :, [1, 2, 0]]
    assert (evaluated(triangles_meet_kernel, turned, wp.bool) == expected).all()
