"""Hold the mesh between rounds of remeshing: without gaps, or with room for what comes.

Numbers keep their order. Places are made by flags and a prefix sum, so they are the same on any device.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.runtime.device import Device

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class Mesh:
    """A quad mesh on the surface.

    Attributes:
        corners: Vertex of each halfedge, int32 (4Q,).
        twin: Twin of each halfedge, int32 (4Q,), -1 on a boundary.
        colors: Colours of quads, arrays uint8 (Q,), any number of them.
        vertex_halfedge: A halfedge of each vertex, int32 (V,).
        valence: Mesh edges at each vertex, int32 (V,).
        position: In the output space, vec3 (V,).
        cell: Numbers of cells, int64 (V,).
        local: Coordinates in the cell, vec3 (V,).
        frozen: uint8 (V,), 1 for a vertex that must stay.
        quad_gone: uint8 (Q,), not 0 for a quad that is not there.
        vertex_gone: The same of vertices, uint8 (V,).
    """

    corners: Any
    twin: Any
    colors: tuple[Any, ...]
    vertex_halfedge: Any
    valence: Any
    position: Any
    cell: Any
    local: Any
    frozen: Any
    quad_gone: Any
    vertex_gone: Any

    @property
    def quad_count(self) -> int:
        """Places for quads."""
        return int(self.quad_gone.shape[0])

    @property
    def vertex_count(self) -> int:
        """Places for vertices."""
        return int(self.vertex_gone.shape[0])


def with_room(mesh: Mesh, spare: int, device: Device) -> Mesh:
    """Return a copy with `spare` more places for vertices and quads, which are marked as gone."""
    return Mesh(
        _longer(mesh.corners, 4 * spare, device),
        _longer(mesh.twin, 4 * spare, device),
        tuple(_longer(color, spare, device) for color in mesh.colors),
        _longer(mesh.vertex_halfedge, spare, device),
        _longer(mesh.valence, spare, device),
        _longer(mesh.position, spare, device),
        _longer(mesh.cell, spare, device),
        _longer(mesh.local, spare, device),
        _longer(mesh.frozen, spare, device),
        _longer(mesh.quad_gone, spare, device, 1),
        _longer(mesh.vertex_gone, spare, device, 1),
    )


def _longer(array: Any, more: int, device: Device, value: int = 0) -> Any:
    """Return a copy of an array with more items at its end."""
    count = array.shape[0]
    longer = device.empty(count + more, array.dtype)
    if count:
        wp.copy(longer, array, count=count)
    if more:
        longer[count:].fill_(value)
    return longer


def without_gaps(mesh: Mesh, nearest_quad: Any, device: Device) -> tuple[Mesh, Any]:
    """Return the mesh without what has gone, and the new numbers of the quads `nearest_quad`, int32."""
    quad_starts, quads = _rank(mesh.quad_gone, device)
    vertex_starts, vertices = _rank(mesh.vertex_gone, device)
    packed = Mesh(
        device.empty(4 * quads, wp.int32),
        device.empty(4 * quads, wp.int32),
        tuple(device.empty(quads, wp.uint8) for _ in mesh.colors),
        device.empty(vertices, wp.int32),
        device.empty(vertices, wp.int32),
        device.empty(vertices, wp.vec3),
        device.empty(vertices, wp.int64),
        device.empty(vertices, wp.vec3),
        device.empty(vertices, wp.uint8),
        device.zeros(quads, wp.uint8),
        device.zeros(vertices, wp.uint8),
    )
    inputs = [mesh.corners, mesh.twin, quad_starts, vertex_starts]
    device.launch(pack_quads_kernel, mesh.quad_count, inputs, [packed.corners, packed.twin])
    for old, new in zip(mesh.colors, packed.colors, strict=True):
        device.launch(pack_colors_kernel, mesh.quad_count, [old, quad_starts], [new])
    inputs = [mesh.vertex_halfedge, mesh.valence, mesh.frozen, quad_starts, vertex_starts]
    outputs = [packed.vertex_halfedge, packed.valence, packed.frozen]
    device.launch(pack_vertices_kernel, mesh.vertex_count, inputs, outputs)
    inputs = [mesh.position, mesh.cell, mesh.local, vertex_starts]
    outputs = [packed.position, packed.cell, packed.local]
    device.launch(pack_places_kernel, mesh.vertex_count, inputs, outputs)
    new_nearest = device.empty(nearest_quad.shape[0], wp.int32)
    device.launch(renumber_kernel, nearest_quad.shape[0], [nearest_quad, quad_starts], [new_nearest])
    return packed, new_nearest


def _rank(gone: Any, device: Device) -> tuple[Any, int]:
    """Return how many items stay before each, and in all."""
    stays = device.empty(gone.shape[0], wp.int64)
    device.launch(mark_staying_kernel, gone.shape[0], [gone], [stays])
    return device.starts(stays)


@wp.kernel
def mark_staying_kernel(
    # In:
    first: wp.int32,
    gone: wp.array(dtype=wp.uint8),
    # Out:
    stays_out: wp.array(dtype=wp.int64),
):
    """Mark what stays. One thread an item."""
    n = first + wp.tid()
    stays_out[n] = wp.where(gone[n] == wp.uint8(0), wp.int64(1), wp.int64(0))


@wp.kernel
def renumber_kernel(
    # In:
    first: wp.int32,
    number: wp.array(dtype=wp.int32),
    starts: wp.array(dtype=wp.int64),
    # Out:
    number_out: wp.array(dtype=wp.int32),
):
    """Find the new numbers of items. One thread an item."""
    n = first + wp.tid()
    number_out[n] = wp.int32(starts[number[n]])


@wp.func
def new_halfedge(starts: wp.array(dtype=wp.int64), h: wp.int32) -> wp.int32:
    """Return a halfedge's number once its quad has its own; an absent one stays so."""
    return wp.where(h < 0, -1, 4 * wp.int32(starts[wp.max(h, 0) >> 2]) + (h & 3))


@wp.kernel
def pack_quads_kernel(
    # In:
    first: wp.int32,
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    quad_starts: wp.array(dtype=wp.int64),
    vertex_starts: wp.array(dtype=wp.int64),
    # Out:
    corners_out: wp.array(dtype=wp.int32),
    twin_out: wp.array(dtype=wp.int32),
):
    """Copy the quads that stay, with new numbers. One thread a quad."""
    q = first + wp.tid()
    slot = wp.int32(quad_starts[q])
    if quad_starts[q] != quad_starts[q + 1]:
        for c in range(4):
            corners_out[4 * slot + c] = wp.int32(vertex_starts[corners[4 * q + c]])
            twin_out[4 * slot + c] = new_halfedge(quad_starts, twin[4 * q + c])


@wp.kernel
def pack_colors_kernel(
    # In:
    first: wp.int32,
    color: wp.array(dtype=wp.uint8),
    quad_starts: wp.array(dtype=wp.int64),
    # Out:
    color_out: wp.array(dtype=wp.uint8),
):
    """Copy the colours of the quads that stay. One thread a quad."""
    q = first + wp.tid()
    if quad_starts[q] != quad_starts[q + 1]:
        color_out[quad_starts[q]] = color[q]


@wp.kernel
def pack_vertices_kernel(
    # In:
    first: wp.int32,
    vertex_halfedge: wp.array(dtype=wp.int32),
    valence: wp.array(dtype=wp.int32),
    frozen: wp.array(dtype=wp.uint8),
    quad_starts: wp.array(dtype=wp.int64),
    vertex_starts: wp.array(dtype=wp.int64),
    # Out:
    vertex_halfedge_out: wp.array(dtype=wp.int32),
    valence_out: wp.array(dtype=wp.int32),
    frozen_out: wp.array(dtype=wp.uint8),
):
    """Copy what is known of the vertices that stay. One thread a vertex."""
    v = first + wp.tid()
    slot = vertex_starts[v]
    if slot != vertex_starts[v + 1]:
        vertex_halfedge_out[slot] = new_halfedge(quad_starts, vertex_halfedge[v])
        valence_out[slot] = valence[v]
        frozen_out[slot] = frozen[v]


@wp.kernel
def pack_places_kernel(
    # In:
    first: wp.int32,
    position: wp.array(dtype=wp.vec3),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    vertex_starts: wp.array(dtype=wp.int64),
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    cell_out: wp.array(dtype=wp.int64),
    local_out: wp.array(dtype=wp.vec3),
):
    """Copy where the vertices are that stay. One thread a vertex."""
    v = first + wp.tid()
    slot = vertex_starts[v]
    if slot != vertex_starts[v + 1]:
        position_out[slot] = position[v]
        cell_out[slot] = cell[v]
        local_out[slot] = local[v]
