"""Halfedges of a quad mesh: twins from the grid, and a checker of every invariant.

Halfedge 4q + c belongs to corner c of quad q: it runs from the vertex at corner c to the one at
corner c + 1 (mod 4), which is also where the next halfedge starts. Corner c of a quad lies in the
c-th cell round its grid edge, so the halfedge crosses the face between two of these cells. It is dual
to the segment in that face that ends at the quad's grid edge; its twin is the halfedge of the quad
round the grid edge at the segment's other end. Without a quad there, it has none.
"""

import numpy as np

from tests.oracle.faces import cell_face
from tests.oracle.polygons import face_segments
from tests.oracle.quads import cells_round
from tests.oracle.surface import OracleSurface

NO_TWIN = -1


def next_halfedge(h: int) -> int:
    """The halfedge that follows within the quad."""
    return h - 3 if h % 4 == 3 else h + 1


def previous_halfedge(h: int) -> int:
    """The halfedge before within the quad."""
    return h + 3 if h % 4 == 0 else h - 1


def twins_from_grid(surface: OracleSurface) -> np.ndarray:
    """The twin of every halfedge, shape (4Q,): the other halfedge dual to the same face segment."""
    twins = np.full(4 * len(surface.quads), NO_TWIN, dtype=np.int64)
    first_at: dict[tuple, int] = {}
    for q, (edge, vertices) in enumerate(surface.quads):
        number_in = dict(cells_round(edge))
        for c in range(4):
            here, there = vertices[c].cell, vertices[(c + 1) % 4].cell
            below = min(here, there)
            segment = segment_between(surface, below, max(here, there), number_in[below])
            other = first_at.setdefault((below, max(here, there), segment), 4 * q + c)
            if other != 4 * q + c:
                twins[4 * q + c], twins[other] = other, 4 * q + c
    return twins


def segment_between(surface: OracleSurface, below: tuple, above: tuple, number: int) -> frozenset[int]:
    """The segment that ends at edge `number` of the cell `below`, in its face towards `above`."""
    axis = next(a for a in range(3) if below[a] != above[a])
    face = 2 * axis + 1
    joined = surface.decisions.get(cell_face(below, face), False)
    segments = face_segments(surface.cells[below], face, joined)
    return next(segment for segment in segments if number in segment)


def find_faults(quads: np.ndarray, twins: np.ndarray) -> list[str]:
    """Every broken invariant of a halfedge structure, in words; empty if there is none."""
    faults = []
    origin = quads.ravel().tolist()
    for h, twin in enumerate(np.asarray(twins).tolist()):
        if twin == NO_TWIN:
            continue
        if twin == h:
            faults.append(f"halfedge {h} is its own twin")
        elif twins[twin] != h:
            faults.append(f"halfedge {h} has twin {twin}, whose twin is {twins[twin]}")
        elif (origin[h], origin[next_halfedge(h)]) != (origin[next_halfedge(twin)], origin[twin]):
            faults.append(f"halfedge {h} and its twin {twin} do not run opposite ways between two vertices")
    for q, corners in enumerate(quads.tolist()):
        if len(set(corners)) != 4:
            faults.append(f"quad {q} has corners {corners}, not four different ones")
    return faults


def fan_counts(quads: np.ndarray, twins: np.ndarray, vertex_count: int) -> np.ndarray:
    """How many rings and fans the halfedges of each vertex form, followed from twin to next."""
    origin = quads.ravel().tolist()
    unvisited = set(range(len(origin)))
    counts = np.zeros(vertex_count, dtype=np.int64)
    while unvisited:
        start = next(iter(unvisited))
        counts[origin[start]] += 1
        for h in ring_or_fan(start, twins):
            unvisited.discard(h)
    return counts


def ring_or_fan(start: int, twins: np.ndarray) -> list[int]:
    """The outgoing halfedges round a vertex that are reached from one of them, either way."""
    found = [start]
    h = twins[previous_halfedge(start)]
    while h not in (NO_TWIN, start):
        found.append(int(h))
        h = twins[previous_halfedge(int(h))]
    if h == start:
        return found
    h = twins[start]
    while h != NO_TWIN:
        found.append(next_halfedge(int(h)))
        h = twins[found[-1]]
    return found


def valences(quads: np.ndarray, twins: np.ndarray, vertex_count: int) -> np.ndarray:
    """Mesh edges at each vertex: one per outgoing halfedge, one per incoming one without a twin."""
    outgoing = np.bincount(quads.ravel(), minlength=vertex_count)
    heads = np.roll(quads, -1, axis=1).ravel()[np.asarray(twins) == NO_TWIN]
    return outgoing + np.bincount(heads, minlength=vertex_count)
