"""The tables of cases, from their geometry: polygons, triangulations, and which are allowed."""

import numpy as np
import pytest

from dmc_cli.contouring.stages.case_polygons import edge_rotations, edges_share_face, polygons_of_cases
from dmc_cli.contouring.stages.triangulations import allowed, case_tables, standard, triangulations
from tests.contouring.edge_agreement import assert_triangulated
from tests.oracle.cube import EDGES, corner_at, face_edges, is_ambiguous, rotations
from tests.oracle.edge_mesh import points_outwards
from tests.oracle.polygons import trace_polygons

CATALAN = {3: 1, 4: 2, 5: 5, 6: 14, 7: 42}
POLYGONS = sorted({polygon for case in polygons_of_cases() for polygon in case})


@pytest.mark.parametrize("case", range(256))
def test_polygons_are_those_of_the_oracle_and_look_away_from_the_inside(case):
    found = polygons_of_cases()[case]
    expected = trace_polygons(case, (False,) * 6)
    assert [p[0] for p in found] == [p[0] for p in expected]
    for polygon, other in zip(found, expected, strict=True):
        assert polygon in (other, other[:1] + other[:0:-1])
        assert points_outwards(case, polygon)


def test_edges_share_a_face_as_the_cube_has_it():
    for a in range(12):
        for b in range(12):
            assert edges_share_face(a, b) == any({a, b} <= set(face_edges(face)) for face in range(6))


def test_the_rotations_are_those_of_the_cube():
    def turned(corners):
        return tuple(EDGES.index(tuple(sorted((corners[a], corners[b])))) for a, b in EDGES)

    assert set(edge_rotations()) == {turned(corners) for corners in rotations()}
    assert corner_at((1, 1, 1)) == 7


@pytest.mark.parametrize("size", CATALAN)
def test_all_triangulations_are_listed_once(size):
    found = triangulations(size)
    assert len({frozenset(row) for row in found}) == len(found) == CATALAN[size]


@pytest.mark.parametrize("polygon", POLYGONS, ids=str)
def test_what_is_allowed_has_no_diagonal_in_a_face(polygon):
    assert standard(polygon) in allowed(polygon)
    for n in allowed(polygon):
        rows = triangulations(len(polygon))[n]
        assert_triangulated(polygon, [[polygon[v] for v in triangle] for triangle in rows])


def test_how_many_are_allowed_is_as_the_notes_have_it():
    found = {size: {len(allowed(p)) for p in POLYGONS if len(p) == size} for size in CATALAN}
    assert found == {3: {1}, 4: {2}, 5: {5}, 6: {4, 14}, 7: {16}}


def test_special_cases_are_those_with_an_ambiguous_face_and_eight_more():
    special = case_tables().is_special
    ambiguous = np.array([any(is_ambiguous(case, face) for face in range(6)) for case in range(256)])
    assert np.flatnonzero(special & ~ambiguous).tolist() == [24, 36, 66, 126, 129, 189, 219, 231]
    assert not (ambiguous & ~special).any()
    assert ambiguous.sum() == 120


def test_triangles_of_all_cases_are_820():
    assert case_tables().triangles.sum() == 820
