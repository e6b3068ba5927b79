"""Pairs of faces that intersect: exact constructions, and every pair tried by exact geometry."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.measures.intersections import count_intersections, find_intersections
from dmc_cli.mesh.box_tree import build_tree
from dmc_cli.runtime.device import Device
from tests import shapes
from tests.measures.exact import exact_triangles_meet
from tests.measures.splits import split_faces
from tests.mesh.meshes import on_device


def pairs_of(shape, device="cpu", threads=2):
    """The pairs of a shape that intersect, and that they are counted as they are listed."""
    mesh = on_device(shape, Device(device, threads))
    pairs = find_intersections(mesh)
    assert count_intersections(mesh) == len(pairs)
    for some in (range(0, mesh.face_count, 3), range(mesh.face_count), ()):
        of_some = find_intersections(mesh, np.array(some, np.int32))
        np.testing.assert_array_equal(of_some, pairs[np.isin(pairs, some).any(axis=1)])
    return [tuple(pair) for pair in pairs.tolist()]


def triangles_of(shape):
    """The triangles of each face, split as the measures split quads, at float32 positions."""
    points = np.asarray(shape[0], np.float32).astype(float).tolist()
    for face in split_faces(shape):
        yield [[points[v] for v in triangle] for triangle in face]


def plain_pairs(shape):
    """The same by trying all pairs in fractions."""
    split = list(triangles_of(shape))
    return [
        (f, g)
        for f, g in combinations(range(len(split)), 2)
        if any(boxes_meet(s, t) and exact_triangles_meet(*s, *t) for s in split[f] for t in split[g])
    ]


def boxes_meet(s, t):
    """Whether the boxes round two triangles have a point in common: fractions take a millisecond."""
    s, t = np.array(s), np.array(t)
    return bool((s.min(axis=0) <= t.max(axis=0)).all() and (t.min(axis=0) <= s.max(axis=0)).all())


@pytest.fixture
def found(device):
    return lambda shape: pairs_of(shape, device)


CLEAN = {
    "cube": shapes.cube(),
    "patch": shapes.grid(9, 7),
    "torus": shapes.torus(17, 13),
    "sphere": shapes.sphere(6),
    "house": shapes.house(),
    "tetrahedron": shapes.tetrahedron(),
    "halved": shapes.halved(shapes.sphere(4), 3),
    "two cubes": shapes.two_components(),
    "cubes with a common edge": shapes.edge_to_edge_cubes(),
    "cubes with a common corner": shapes.corner_to_corner_cubes(),
    "fans at one point": shapes.pinched_vertex(),
    "empty": (np.zeros((0, 3)), np.zeros((0, 4), np.int32)),
    "one face": (shapes.cube()[0], shapes.cube()[1][:1]),
}


@pytest.mark.parametrize("name", CLEAN)
def test_surfaces_without_intersections_have_none(found, name):
    assert found(CLEAN[name]) == []


def test_corners_at_one_place_are_one_whatever_their_numbers(found):
    points, quads = shapes.sphere(4)
    soup = points[quads].reshape(-1, 3), np.arange(quads.size, dtype=np.int32).reshape(-1, 4)
    assert found(soup) == []
    assert found(shapes.joined(shapes.cube(), shapes.moved(shapes.cube(), (1, 1, 0)))) == []


def test_boxes_that_interpenetrate_meet_in_six_pairs(found):
    boxes = shapes.joined(shapes.cube(), shapes.moved(shapes.cube(), (0.5, 0.5, 0.5)))
    pairs = found(boxes)
    assert len(pairs) == 6
    assert all(f < 6 <= g for f, g in pairs)
    assert pairs == plain_pairs(boxes)


def test_a_box_inside_another_meets_nothing(found):
    points, quads = shapes.cube()
    assert found(shapes.joined((points, quads), (0.25 + 0.5 * points, quads))) == []


def test_faces_that_touch_intersect(found):
    stacked = shapes.joined(shapes.cube(), shapes.moved(shapes.cube(), (0.25, 0.25, 1.0)))
    pairs = found(stacked)
    assert pairs == plain_pairs(stacked)
    assert (1, 6) in pairs
    apart = shapes.joined(shapes.cube(), shapes.moved(shapes.cube(), (0.25, 0.25, np.float32(1.0000001))))
    assert found(apart) == []


def test_a_face_twice_intersects_itself_alone(found):
    points, quads = shapes.torus(6, 5)
    assert found((points, np.vstack([quads, quads[7:8]]))) == [(7, 30)]
    assert found((points, np.vstack([quads, quads[7:8, ::-1]]))) == [(7, 30)]


def hinge(height):
    """Two squares with a common side, the second folded back to a height above the first."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0.9, height], [0, 0.9, height]])
    return points, np.array([[0, 1, 2, 3], [1, 0, 5, 4]], np.int32)


def test_faces_folded_over_their_common_side_overlap(found):
    assert found(hinge(0.0)) == [(0, 1)]
    assert found(hinge(1e-6)) == []
    assert found(hinge(-1e-6)) == []


def test_faces_with_a_common_corner_may_overlap(found):
    points = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 1, 1.0], [1, 1, -1.0], [1, 2, 1], [2, 1, -1.0]])
    through = points, np.array([[0, 1, 2, -1], [0, 3, 4, -1]], np.int32)
    assert found(through) == [(0, 1)]
    beside = points, np.array([[0, 1, 2, -1], [0, 5, 3, -1]], np.int32)
    assert found(beside) == []


def test_a_corner_on_a_side_intersects(found):
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [1, 0, 0], [0, -1, 0], [2, -1, 0.0]])
    joint = points, np.array([[0, 1, 2, 3], [0, 5, 4, -1], [4, 6, 1, -1]], np.int32)
    assert found(joint) == [(0, 1), (0, 2)]


def test_a_triangle_without_an_area_meets_nothing(found):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.25, 0.25, -1], [0.25, 0.25, 1], [0.25, 0.25, 0]])
    assert found((points, np.array([[0, 1, 2, -1], [3, 4, 5, -1]], np.int32))) == []


@pytest.mark.parametrize("far", [0.0, 1e4, 3e5])
def test_a_sheet_through_a_sphere_meets_as_by_exact_geometry(found, far):
    ball = shapes.sphere(2)
    sheet = shapes.grid(3, 3)
    sheet = (sheet[0] * (0.8, 0.8, 0) - (1.2, 1.3, -0.1), sheet[1])
    shape = shapes.moved(shapes.joined(ball, shapes.halved(sheet, 2)), (far, far, -far))
    pairs = found(shape)
    assert pairs == plain_pairs(shape)
    assert pairs


coordinate = st.integers(0, 3).map(float)


@given(
    st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=9, max_size=9),
    st.lists(st.permutations(range(9)), min_size=2, max_size=6),
    st.integers(0, 5),
)
def test_any_faces_meet_as_by_exact_geometry(points, orders, triangles):
    faces = np.array([order[:4] for order in orders], np.int32)
    faces[:triangles, 3] = -1
    shape = np.array(points), faces
    assert pairs_of(shape) == plain_pairs(shape)


def crumpled(seed=3, count=40):
    """A sheet whose points are moved by more than a side."""
    points, quads = shapes.grid(count, count)
    return points + np.random.default_rng(seed).normal(0, 0.45, points.shape), quads


def test_a_crumpled_sheet_meets_as_by_exact_geometry(found):
    shape = shapes.halved(crumpled(count=7), 4)
    pairs = found(shape)
    assert pairs == plain_pairs(shape)
    assert len(pairs) > 5


def test_threads_do_not_show(device):
    shape = crumpled()
    one = pairs_of(shape, device, threads=1)
    assert len(one) > 300
    assert all(pairs_of(shape, device, threads=n) == one for n in (2, 3, 5))


def test_the_order_of_faces_does_not_show():
    points, quads = crumpled()
    order = np.random.default_rng(1).permutation(len(quads))
    turned = [tuple(sorted((order[f], order[g]))) for f, g in pairs_of((points, quads[order]))]
    assert sorted(turned) == pairs_of((points, quads))


@pytest.mark.parametrize("count", [0, 1, 2, 7, 8, 9, 63, 64, 65, 513])
def test_a_tree_holds_every_face_in_the_boxes_above_it(device, count):
    points, quads = shapes.grid(count, 1) if count else CLEAN["empty"]
    points = points + np.random.default_rng(count).normal(0, 3, points.shape)
    tree = build_tree(on_device((points, quads), Device(device, 2)))
    order, lows, highs = tree.order.numpy(), tree.lows.numpy(), tree.highs.numpy()
    assert sorted(order.tolist()) == list(range(count))
    corners = points.astype(np.float32)[quads[order]]
    for level in range(tree.top + 1):
        start, end = int(tree.starts[level]), int(tree.starts[level + 1])
        assert end - start == -(-count // 8**level)
        for n in range(end - start):
            part = corners[n * 8**level : (n + 1) * 8**level].reshape(-1, 3)
            assert (lows[start + n] == part.min(axis=0)).all()
            assert (highs[start + n] == part.max(axis=0)).all()
