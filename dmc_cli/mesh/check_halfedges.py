"""Check every invariant of a halfedge structure in plain NumPy: what is wrong, and where.

Origin, face and next of a halfedge follow from its number, so that next has period four and face and origin
agree with the faces by construction; what is stored can be wrong: twins and the vertices' halfedges.
"""

from collections.abc import Iterator

import numpy as np

from dmc_cli.array_types import BoolArray, Int32Array, IntArray
from dmc_cli.errors import MeshInvariantError
from dmc_cli.mesh.halfedges import NO_TWIN
from dmc_cli.mesh_io import NO_CORNER, next_halfedges, previous_halfedges

PIECE = 1 << 17
"""Halfedges or vertices that are looked at together."""


def check_halfedges(
    faces: Int32Array, twin: Int32Array, vertex_halfedge: Int32Array, *, one_fan: bool = True
) -> None:
    """Raise MeshInvariantError with the first offender unless a halfedge structure is one.

    Args:
        faces: Vertex numbers, (F, 4), -1 as the fourth of a triangle.
        twin: Twin of each halfedge, (4F,), -1 on a boundary and at the fourth place of a triangle.
        vertex_halfedge: A halfedge that starts at each vertex, (V,).
        one_fan: Whether the faces of a vertex must form one ring or one fan.
    """
    origin = faces.ravel()
    _check_twins(origin, twin)
    _check_starts(origin, twin, vertex_halfedge)
    fans = count_fans(faces, twin, vertex_halfedge)
    if one_fan and (fans != 1).any():
        vertex = int(np.argmax(fans != 1))
        raise _broken(f"vertex {vertex} has {fans[vertex]} fans of faces; expected one ring or one fan")


def pieces(count: int) -> Iterator[slice]:
    """Yield which of so many items to look at together: intermediate results would be larger than a mesh."""
    for start in range(0, count, PIECE):
        yield slice(start, min(start + PIECE, count))


def _check_twins(origin: Int32Array, twin: Int32Array) -> None:
    """Raise unless twins are an involution without fixed points whose pairs run opposite ways."""
    count = len(origin)
    if len(twin) != count:
        raise _broken(f"{count} halfedges have {len(twin)} twins")
    off = (twin < NO_TWIN) | (twin >= count)
    if off.any():
        h = int(np.argmax(off))
        raise _broken(f"halfedge {h} has twin {twin[h]}; expected -1 to {count - 1}")
    for check in (_refuse_own_twins, _refuse_one_sided, _refuse_misaligned):
        for piece in pieces(count):
            halfedges = piece.start + np.flatnonzero(twin[piece] != NO_TWIN)
            check(origin, twin, halfedges, twin[halfedges])


def _refuse_own_twins(_: Int32Array, __: Int32Array, halfedges: IntArray, twins: Int32Array) -> None:
    """Raise on the first halfedge that is its own twin."""
    own = twins == halfedges
    if own.any():
        raise _broken(f"halfedge {halfedges[np.argmax(own)]} is its own twin")


def _refuse_one_sided(_: Int32Array, twin: Int32Array, halfedges: IntArray, twins: Int32Array) -> None:
    """Raise on the first halfedge that is not its twin's twin."""
    one_sided = twin[twins] != halfedges
    if one_sided.any():
        h = halfedges[np.argmax(one_sided)]
        raise _broken(f"halfedge {h} has twin {twin[h]}, whose twin is {twin[twin[h]]}")


def _refuse_misaligned(origin: Int32Array, twin: Int32Array, halfedges: IntArray, twins: Int32Array) -> None:
    """Raise on the first halfedge that does not run opposite to its twin."""
    heads, ends = origin[next_halfedges(origin, halfedges)], origin[next_halfedges(origin, twins)]
    misaligned = (origin[halfedges] != ends) | (heads != origin[twins])
    if misaligned.any():
        n = int(np.argmax(misaligned))
        h = halfedges[n]
        raise _broken(
            f"halfedge {h} ({origin[h]} to {heads[n]}) and its twin {twin[h]} ({origin[twin[h]]} to"
            f" {ends[n]}) do not run opposite ways between two vertices"
        )


def _check_starts(origin: Int32Array, twin: Int32Array, vertex_halfedge: Int32Array) -> None:
    """Raise unless each vertex has a halfedge that starts there, on a boundary one without a twin."""
    count, vertices = len(origin), len(vertex_halfedge)
    if count and origin.max() >= vertices:
        raise _broken(f"a face has vertex {origin.max()}; expected 0 to {vertices - 1}")
    off = (vertex_halfedge < 0) | (vertex_halfedge >= count)
    if off.any():
        vertex = int(np.argmax(off))
        raise _broken(f"vertex {vertex} has halfedge {vertex_halfedge[vertex]}; expected 0 to {count - 1}")
    on_boundary = np.zeros(vertices, bool)
    on_boundary[origin[(twin == NO_TWIN) & (origin != NO_CORNER)]] = True
    for piece in pieces(vertices):
        elsewhere = origin[vertex_halfedge[piece]] != np.arange(piece.start, piece.stop)
        if elsewhere.any():
            vertex = piece.start + int(np.argmax(elsewhere))
            h = vertex_halfedge[vertex]
            raise _broken(f"vertex {vertex} has halfedge {h}, which starts at vertex {origin[h]}")
    for piece in pieces(vertices):
        inner = on_boundary[piece] & (twin[vertex_halfedge[piece]] != NO_TWIN)
        if inner.any():
            vertex = piece.start + int(np.argmax(inner))
            raise _broken(
                f"vertex {vertex} is on a boundary, but its halfedge {vertex_halfedge[vertex]} has a twin;"
                " expected the outgoing one without"
            )


def count_fans(faces: Int32Array, twin: Int32Array, vertex_halfedge: Int32Array) -> Int32Array:
    """Return how many rings and fans the halfedges of each vertex form, (V,).

    All vertices walk at once, from twin to next: what the first walk from a vertex's own halfedge does not
    visit belongs to a further fan, for which the lowest unvisited boundary halfedge, or else the lowest
    unvisited one, starts another walk.
    """
    origin = faces.ravel()
    visited = origin == NO_CORNER
    fans = np.zeros(len(vertex_halfedge), np.int32)
    starts: IntArray = vertex_halfedge
    while len(starts):
        for piece in pieces(len(starts)):
            fans[origin[starts[piece]]] += 1
            _walk(origin, starts[piece], twin, visited)
        unvisited = np.flatnonzero(~visited)
        at_boundary = unvisited[twin[unvisited] == NO_TWIN]
        unvisited = at_boundary if len(at_boundary) else unvisited
        _, first = np.unique(origin[unvisited], return_index=True)
        starts = unvisited[first]
    return fans


def _walk(origin: Int32Array, starts: IntArray, twin: Int32Array, visited: BoolArray) -> None:
    """Mark the halfedges met from each start by twin-of-previous, until home or a boundary."""
    visited[starts] = True
    home, here = starts, starts
    while len(here):
        onward = twin[previous_halfedges(origin, here)]
        goes_on = (onward != NO_TWIN) & (onward != home)
        home, here = home[goes_on], onward[goes_on]
        again = visited[here]
        if again.any():
            raise _broken(f"halfedge {here[np.argmax(again)]} is met twice on the way round its vertex")
        visited[here] = True


def _broken(found: str) -> MeshInvariantError:
    return MeshInvariantError(f"{found}; please report this")
