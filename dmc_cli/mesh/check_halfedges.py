"""Every invariant of a halfedge structure, in plain NumPy: what is wrong, and where.

Origin, face and next of a halfedge follow from its number, so that next has period four and face and origin
agree with the quads by construction; what is stored can be wrong: twins and the vertices' halfedges.
"""

from typing import Any

import numpy as np

from dmc_cli.errors import MeshInvariantError

Array = np.ndarray[Any, np.dtype[Any]]

NO_TWIN = -1


def check_halfedges(quads: Array, twin: Array, vertex_halfedge: Array, *, one_fan: bool = True) -> None:
    """Raise MeshInvariantError with the first offender unless a halfedge structure is one.

    Args:
        quads: Vertex numbers, (Q, 4).
        twin: Twin of each halfedge, (4Q,), -1 on a boundary.
        vertex_halfedge: A halfedge that starts at each vertex, (V,).
        one_fan: Whether the quads of a vertex must form one ring or one fan.
    """
    origin = quads.ravel()
    count = len(origin)
    head = origin[next_of(np.arange(count))]
    _check_twins(origin, head, twin)
    _check_starts(origin, twin, vertex_halfedge)
    fans = count_fans(quads, twin, vertex_halfedge)
    if one_fan and (fans != 1).any():
        vertex = int(np.argmax(fans != 1))
        raise _broken(f"vertex {vertex} has {fans[vertex]} fans of quads; expected one ring or one fan")


def _check_twins(origin: Array, head: Array, twin: Array) -> None:
    """Raise unless twins are an involution without fixed points whose pairs run opposite ways."""
    count = len(origin)
    if len(twin) != count:
        raise _broken(f"{count} halfedges have {len(twin)} twins")
    off = (twin < NO_TWIN) | (twin >= count)
    if off.any():
        h = int(np.argmax(off))
        raise _broken(f"halfedge {h} has twin {twin[h]}; expected -1 to {count - 1}")
    halfedges = np.flatnonzero(twin != NO_TWIN)
    twins = twin[halfedges]
    own = twins == halfedges
    if own.any():
        raise _broken(f"halfedge {halfedges[np.argmax(own)]} is its own twin")
    deaf = twin[twins] != halfedges
    if deaf.any():
        h = halfedges[np.argmax(deaf)]
        raise _broken(f"halfedge {h} has twin {twin[h]}, whose twin is {twin[twin[h]]}")
    askew = (origin[halfedges] != head[twins]) | (head[halfedges] != origin[twins])
    if askew.any():
        h = halfedges[np.argmax(askew)]
        raise _broken(
            f"halfedge {h} ({origin[h]} to {head[h]}) and its twin {twin[h]} ({origin[twin[h]]} to"
            f" {head[twin[h]]}) do not run opposite ways between two vertices"
        )


def _check_starts(origin: Array, twin: Array, vertex_halfedge: Array) -> None:
    """Raise unless each vertex has a halfedge that starts there, on a boundary one without a twin."""
    count, vertices = len(origin), len(vertex_halfedge)
    if count and origin.max() >= vertices:
        raise _broken(f"a quad has vertex {origin.max()}; expected 0 to {vertices - 1}")
    off = (vertex_halfedge < 0) | (vertex_halfedge >= count)
    if off.any():
        vertex = int(np.argmax(off))
        raise _broken(f"vertex {vertex} has halfedge {vertex_halfedge[vertex]}; expected 0 to {count - 1}")
    elsewhere = origin[vertex_halfedge] != np.arange(vertices)
    if elsewhere.any():
        vertex = int(np.argmax(elsewhere))
        h = vertex_halfedge[vertex]
        raise _broken(f"vertex {vertex} has halfedge {h}, which starts at vertex {origin[h]}")
    on_boundary = np.zeros(vertices, bool)
    on_boundary[origin[twin == NO_TWIN]] = True
    inner = on_boundary & (twin[vertex_halfedge] != NO_TWIN)
    if inner.any():
        vertex = int(np.argmax(inner))
        raise _broken(
            f"vertex {vertex} is on a boundary, but its halfedge {vertex_halfedge[vertex]} has a twin;"
            " expected the outgoing one without"
        )


def count_fans(quads: Array, twin: Array, vertex_halfedge: Array) -> Array:
    """Return how many rings and fans the halfedges of each vertex form, (V,).

    All vertices walk at once, from twin to next: what the first walk from a vertex's own halfedge does not
    visit belongs to a further fan, for which the lowest boundary halfedge left, or any, starts another
    walk.
    """
    origin = quads.ravel()
    visited = np.zeros(len(origin), bool)
    fans = np.zeros(len(vertex_halfedge), np.int64)
    starts = vertex_halfedge
    while len(starts):
        fans[origin[starts]] += 1
        _walk(starts, twin, visited)
        left = np.flatnonzero(~visited)
        at_boundary = left[twin[left] == NO_TWIN]
        left = at_boundary if len(at_boundary) else left
        _, first = np.unique(origin[left], return_index=True)
        starts = left[first]
    return fans


def _walk(starts: Array, twin: Array, visited: Array) -> None:
    """Mark the halfedges met from each start by twin-of-previous, until home or a boundary."""
    visited[starts] = True
    home, here = starts, starts
    while len(here):
        onward = twin[previous_of(here)]
        goes_on = (onward != NO_TWIN) & (onward != home)
        home, here = home[goes_on], onward[goes_on]
        again = visited[here]
        if again.any():
            raise _broken(f"halfedge {here[np.argmax(again)]} is met twice on the way round its vertex")
        visited[here] = True


def next_of(h: Array) -> Array:
    """Return the halfedge after each in its quad."""
    return (h & ~3) | ((h + 1) & 3)


def previous_of(h: Array) -> Array:
    """Return the halfedge before each in its quad."""
    return (h & ~3) | ((h + 3) & 3)


def _broken(found: str) -> MeshInvariantError:
    return MeshInvariantError(f"{found}; please report this")
