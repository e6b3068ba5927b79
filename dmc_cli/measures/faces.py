"""Faces and halfedges as the measures see them: corners in rows of four, quads and triangles alike.

Conventions: halfedge h = 4q + c belongs to corner c of face q and runs from that corner to the next one.
`corners[h]` is the vertex there. A triangle, which only mesh files bring along, has `NO_CORNER` as its
fourth corner; that slot is no halfedge. `twins[h]` is the halfedge on the other side of the edge,
`NO_TWIN` on a boundary.
"""

from typing import Any

import warp as wp

wp.set_module_options({"enable_backward": False})

NO_TWIN = -1
"""The twin of a halfedge on a boundary."""

NO_CORNER = -1
"""The fourth corner of a triangle."""


@wp.func
def next_halfedge(corners: wp.array[wp.int32], h: wp.int32) -> wp.int32:
    """Return the halfedge after `h` in its face."""
    following = h + 1
    if (h & 3) == 3 or corners[wp.min(following, h | 3)] < 0:
        following = h & ~3
    return following


@wp.func
def previous_halfedge(corners: wp.array[wp.int32], h: wp.int32) -> wp.int32:
    """Return the halfedge before `h` in its face."""
    preceding = h - 1
    if (h & 3) == 0:
        preceding = h + 3
        if corners[preceding] < 0:
            preceding = h + 2
    return preceding


def flat_corners(faces: Any) -> Any:
    """Return a view of the faces, (F, 4) int32 or (F,) vec4i, as 4F int32 corners on the same device."""
    if faces.ndim == 2:
        return faces.flatten()
    return wp.array(
        ptr=faces.ptr, dtype=wp.int32, shape=4 * faces.shape[0], device=faces.device, capacity=faces.capacity
    )
