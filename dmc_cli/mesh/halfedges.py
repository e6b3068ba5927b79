"""The halfedge structure of a quad mesh (Grosso & Zint 2021, section 3.2).

Conventions: halfedge 4q + c belongs to corner c of quad q. It starts at the vertex there (its origin) and
ends at the one of corner c + 1, where the next halfedge of the quad starts. So origin, face, next and the
first halfedge of a face follow from the number and are not stored; `mesh_io/halfedge_dump.py` writes them
out. The twin runs the other way on the other side of the edge; on a boundary it is absent (-1).
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

wp.set_module_options({"enable_backward": False})


NO_TWIN = -1
"""The twin of a halfedge on a boundary."""


@dataclass(frozen=True)
class Halfedges:
    """A quad mesh's connectivity, and what its grid told of it on the way.

    Attributes:
        quads: int32 vec4 (Q,), vertex numbers: the origins of halfedges 4q to 4q + 3.
        twin: int32 (4Q,), -1 on a boundary.
        vertex_halfedge: int32 (V,), a halfedge that starts at the vertex; on a boundary the one without a
            twin, so that twin-of-previous walks the whole fan.
        valence: int32 (V,), mesh edges at the vertex: one an outgoing halfedge, one a twinless incoming one.
        defect: uint8 (Q,), 1 if a side has no twin, or joins two vertices that more than two quads join.
        words: The quads' ranks, as `rank_quads` returns them; None once quads were removed.
    """

    quads: Any
    twin: Any
    vertex_halfedge: Any
    valence: Any
    defect: Any
    words: Any | None


def flat_quads(quads: Any) -> Any:
    """Return vec4i (Q,) as int32 (4Q,): the same memory, kept alive by the view."""
    flat = wp.array(ptr=quads.ptr, dtype=wp.int32, shape=4 * quads.shape[0], device=quads.device, copy=False)
    flat._source = quads  # as long as the view lives
    return flat


@wp.func
def next_halfedge(h: wp.int32) -> wp.int32:
    """Return the halfedge after h in its quad."""
    return (h & ~3) | ((h + 1) & 3)


@wp.func
def previous_halfedge(h: wp.int32) -> wp.int32:
    """Return the halfedge before h in its quad."""
    return (h & ~3) | ((h + 3) & 3)
