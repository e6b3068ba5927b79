"""MC polygons of a cell, traced from the segments in its faces (section 3.1.1 of the paper).

The surface crosses a face in one segment, or two if the face is ambiguous. Every crossed edge lies
in two faces and so ends two segments: followed from edge to edge they close to polygons.
"""

from functools import cache

from tests.oracle.cube import EDGES, crossed_edges, face_corners, face_edges, is_ambiguous
from tests.oracle.faces import Cell, Face, cell_face
from tests.oracle.grid import Grid

Polygon = tuple[int, ...]


@cache
def face_segments(case: int, face: int, joined: bool) -> tuple[frozenset[int], ...]:
    """The segments in a face, each as its two edges; `joined` counts for an ambiguous face only."""
    crossed = [e for e in face_edges(face) if e in crossed_edges(case)]
    if not is_ambiguous(case, face):
        return (frozenset(crossed),) if crossed else ()
    cut_off = [c for c in face_corners(face) if bool(case >> c & 1) != joined]
    return tuple(frozenset(e for e in crossed if c in EDGES[e]) for c in cut_off)


@cache
def trace_polygons(case: int, joined: tuple[bool, ...]) -> tuple[Polygon, ...]:
    """The polygons of a cell, each as its edges in cyclic order from the lowest one.

    `joined` has one entry a face.
    """
    segments = [s for face in range(6) for s in face_segments(case, face, joined[face])]
    unvisited = set(crossed_edges(case))
    polygons = []
    while unvisited:
        edge = min(unvisited)
        polygon = []
        while edge is not None:
            polygon.append(edge)
            unvisited.remove(edge)
            onward = sorted(e for s in segments if edge in s for e in s if e in unvisited)
            edge = onward[0] if onward else None
        polygons.append(tuple(polygon))
    return tuple(polygons)


def joined_faces(cell: Cell, case: int, decisions: dict[Face, bool]) -> tuple[bool, ...]:
    """The decisions on a cell's six faces; False where a face is not ambiguous."""
    if not has_ambiguous_face(case):
        return (False,) * 6
    return tuple(decisions.get(cell_face(cell, face), False) for face in range(6))


@cache
def has_ambiguous_face(case: int) -> bool:
    """Whether any of the six faces is ambiguous."""
    return any(is_ambiguous(case, face) for face in range(6))


def active_cells(grid: Grid) -> dict[Cell, int]:
    """The existing cells that the surface crosses, with their cases, in grid order."""
    cases = grid.cases()
    active = grid.existing_cells() & (cases != 0) & (cases != 255)
    found = zip(*active.nonzero(), cases[active], strict=True)
    return {(int(i), int(j), int(k)): int(case) for k, j, i, case in found}


def trace_cells(cells: dict[Cell, int], decisions: dict[Face, bool]) -> dict[Cell, tuple[Polygon, ...]]:
    """The polygons of every active cell."""
    return {cell: trace_polygons(case, joined_faces(cell, case, decisions)) for cell, case in cells.items()}
