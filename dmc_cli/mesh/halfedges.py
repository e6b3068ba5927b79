"""Define the halfedge structure of a mesh of triangles and quads (Grosso & Zint 2021, section 3.2).

Conventions: faces are rows of four corners, and halfedge 4f + c belongs to corner c of face f. It starts at
the vertex there (its origin) and ends at that of the face's next corner. A triangle has `NO_CORNER` as its
fourth corner, and that place is no halfedge. So origin, face, next and the first halfedge of a face follow
from the number and are not stored; `mesh_io/halfedge_dump.py` writes them out. The twin runs the other way
on the other side of the edge; on a boundary it is absent (`NO_TWIN`).

Stages that work on quads only walk by `next_in_quad` and `previous_in_quad`, which look nothing up.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

wp.set_module_options({"enable_backward": False})


NO_TWIN = -1
"""The twin of a halfedge on a boundary, and of a triangle's fourth place."""


@dataclass(frozen=True)
class Halfedges:
    """How the faces of a mesh join.

    Attributes:
        twin: int32 (4F,), -1 on a boundary and at a triangle's fourth place.
        vertex_halfedge: int32 (V,), a halfedge that starts at the vertex; on a boundary the one without a
            twin, so that `next_outgoing` walks the whole fan; -1 for a vertex of no face.
        valence: int32 (V,), mesh edges at the vertex: one per outgoing halfedge, plus one per incoming
            one without a twin.
    """

    twin: Any
    vertex_halfedge: Any
    valence: Any


@wp.func
def next_in_quad(h: wp.int32) -> wp.int32:
    """Return the halfedge after h in its quad."""
    return (h & ~3) | ((h + 1) & 3)


@wp.func
def previous_in_quad(h: wp.int32) -> wp.int32:
    """Return the halfedge before h in its quad."""
    return (h & ~3) | ((h + 3) & 3)


@wp.func
def opposite_in_quad(h: wp.int32) -> wp.int32:
    """Return the halfedge on the other side of the quad."""
    return (h & ~3) | ((h + 2) & 3)


@wp.func
def quad_corner(corners: wp.array(dtype=wp.int32), h: wp.int32, step: wp.int32) -> wp.int32:
    """Return the vertex `step` corners after halfedge h's in its quad."""
    return corners[(h & ~3) | ((h + step) & 3)]


@wp.func
def next_halfedge(corners: wp.array(dtype=wp.int32), h: wp.int32) -> wp.int32:
    """Return the halfedge after h in its face."""
    following = h + 1
    if (h & 3) == 3 or corners[wp.min(following, h | 3)] < 0:
        following = h & ~3
    return following


@wp.func
def previous_halfedge(corners: wp.array(dtype=wp.int32), h: wp.int32) -> wp.int32:
    """Return the halfedge before h in its face."""
    preceding = h - 1
    if (h & 3) == 0:
        preceding = h + 3
        if corners[preceding] < 0:
            preceding = h + 2
    return preceding


@wp.func
def next_outgoing(twin: wp.array(dtype=wp.int32), h: wp.int32) -> wp.int32:
    """Return the next outgoing halfedge of a vertex among quads, twin of previous; -1 at the end of a fan."""
    return twin[previous_in_quad(h)]


@wp.func
def next_outgoing_of_any(
    corners: wp.array(dtype=wp.int32), twin: wp.array(dtype=wp.int32), h: wp.int32
) -> wp.int32:
    """Return the next outgoing halfedge of a vertex among any faces; -1 at the end of a fan."""
    return twin[previous_halfedge(corners, h)]


@wp.func
def ring_size(twin: wp.array(dtype=wp.int32), start: wp.int32, valence: wp.int32) -> wp.int32:
    """Return the number of quads round a vertex if they form one ring, else 0.

    Args:
        twin: Twins.
        start: The vertex's halfedge.
        valence: Its valence.
    """
    size = int(0)
    h = start
    while h >= 0 and size < valence:
        size += 1
        h = next_outgoing(twin, h)
        if h == start:
            return wp.where(size == valence, size, 0)
    return 0
