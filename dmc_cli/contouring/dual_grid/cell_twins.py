"""Connect the quads of the dual of the grid by halfedges, from the grid.

Two vertices are joined through one cell face, by as many quads as that has crossed edges with quads: two, or
on an ambiguous face four. These are paired as the segments run that cut off the inside corners, in both cells
alike. `plain_twins.py` finds the twins through all other faces by bits alone.
"""

from dataclasses import replace

import warp as wp

from dmc_cli.bits import ALL_BITS, LANES, VECTOR_FLAGS, bit_index, has_bit
from dmc_cli.contouring.stages.cell_words import CellBits
from dmc_cli.contouring.stages.face_twins import (
    Face,
    halfedge_at,
    inner_nodes,
    joined_place,
    undecided_face,
)
from dmc_cli.contouring.stages.numbering import numbering_of
from dmc_cli.contouring.stages.plain_twins import UNSURE, store_plain_twins
from dmc_cli.contouring.stages.quad_ranks import QuadWord, quad_in, rank_quads
from dmc_cli.contouring.surface import Surface
from dmc_cli.field import BLOCKS_A_CHUNK, Grid, block_count
from dmc_cli.mesh import DEFECT, connect_by, flat_corners

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


def connect_dual(surface: Surface) -> Surface:
    """Return the surface with halfedges, the quads' ranks and their defects."""
    numbering, frame, device = numbering_of(surface), surface.placement.frame, surface.mesh.device
    grid, count = frame.grid, surface.mesh.face_count
    words = rank_quads(numbering.cells, grid, numbering.quad_starts, device)
    twins, defects = device.empty(count, wp.vec4i), device.empty(count, wp.uint8)
    inputs = [grid.struct(), numbering.cells.bits, int(numbering.is_reversed), frame.field.has_nodata]
    inputs += [words, numbering.quad_starts]
    device.launch(find_cell_twins_kernel, block_count(grid), inputs, [twins, defects], BLOCKS_A_CHUNK)
    mesh = connect_by(surface.mesh, flat_corners(twins)).with_face_values({DEFECT: defects})
    return replace(surface, mesh=mesh, numbering=replace(numbering, quad_words=words))


@wp.func
def quads_through(
    grid: Grid, words: wp.array2d(dtype=QuadWord), is_reversed: wp.int32, face: Face
) -> wp.int32:
    """Return how many quads join the two cells of an ambiguous face."""
    count = int(0)
    for place in range(4):
        if halfedge_at(grid, words, is_reversed, face, place) >= 0:
            count += 1
    return count


@wp.func
def find_dual_with_care(
    grid: Grid,
    bits: CellBits,
    is_reversed: wp.int32,
    words: wp.array2d(dtype=QuadWord),
    n: wp.int32,
    axis: wp.int32,
    inner: wp.uint32,
    forward: wp.uint32,
    twins_out: wp.array(dtype=wp.vec4i),
    defects_out: wp.array(dtype=wp.uint8),
) -> None:
    """Find the twins of the quads along an axis of word n; of `inner` nodes those that are `UNSURE`."""
    row = n / grid.words
    w = n - row * grid.words
    k = row / grid.ny
    word = words[row, w]
    remaining = word[axis]
    while remaining != wp.uint32(0):
        b = bit_index(remaining)
        remaining &= remaining - wp.uint32(1)
        q = quad_in(word, axis, b)
        node = wp.vec3i(32 * w + b, row - k * grid.ny, k)
        reversal = wp.where(has_bit(forward, b), 0, 3)
        t = wp.vec4i(UNSURE, UNSURE, UNSURE, UNSURE)
        if has_bit(inner, b):
            t = twins_out[q]
        defect = int(0)
        for side in range(4):
            if t[side ^ reversal] == UNSURE:
                face = undecided_face(grid, bits, axis, node, side)
                face.cuts_f1 = not face.f0
                h = halfedge_at(grid, words, is_reversed, face, joined_place(face, side ^ 1))
                t[side ^ reversal] = h
                if h < 0:
                    defect = 1
                if face.is_ambiguous:
                    if quads_through(grid, words, is_reversed, face) > 2:
                        defect = 1
        twins_out[q] = t
        defects_out[q] = wp.uint8(defect)


@wp.kernel
def find_cell_twins_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    is_reversed: wp.int32,
    has_nodata: wp.int32,
    words: wp.array2d(dtype=QuadWord),
    starts: wp.array(dtype=wp.int64),
    # Out:
    twins_out: wp.array(dtype=wp.vec4i),
    defects_out: wp.array(dtype=wp.uint8),
) -> None:
    """Find the twins of the halfedges of all quads. One thread per block of words."""
    block = first + wp.tid()
    start = block * LANES
    if starts[block] == starts[block + 1]:
        return
    reversal = wp.where(is_reversed == 1, ALL_BITS, wp.uint32(0))
    for n in range(start, wp.min(start + LANES, grid.layer * grid.nz)):
        row = n / grid.words
        w = n - row * grid.words
        word = words[row, w]
        if (word[0] | word[1] | word[2]) != wp.uint32(0):
            forward = bits.inside[row, w] ^ reversal
            inner = inner_nodes(grid, has_nodata, row, w)
            q = wp.int32(word[3])
            store_plain_twins(words, n, grid.words, grid.layer, inner, forward, q, twins_out)
            for axis in range(3):
                find_dual_with_care(
                    grid, bits, is_reversed, words, n, axis, inner, forward, twins_out, defects_out
                )
