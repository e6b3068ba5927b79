"""A mesh while quads are being removed: numbers stay, what has gone is marked.

Every pass of the simplification changes the arrays in place and keeps twins, valences and the vertices'
halfedges true; `mesh/compaction.py` renumbers once at the end. That is the papers' rebuild after each pass,
with the work confined to where quads went.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.mesh.halfedges import Halfedges, flat_quads, previous_halfedge
from dmc_cli.mesh.surface import Surface
from dmc_cli.runtime.device import Device

wp.set_module_options({"enable_backward": False})


@wp.struct
class MeshArrays:
    """The kernels' view of a mesh; corners and twin (4Q,), defect and quad_gone (Q,), the others (V,).

    Functions take the arrays that they need, never the whole: it is copied with every call.
    """

    corners: wp.array(dtype=wp.int32)
    twin: wp.array(dtype=wp.int32)
    defect: wp.array(dtype=wp.uint8)
    quad_gone: wp.array(dtype=wp.uint8)
    vertex_halfedge: wp.array(dtype=wp.int32)
    valence: wp.array(dtype=wp.int32)
    vertex_gone: wp.array(dtype=wp.uint8)
    position: wp.array(dtype=wp.vec3)
    cell: wp.array(dtype=wp.int64)
    local: wp.array(dtype=wp.vec3)


@dataclass(frozen=True)
class WorkingMesh:
    """The arrays and where they came from.

    Attributes:
        arrays: The kernels' `MeshArrays`, those of surface and halfedges themselves.
        quads: `arrays.corners` as int32 vec4 (Q,).
        quad_count: Quads at the beginning.
        surface: For its field, grid and affine.
        color: Colours 0 to 4 a quad, uint8 (Q,), proper at the beginning; None if they are not wanted.
        color24: The grid's colours, uint8 (Q,), or None.
        seams: Lists of the halfedges that got new twins, int32, -1 for none; each pass adds its own. Those
            where no colours clash may be left out.
        device: Where the arrays are.
    """

    arrays: Any
    quads: Any
    quad_count: int
    surface: Surface
    color: Any | None
    color24: Any | None
    seams: list[Any]
    device: Device


def working_mesh(
    surface: Surface, halfedges: Halfedges, color: Any | None = None, color24: Any | None = None
) -> WorkingMesh:
    """Take over the arrays of a surface and its halfedges: both are of no use afterwards."""
    device = surface.device
    arrays = MeshArrays()
    arrays.corners, arrays.twin = flat_quads(halfedges.quads), halfedges.twin
    arrays.defect, arrays.valence = halfedges.defect, halfedges.valence
    arrays.vertex_halfedge = halfedges.vertex_halfedge
    arrays.position, arrays.cell = surface.vertices, surface.vertex_cell
    arrays.local = surface.vertex_local
    quad_count = surface.quads.shape[0]
    arrays.quad_gone = device.zeros(quad_count, wp.uint8)
    arrays.vertex_gone = device.zeros(surface.vertices.shape[0], wp.uint8)
    return WorkingMesh(arrays, halfedges.quads, quad_count, surface, color, color24, [], device)


@wp.func
def opposite_halfedge(h: wp.int32) -> wp.int32:
    """Return the halfedge on the other side of the quad."""
    return (h & ~3) | ((h + 2) & 3)


@wp.func
def next_outgoing(twin: wp.array(dtype=wp.int32), h: wp.int32) -> wp.int32:
    """Return the next outgoing halfedge of a vertex, twin of previous; -1 at the end of a fan."""
    return twin[previous_halfedge(h)]


@wp.func
def is_skipped(twin: wp.array(dtype=wp.int32), defect: wp.array(dtype=wp.uint8), q: wp.int32) -> wp.bool:
    """Return whether a quad or a neighbour has a side without a twin or on a non-manifold edge."""
    if defect[q] != wp.uint8(0):
        return True
    beside = defect[twin[4 * q] >> 2] | defect[twin[4 * q + 1] >> 2]
    beside |= defect[twin[4 * q + 2] >> 2] | defect[twin[4 * q + 3] >> 2]
    return beside != wp.uint8(0)


@wp.func
def set_twins(twin: wp.array(dtype=wp.int32), h: wp.int32, other: wp.int32):
    """Make two halfedges twins; neither is absent."""
    twin[h] = other
    twin[other] = h
