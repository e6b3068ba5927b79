"""Renumbering without gaps: what stays keeps its order."""

from dataclasses import replace
from typing import Any

import warp as wp

from dmc_cli.mesh.halfedges import Halfedges, flat_quads
from dmc_cli.mesh.selection import new_number, rank_marks
from dmc_cli.mesh.working_mesh import MeshArrays, WorkingMesh
from dmc_cli.surface import Surface
from dmc_cli.surface.grid import bit_index

wp.set_module_options({"enable_backward": False})


def compact(mesh: WorkingMesh) -> tuple[Surface, Halfedges, Any | None, Any | None]:
    """Return the surface, its halfedges, the quads' colours and their colours from the grid, without gaps."""
    device, arrays, surface = mesh.device, mesh.arrays, mesh.surface
    quad_mask, quad_starts, quad_count = rank_marks(device, arrays.quad_gone)
    vertex_mask, vertex_starts, vertex_count = rank_marks(device, arrays.vertex_gone)
    position, cell = device.empty(vertex_count, wp.vec3), device.empty(vertex_count, wp.int64)
    local, valence = device.empty(vertex_count, wp.vec3), device.empty(vertex_count, wp.int32)
    vertex_halfedge = device.empty(vertex_count, wp.int32)
    device.launch(
        compact_vertices_kernel,
        vertex_mask.shape[0],
        [arrays, vertex_mask, vertex_starts, quad_mask, quad_starts],
        [position, cell, local, valence, vertex_halfedge],
    )
    quads, twins = device.empty(quad_count, wp.vec4i), device.empty(quad_count, wp.vec4i)
    defect = device.empty(quad_count, wp.uint8)
    device.launch(
        compact_quads_kernel,
        quad_mask.shape[0],
        [arrays, vertex_mask, vertex_starts, quad_mask, quad_starts],
        [quads, twins, defect],
    )
    colors = []
    for old in (mesh.color, mesh.color24):
        new = None if old is None else device.empty(quad_count, wp.uint8)
        if new is not None:
            device.launch(compact_colors_kernel, quad_mask.shape[0], [old, quad_mask, quad_starts], [new])
        colors.append(new)
    halfedges = Halfedges(quads, flat_quads(twins), vertex_halfedge, valence, defect, None)
    simplified = replace(
        surface, vertices=position, vertex_cell=cell, vertex_local=local, quads=quads, quad_starts=None
    )
    return simplified, halfedges, colors[0], colors[1]


@wp.kernel
def compact_vertices_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    vertex_mask: wp.array(dtype=wp.uint32),
    vertex_starts: wp.array(dtype=wp.int64),
    quad_mask: wp.array(dtype=wp.uint32),
    quad_starts: wp.array(dtype=wp.int64),
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    cell_out: wp.array(dtype=wp.int64),
    local_out: wp.array(dtype=wp.vec3),
    valence_out: wp.array(dtype=wp.int32),
    vertex_halfedge_out: wp.array(dtype=wp.int32),
):
    """Copy the vertices that stay. One thread 32 vertices."""
    w = first + wp.tid()
    left = vertex_mask[w]
    slot = wp.int32(vertex_starts[w])
    while left != wp.uint32(0):
        v = 32 * w + bit_index(left)
        left &= left - wp.uint32(1)
        position_out[slot] = mesh.position[v]
        cell_out[slot] = mesh.cell[v]
        local_out[slot] = mesh.local[v]
        valence_out[slot] = mesh.valence[v]
        h = mesh.vertex_halfedge[v]
        vertex_halfedge_out[slot] = 4 * new_number(quad_mask, quad_starts, h >> 2) + (h & 3)
        slot += 1


@wp.kernel
def compact_quads_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    vertex_mask: wp.array(dtype=wp.uint32),
    vertex_starts: wp.array(dtype=wp.int64),
    quad_mask: wp.array(dtype=wp.uint32),
    quad_starts: wp.array(dtype=wp.int64),
    # Out:
    quads_out: wp.array(dtype=wp.vec4i),
    twins_out: wp.array(dtype=wp.vec4i),
    defect_out: wp.array(dtype=wp.uint8),
):
    """Copy the quads that stay, with new numbers. One thread 32 quads."""
    w = first + wp.tid()
    left = quad_mask[w]
    slot = wp.int32(quad_starts[w])
    while left != wp.uint32(0):
        q = 32 * w + bit_index(left)
        left &= left - wp.uint32(1)
        quad = wp.vec4i()
        twins = wp.vec4i()
        for c in range(4):
            quad[c] = new_number(vertex_mask, vertex_starts, mesh.corners[4 * q + c])
            t = mesh.twin[4 * q + c]
            twins[c] = -1
            if t >= 0:
                twins[c] = 4 * new_number(quad_mask, quad_starts, t >> 2) + (t & 3)
        quads_out[slot] = quad
        twins_out[slot] = twins
        defect_out[slot] = mesh.defect[q]
        slot += 1


@wp.kernel
def compact_colors_kernel(
    # In:
    first: wp.int32,
    colors: wp.array(dtype=wp.uint8),
    quad_mask: wp.array(dtype=wp.uint32),
    quad_starts: wp.array(dtype=wp.int64),
    # Out:
    colors_out: wp.array(dtype=wp.uint8),
):
    """Copy the colours of the quads that stay. One thread 32 quads."""
    w = first + wp.tid()
    left = quad_mask[w]
    slot = wp.int32(quad_starts[w])
    while left != wp.uint32(0):
        colors_out[slot] = colors[32 * w + bit_index(left)]
        left &= left - wp.uint32(1)
        slot += 1
