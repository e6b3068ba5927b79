"""Tracked points: which quads they are assigned to, how far is too far, and who retreats for them."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.field.grid import GridShape
from dmc_cli.processing.distance_guard import (
    TrackedPoints,
    keep_points_near,
    list_points,
    track_vertices,
    with_nearer_quads,
)
from tests import shapes
from tests.mesh.hand_made import numbers, working

GRID = GridShape(40, 30, 9, 0)
FLOOR = np.array([0.25, 0.5, 3.0])
"""Where the hand-made meshes lie, in node indices."""


def placed(shape, scale=1.0):
    """A hand-made mesh in the grid: its working mesh, and the positions of its vertices in node indices."""
    points, quads = shape
    points = points * scale + FLOOR
    mesh = working((points, quads))
    node = np.floor(points).astype(np.int64)
    mesh.arrays.cell = wp.array(node @ [1, GRID.nx, GRID.nx * GRID.ny], dtype=wp.int64)
    mesh.arrays.local = wp.array((points - node).astype(np.float32), dtype=wp.vec3)
    return mesh, points


def quads_of(mesh):
    return mesh.arrays.corners.numpy().reshape(-1, 4)


def tracked_at(points, nearest):
    point = np.array(points, np.float32).reshape(-1, 3)
    return TrackedPoints(wp.array(point, dtype=wp.vec3), numbers("cpu", *nearest))


def test_every_vertex_is_the_tracked_point_of_one_of_its_quads():
    mesh, points = placed(shapes.grid(5, 4))
    arrays = mesh.arrays
    tracked = track_vertices(GRID, arrays.vertex_halfedge, arrays.cell, arrays.local, mesh.device)
    np.testing.assert_allclose(tracked.point.numpy(), points, atol=1e-6)
    quads = quads_of(mesh)
    assert tracked.count == len(points)
    assert all(v in quads[nearest_quad] for v, nearest_quad in enumerate(tracked.nearest_quad.numpy()))


NINE = [(a, b) for a in (0, 0.5, 1) for b in (0, 0.5, 1)]


def kept(mesh, tracked, moved):
    """Who has to retreat, and which quads fail."""
    quads, vertices = mesh.face_count, mesh.arrays.cell.shape[0]
    flags = np.zeros(vertices, np.uint8)
    flags[list(moved)] = 1
    retreat, failing = wp.zeros(vertices, dtype=wp.uint8), wp.zeros(quads, dtype=wp.uint8)
    has_moved = wp.array(flags, dtype=wp.uint8)
    arrays = mesh.arrays
    keep_points_near(
        tracked, GRID.struct(), arrays.corners, arrays, (has_moved, retreat, failing), mesh.device
    )
    return set(np.flatnonzero(retreat.numpy())), set(np.flatnonzero(failing.numpy()))


@pytest.mark.parametrize("place", NINE)
def test_nine_points_of_a_nearest_quad_are_as_near_as_its_surface(place):
    """Quad 4 of a patch of large quads, and a tracked point above one of its points."""
    mesh, points = placed(shapes.grid(3, 3), scale=4.0)
    a, b, _, d = (points[v] for v in quads_of(mesh)[4])
    point = a + place[0] * (b - a) + place[1] * (d - a)
    for height, is_far in ((0.89, False), (-0.89, False), (0.91, True), (-0.91, True)):
        tracked = tracked_at([np.add(point, [0, 0, height])], [4])
        retreat, failing = kept(mesh, tracked, range(16))
        assert failing == ({4} if is_far else set())
        assert retreat == (set(quads_of(mesh)[4]) if is_far else set())


def test_a_tracked_point_between_the_nine_points_is_as_far_as_the_nearest():
    mesh, points = placed(shapes.grid(1, 1), scale=4.0)
    for at, is_far in (([0.7, 0.5, 0], False), ([1.0, 0.5, 0], True), ([1.5, 1.5, 0], False)):
        assert bool(kept(mesh, tracked_at([points[0] + at], [0]), range(4))[1]) == is_far


@pytest.mark.parametrize("corner", range(4))
def test_only_nearest_quads_with_a_corner_that_moves_are_looked_at(corner):
    mesh, points = placed(shapes.grid(3, 3))
    quads = quads_of(mesh)
    tracked = tracked_at([points[0] + [0, 0, 5]] * 2, [4, 0])
    moved = quads[4][corner]
    expected = {4, 0} if moved in quads[0] else {4}
    assert kept(mesh, tracked, [moved]) == ({v for q in expected for v in quads[q]}, expected)
    assert kept(mesh, tracked, []) == (set(), set())


def nearest(mesh, points, nearest):
    arrays = mesh.arrays
    found = with_nearer_quads(tracked_at(points, nearest), GRID, arrays, mesh.device)
    return found.nearest_quad.numpy().tolist()


def test_a_tracked_point_that_is_near_stays():
    mesh, points = placed(shapes.grid(3, 3))
    beside = points[5]  # a corner of 0, 1, 3 and 4
    assert nearest(mesh, [beside - [0.39, 0.0, 0], beside - [0.41, 0.0, 0]], [4, 4]) == [4, 3]


@pytest.mark.parametrize("quad", [q for q in range(9) if q != 4])
def test_a_tracked_point_moves_across_sides_and_to_quads_beside_these(quad):
    mesh, points = placed(shapes.grid(3, 3))
    assert nearest(mesh, [points[quads_of(mesh)[quad]].mean(axis=0)], [4]) == [quad]


def test_a_tracked_point_moves_no_further_than_there():
    mesh, points = placed(shapes.grid(5, 1))
    at = points[quads_of(mesh)[4]].mean(axis=0)
    assert nearest(mesh, [at, at, at], [0, 2, 3]) == [1, 3, 4]


@pytest.mark.parametrize("turn", range(4))
def test_nothing_lies_across_an_open_side(turn):
    """The last quad is where the tracked point is; index -1 is the last quad, too, as Warp has it."""
    points, quads = shapes.grid(5, 1)
    mesh, points = placed((points, np.stack([np.roll(quads[0], turn), *quads[1:]])))
    assert nearest(mesh, [points[quads[4]].mean(axis=0)], [0]) == [1]


@pytest.mark.parametrize("nearest", [[], [3], [2, 0, 2, 2, 5], [0] * 4, [5, 4, 3, 2, 1, 0]])
def test_the_tracked_points_of_each_quad_are_linked_in_ascending_order(nearest):
    mesh, _ = placed(shapes.grid(3, 2))
    tracked = tracked_at(np.zeros((len(nearest), 3)), nearest)
    first, following = (array.numpy() for array in list_points(tracked, 6, mesh.device))
    for quad in range(6):
        found, g = [], first[quad]
        while g >= 0:
            found.append(g)
            g = following[g]
        assert found == [g for g, nearest_quad in enumerate(nearest) if nearest_quad == quad]
