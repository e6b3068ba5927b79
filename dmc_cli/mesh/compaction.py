"""Close the gaps that removed quads and vertices leave: the last ones move into them.

What does not move keeps its number; the gaps, in ascending order, take what stays of the numbers beyond the
new end, in ascending order. So the work and the memory beside the mesh grow with what was removed, not with
the mesh.
"""

from dataclasses import dataclass, replace
from typing import Any

import warp as wp

from dmc_cli.bits.selection import WORDS_A_CHUNK, list_mask, mask_marks, part
from dmc_cli.bits.words import VECTOR_FLAGS, low_bits
from dmc_cli.mesh.halfedges import Halfedges
from dmc_cli.mesh.surface import Surface
from dmc_cli.mesh.working_mesh import MeshArrays, WorkingMesh
from dmc_cli.runtime.device import FLAGS_A_CHUNK, ITEMS_A_CHUNK, Device

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


@dataclass(frozen=True)
class Moves:
    """Which items go where: `gaps` take `movers` in order; `moved_to` tells, from `end` on, a mover's gap."""

    end: int
    gaps: Any
    movers: Any
    moved_to: Any


def compact(mesh: WorkingMesh) -> tuple[Surface, Halfedges, Any | None, Any | None]:
    """Return the surface, its halfedges, the quads' colours and their colours from the grid, without gaps.

    They are views of the arrays that the mesh was made of.
    """
    device, arrays, surface = mesh.device, mesh.arrays, mesh.surface
    vertices, quads = _plan_moves(device, arrays.vertex_gone), _plan_moves(device, arrays.quad_gone)
    device.launch(
        move_vertices_kernel,
        vertices.gaps.shape[0],
        [arrays, vertices.gaps, vertices.movers],
        [],
        ITEMS_A_CHUNK,
    )
    device.launch(
        move_quads_kernel, quads.gaps.shape[0], [arrays, quads.gaps, quads.movers], [], ITEMS_A_CHUNK
    )
    for color in (mesh.color, mesh.color24):
        if color is not None:
            device.launch(
                move_colors_kernel, quads.gaps.shape[0], [quads.gaps, quads.movers], [color], FLAGS_A_CHUNK
            )
    if vertices.gaps.shape[0]:
        inputs = [arrays, vertices.end, 4 * quads.end, vertices.moved_to]
        device.launch(rename_vertices_kernel, -(-quads.end // 16), inputs, [])
    inputs = [arrays, quads.gaps, quads.movers, quads.end, quads.moved_to]
    device.launch(rename_quads_kernel, quads.gaps.shape[0], inputs, [], ITEMS_A_CHUNK)
    halfedges = Halfedges(
        part(device, mesh.quads, 0, quads.end),
        part(device, arrays.twin, 0, 4 * quads.end),
        part(device, arrays.vertex_halfedge, 0, vertices.end),
        part(device, arrays.valence, 0, vertices.end),
        part(device, arrays.defect, 0, quads.end),
        None,
    )
    simplified = replace(
        surface,
        vertices=part(device, arrays.position, 0, vertices.end),
        vertex_cell=part(device, arrays.cell, 0, vertices.end),
        vertex_local=part(device, arrays.local, 0, vertices.end),
        quads=halfedges.quads,
        quad_starts=None,
    )
    colors = [
        None if color is None else part(device, color, 0, quads.end) for color in (mesh.color, mesh.color24)
    ]
    return simplified, halfedges, colors[0], colors[1]


def _plan_moves(device: Device, gone: Any) -> Moves:
    """Return where items go, given a mark (uint8, not 0) for each that has gone."""
    count = gone.shape[0]
    mask, gone_count = mask_marks(device, gone)
    end = count - gone_count
    device.launch(find_moves_kernel, mask.shape[0], [end, count], [mask], 16 * WORDS_A_CHUNK)
    listed = list_mask(device, mask)
    half = listed.shape[0] // 2
    moved_to = device.empty(count - end, wp.int32)
    gaps, movers = part(device, listed, 0, half), part(device, listed, half, 2 * half)
    device.launch(tell_moves_kernel, half, [gaps, movers, end], [moved_to], FLAGS_A_CHUNK)
    return Moves(end, gaps, movers, moved_to)


@wp.kernel
def find_moves_kernel(
    # In:
    first: wp.int32,
    end: wp.int32,
    count: wp.int32,
    # In/out:
    mask_inout: wp.array(dtype=wp.uint32),
):
    """Turn a mask of all gaps into one of those before the new end and of what stays beyond it.

    There are as many of each. One thread 32 items.
    """
    w = first + wp.tid()
    ahead = low_bits(end - 32 * w)
    mask_inout[w] = (mask_inout[w] ^ ~ahead) & low_bits(count - 32 * w)


@wp.kernel
def tell_moves_kernel(
    # In:
    first: wp.int32,
    gaps: wp.array(dtype=wp.int32),
    movers: wp.array(dtype=wp.int32),
    end: wp.int32,
    # Out:
    moved_to_out: wp.array(dtype=wp.int32),
):
    """Tell where each mover goes. One thread a mover."""
    n = first + wp.tid()
    moved_to_out[movers[n] - end] = gaps[n]


@wp.kernel
def move_vertices_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    gaps: wp.array(dtype=wp.int32),
    movers: wp.array(dtype=wp.int32),
):
    """Move the vertices. One thread a mover."""
    n = first + wp.tid()
    gap = gaps[n]
    v = movers[n]
    mesh.position[gap] = mesh.position[v]
    mesh.cell[gap] = mesh.cell[v]
    mesh.local[gap] = mesh.local[v]
    mesh.valence[gap] = mesh.valence[v]
    mesh.vertex_halfedge[gap] = mesh.vertex_halfedge[v]


@wp.kernel
def move_quads_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    gaps: wp.array(dtype=wp.int32),
    movers: wp.array(dtype=wp.int32),
):
    """Move the quads. One thread a mover."""
    n = first + wp.tid()
    gap = gaps[n]
    q = movers[n]
    for c in range(4):
        mesh.corners[4 * gap + c] = mesh.corners[4 * q + c]
        mesh.twin[4 * gap + c] = mesh.twin[4 * q + c]
    mesh.defect[gap] = mesh.defect[q]


@wp.kernel
def move_colors_kernel(
    # In:
    first: wp.int32,
    gaps: wp.array(dtype=wp.int32),
    movers: wp.array(dtype=wp.int32),
    # In/out:
    colors_inout: wp.array(dtype=wp.uint8),
):
    """Move the quads' colours. One thread a mover."""
    n = first + wp.tid()
    colors_inout[gaps[n]] = colors_inout[movers[n]]


@wp.func_native(
    """
    const int* corner = (const int*)corners.data + 64 * (size_t)block;
    int highest = -1;
    for (int n = 0; n < 64; ++n) highest = corner[n] > highest ? corner[n] : highest;
    return highest;
    """
)
def highest_corner(corners: wp.array(dtype=wp.int32), block: wp.int32) -> wp.int32:
    """Return the highest vertex of the quads 16 `block` to 16 `block` + 15."""
    ...


@wp.kernel
def rename_vertices_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    end: wp.int32,
    corner_count: wp.int32,
    moved_to: wp.array(dtype=wp.int32),
):
    """Give the quads their moved vertices' new numbers. One thread 16 quads: most have none."""
    block = first + wp.tid()
    if 64 * block + 64 <= corner_count:
        if highest_corner(mesh.corners, block) < end:
            return
    for n in range(64 * block, wp.min(64 * block + 64, corner_count)):
        v = mesh.corners[n]
        if v >= end:
            mesh.corners[n] = moved_to[v - end]


@wp.kernel
def rename_quads_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,  # changed
    gaps: wp.array(dtype=wp.int32),
    movers: wp.array(dtype=wp.int32),
    end: wp.int32,
    moved_to: wp.array(dtype=wp.int32),
):
    """Tell twins and vertices the moved quads' new numbers. One thread a mover.

    Two moved quads that are neighbours write the same to each other.
    """
    n = first + wp.tid()
    for c in range(4):
        h = 4 * gaps[n] + c
        t = mesh.twin[h]
        if t >= 4 * end:
            t = 4 * moved_to[(t >> 2) - end] + (t & 3)
            mesh.twin[h] = t
        if t >= 0:
            mesh.twin[t] = h
        v = mesh.corners[h]
        if mesh.vertex_halfedge[v] == 4 * movers[n] + c:
            mesh.vertex_halfedge[v] = h
