"""All 256 cases and all face decisions prove the traced polygons, and so the cube's numbering."""

from itertools import product

import pytest

from tests.oracle.cube import (
    CORNERS,
    EDGES,
    FACES,
    crossed_edges,
    edge_between,
    face_corners,
    face_edges,
    is_ambiguous,
    rotations,
)
from tests.oracle.polygons import face_segments, trace_polygons

CASES = range(256)


def decisions_of(case):
    """Every combination of decisions on the ambiguous faces of a case."""
    choices = [(False, True) if is_ambiguous(case, face) else (False,) for face in range(6)]
    return list(product(*choices))


CASES_WITH_DECISIONS = [(case, joined) for case in CASES for joined in decisions_of(case)]


def as_sets(polygons):
    return {frozenset(polygon) for polygon in polygons}


def test_edges_join_the_corners_of_the_paper():
    pairs = ["01", "13", "23", "02", "45", "57", "67", "46", "04", "15", "37", "26"]
    assert [f"{a}{b}" for a, b in EDGES] == pairs


def test_edges_join_corners_that_differ_along_one_axis():
    for a, b in EDGES:
        assert sum(abs(x - y) for x, y in zip(CORNERS[a], CORNERS[b], strict=True)) == 1


def test_every_edge_lies_in_two_faces():
    assert [sum(edge in face_edges(face) for face in range(6)) for edge in range(12)] == [2] * 12


def test_face_corners_have_their_diagonals_first_and_last():
    for face in range(6):
        f0, f1, f2, f3 = face_corners(face)
        sides = {frozenset(EDGES[edge]) for edge in face_edges(face)}
        assert frozenset((f0, f3)) not in sides
        assert frozenset((f1, f2)) not in sides


def test_polygons_hold_each_crossed_edge_exactly_once():
    for case, joined in CASES_WITH_DECISIONS:
        edges = [edge for polygon in trace_polygons(case, joined) for edge in polygon]
        assert sorted(edges) == sorted(crossed_edges(case)), (case, joined)


def test_consecutive_polygon_edges_are_a_segment_of_a_face():
    for case, joined in CASES_WITH_DECISIONS:
        segments = [s for face in range(6) for s in face_segments(case, face, joined[face])]
        for polygon in trace_polygons(case, joined):
            for edge, onward in zip(polygon, polygon[1:] + polygon[:1], strict=True):
                assert frozenset((edge, onward)) in segments, (case, joined)


def test_polygons_have_three_to_twelve_edges():
    sizes = {len(polygon) for case in CASES_WITH_DECISIONS for polygon in trace_polygons(*case)}
    assert min(sizes) == 3
    assert max(sizes) == 12


def test_the_empty_cases_have_no_polygon():
    assert [case for case in CASES if not trace_polygons(case, (False,) * 6)] == [0, 255]


def test_a_cell_has_up_to_four_polygons():
    assert max(len(trace_polygons(*case)) for case in CASES_WITH_DECISIONS) == 4


def test_a_single_inside_corner_is_cut_off_by_a_triangle():
    for corner in range(8):
        polygons = trace_polygons(1 << corner, (False,) * 6)
        assert as_sets(polygons) == {frozenset(e for e in range(12) if corner in EDGES[e])}


def test_a_joined_face_leaves_its_inside_corners_on_one_side():
    case = 1 << 0 | 1 << 3
    face = FACES.index((2, 0))
    joined = tuple(f == face for f in range(6))
    assert len(trace_polygons(case, joined)) == 1
    assert len(trace_polygons(case, (False,) * 6)) == 2


def test_the_complement_has_the_same_polygons_under_opposite_decisions():
    for case, joined in CASES_WITH_DECISIONS:
        opposite = tuple(is_ambiguous(case, f) and not joined[f] for f in range(6))
        expected = as_sets(trace_polygons(case, joined))
        assert as_sets(trace_polygons(255 - case, opposite)) == expected, (case, joined)


def test_there_are_24_rotations():
    assert len(set(rotations())) == 24


@pytest.mark.parametrize("rotation", rotations(), ids=lambda r: "".join(map(str, r)))
def test_rotating_the_cell_rotates_its_polygons(rotation):
    new_edge = [edge_between(rotation[a], rotation[b]) for a, b in EDGES]
    corner_sets = [frozenset(face_corners(face)) for face in range(6)]
    new_face = [corner_sets.index(frozenset(rotation[c] for c in corners)) for corners in corner_sets]
    for case, joined in CASES_WITH_DECISIONS:
        turned = sum(1 << rotation[c] for c in range(8) if case >> c & 1)
        turned_joined = tuple(joined[new_face.index(face)] for face in range(6))
        expected = {frozenset(new_edge[e] for e in p) for p in trace_polygons(case, joined)}
        assert as_sets(trace_polygons(turned, turned_joined)) == expected


def test_neighbouring_cells_have_the_same_segments_in_their_common_face():
    for axis, joined in product(range(3), (False, True)):
        high, low = FACES.index((axis, 1)), FACES.index((axis, 0))
        step = 1 << axis
        for signs in product((0, 1), repeat=4):
            below = sum(bit << c for bit, c in zip(signs, face_corners(high), strict=True))
            above = sum(bit << c for bit, c in zip(signs, face_corners(low), strict=True))
            moved = {
                frozenset(edge_between(EDGES[e][0] - step, EDGES[e][1] - step) for e in segment)
                for segment in face_segments(below, high, joined)
            }
            assert moved == set(face_segments(above, low, joined))


def test_128_of_the_254_active_cases_can_have_several_polygons():
    several = {case for case, joined in CASES_WITH_DECISIONS if len(trace_polygons(case, joined)) > 1}
    always = [case for case in several if all(len(trace_polygons(case, j)) > 1 for j in decisions_of(case))]
    assert len(several) == 128
    assert len(always) == 8
