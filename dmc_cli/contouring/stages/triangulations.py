"""List the triangulations of the cases' polygons, on the host; no table of cases is typed in.

A polygon of n edges has 1, 2, 5, 14 or 42 triangulations (n from 3 to 7). Those with a diagonal in a face of
the cell are not allowed: the cell beyond may have the same diagonal, and the edge between the two polygons'
edges would have four triangles. With inside corners separated every polygon has one that is allowed.

`standard` has the diagonals of the table that everybody uses (Lorensen & Cline 1987), as far as they show in
the papers' shares of irregular vertices: those of the polygons of cells without an ambiguous face. No rule
gives them, so a few polygons are written down, and rotations of the cube give the others; those that the
published table does not turn by all rotations are turned by thirds only. All other polygons take their
first triangulation that is allowed.
"""

from dataclasses import dataclass
from functools import cache
from itertools import combinations

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.contouring.stages.case_polygons import (
    Polygon,
    edge_rotations,
    edges_share_face,
    face_cycles,
    polygons_of_cases,
)

Triangle = tuple[int, int, int]

LONGEST = 7
"""Most edges of a polygon, inside corners separated."""

ROW = 20
"""Corners of the triangles of a polygon, the fourth ones of rows of faces counted in."""

NO_VERTEX = 7
"""Which vertex of a polygon the fourth corner of a triangle is: none."""

ENTRIES = (0, 12, 1, 4, 2, 13, 3, 5, 6, 14, 15, 7)
"""Where kernels have the vertex on each edge of a cell: see `cell_edges.h`."""

NO_ENTRY = 8
"""Where they have -1 instead."""

TURNED = {
    (1, 3, 8, 9): ((1, 8),),
    (1, 2, 8, 9, 11): ((1, 11), (9, 11)),
}
"""Diagonals of a polygon round two corners and of one round three, to be turned by every rotation."""

TURNED_BY_THIRDS = {
    (8, 9, 10, 11): ((8, 10),),
    (1, 2, 4, 7, 9, 11): ((2, 9), (9, 11), (4, 11)),
    (2, 3, 4, 5, 8, 10): ((2, 5), (3, 5), (3, 4)),
    (1, 2, 4, 5, 8, 11): ((2, 5), (2, 8), (5, 8)),
    (0, 1, 4, 7, 10, 11): ((1, 4), (1, 11), (4, 11)),
    (2, 3, 4, 7, 9, 10): ((2, 7), (2, 9), (7, 9)),
    (0, 2, 5, 7, 9, 11): ((2, 7), (2, 9), (7, 9)),
}
"""Those of polygons round four corners: of a face, a corner with its neighbours, chains. The thirds of a turn
are about one diagonal of the cell, and turn edge 2 to 5 and 8."""


@cache
def triangulations(size: int) -> tuple[tuple[Triangle, ...], ...]:
    """Return all triangulations of a polygon of so many vertices, numbered from 0 on."""
    return tuple(_between(0, size - 1))


def _between(first: int, last: int) -> list[tuple[Triangle, ...]]:
    """Return the triangulations of the part of a polygon from vertex `first` to `last`."""
    if last - first < 2:
        return [()]
    return [
        (*low, (first, apex, last), *high)
        for apex in range(first + 1, last)
        for low in _between(first, apex)
        for high in _between(apex, last)
    ]


@cache
def diagonals(size: int) -> tuple[tuple[tuple[int, int], ...], ...]:
    """Return the diagonals of each triangulation: the longest sides of its triangles but of the outermost."""
    whole = (0, size - 1)
    return tuple(
        tuple((a, c) for a, _, c in triangles if (a, c) != whole) for triangles in triangulations(size)
    )


@cache
def allowed(polygon: Polygon) -> tuple[int, ...]:
    """Return which triangulations of a polygon have no diagonal in a face of the cell."""
    return tuple(
        n
        for n, pairs in enumerate(diagonals(len(polygon)))
        if not any(edges_share_face(polygon[a], polygon[b]) for a, b in pairs)
    )


def standard(polygon: Polygon) -> int:
    """Return which triangulation of a polygon the standard table has, else the first that is allowed."""
    known = _standard_diagonals().get(frozenset(polygon))
    if known is None:
        return allowed(polygon)[0]
    wanted = {frozenset(pair) for pair in known}
    return next(
        n
        for n, pairs in enumerate(diagonals(len(polygon)))
        if {frozenset((polygon[a], polygon[b])) for a, b in pairs} == wanted
    )


@cache
def _standard_diagonals() -> dict[frozenset[int], list[tuple[int, ...]]]:
    """Return the diagonals that the standard table has, by the edges of their polygon."""
    rotations = edge_rotations()
    third = next(turn for turn in rotations if (turn[2], turn[5], turn[8]) == (5, 8, 2))
    none = tuple(range(12))
    thirds = [none, third, tuple(third[e] for e in third)]
    found: dict[frozenset[int], list[tuple[int, ...]]] = {}
    for known, turns in ((TURNED, rotations), (TURNED_BY_THIRDS, thirds)):
        for turn in turns:
            for polygon, pairs in known.items():
                edges = frozenset(turn[e] for e in polygon)
                found.setdefault(edges, [tuple(turn[e] for e in pair) for pair in pairs])
    return found


@dataclass(frozen=True)
class CaseTables:
    """What kernels look up of the cases, as arrays; a *row* is a triangulation of a size, in their order.

    Attributes:
        first_polygon: The first polygon of each case, and the number of all polygons, int32 (257,).
        edges: The entries of the edges of each polygon, uint32 (P,): four bits each, the lowest first;
            `NO_ENTRY` behind the last.
        sizes: How many edges it has, uint8 (P,).
        standard: Its standard triangulation, uint8 (P,), among those of its size.
        allowed: A bit for each triangulation of its size that is allowed, uint64 (P,).
        corners: Vertices of the polygon at the corners of the faces of each row, uint8 (2, R, 32):
            anticlockwise, and the other way round; `NO_VERTEX` as fourth corners.
        members: Triangles of each row, uint8 (R, 5): numbers of combinations of three vertices in order.
        triangles: Triangles of each case, uint8 (256,).
        is_special: Whether each case may have several polygons or a tunnel, bool (256,).
    """

    first_polygon: AnyArray
    edges: AnyArray
    sizes: AnyArray
    standard: AnyArray
    allowed: AnyArray
    corners: AnyArray
    members: AnyArray
    triangles: AnyArray
    is_special: AnyArray


@cache
def case_tables() -> CaseTables:
    """Return the tables of all cases."""
    cases = polygons_of_cases()
    polygons = [polygon for case in cases for polygon in case]
    return CaseTables(
        first_polygon=np.cumsum([0, *map(len, cases)], dtype=np.int32),
        edges=np.array([_code(p) for p in polygons], np.uint32),
        sizes=np.array([len(p) for p in polygons], np.uint8),
        standard=np.array([standard(p) for p in polygons], np.uint8),
        allowed=np.array([sum(1 << n for n in allowed(p)) for p in polygons], np.uint64),
        corners=np.array([[_corners(row, turn) for row in _rows()] for turn in (1, -1)], np.uint8),
        members=np.array([_members(row) for row in _rows()], np.uint8),
        triangles=np.array([sum(len(p) - 2 for p in case) for case in cases], np.uint8),
        is_special=np.array([_may_have_several(case) for case in range(256)]),
    )


def _code(polygon: Polygon) -> int:
    """Return an item of `CaseTables.edges`."""
    entries = [ENTRIES[edge] for edge in polygon] + [NO_ENTRY] * (NO_VERTEX + 1 - len(polygon))
    return sum(entry << 4 * n for n, entry in enumerate(entries))


def _may_have_several(case: int) -> bool:
    """Return whether a case may have several polygons or a tunnel: as `several_polygons` tells of bits."""
    inside = [n for n in range(8) if case >> n & 1]
    outside = [n for n in range(8) if not case >> n & 1]
    is_ambiguous = any(
        case >> a & 1 == case >> c & 1 != case >> b & 1 == case >> d & 1 for a, b, c, d in face_cycles()
    )
    return is_ambiguous or any(len(lone) == 2 and sum(lone) == 7 for lone in (inside, outside))


def _rows() -> list[tuple[int, tuple[Triangle, ...]]]:
    """Return the triangulations of all sizes, each with its size."""
    return [(size, found) for size in range(3, LONGEST + 1) for found in triangulations(size)]


def _corners(row: tuple[int, tuple[Triangle, ...]], turn: int) -> list[int]:
    """Return the corners of a row's faces, one way round or the other."""
    faces = [n for a, b, c in row[1] for n in ((a, b, c) if turn > 0 else (a, c, b)) + (NO_VERTEX,)]
    return faces + [NO_VERTEX] * (32 - len(faces))


def _members(row: tuple[int, tuple[Triangle, ...]]) -> list[int]:
    """Return the numbers of a row's triangles, the last one again beyond it."""
    size, triangles = row
    number = {triangle: n for n, triangle in enumerate(combinations(range(size), 3))}
    found = [number[triangle] for triangle in triangles]
    return found + found[-1:] * (LONGEST - 2 - len(found))
