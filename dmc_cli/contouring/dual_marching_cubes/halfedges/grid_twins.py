"""Find the twins of halfedges from the grid: no hash, no sort, no guess.

A mesh edge is dual to a segment in a cell face, and the segment joins two of the face's grid edges. The
twin of the halfedge on that side of the quad round one of them is the halfedge on that side of the quad
round the other; there is none if no quad goes round it. That is right also where four quads share two
vertices, where Grosso & Zint 2021 (section 3.2) pair by whatever order a hash table has.

`plain_twins.py` finds most of them by bits alone. On ambiguous faces, and near the grid's ends or nodes
without data, the inside bits and the special cell's decision tell.

The kernel also finds the quads with a *defect*: a side without a twin, or with two vertices that more than
two quads join. Simplification leaves them and their neighbours alone. Non-manifold edges come from
ambiguous faces only: any two vertices are joined through at most one cell face.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import ALL_BITS, LANES, VECTOR_FLAGS, bit_index, has_bit
from dmc_cli.contouring.dual_marching_cubes.quads import surely_ordinary
from dmc_cli.contouring.dual_marching_cubes.special_cells import SpecialCells, find_special
from dmc_cli.contouring.stages.cell_words import CellBits
from dmc_cli.contouring.stages.face_twins import (
    Face,
    halfedge_at,
    inner_nodes,
    joined_place,
    undecided_face,
)
from dmc_cli.contouring.stages.plain_twins import UNSURE, store_plain_twins
from dmc_cli.contouring.stages.quad_ranks import (
    QuadWord,
    quad_in,
)
from dmc_cli.contouring.surface import Surface
from dmc_cli.field import BLOCKS_A_CHUNK, Grid, before_line, block_count

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


def find_grid_twins(surface: Surface) -> tuple[Any, Any]:
    """Return the twins, int32 vec4 (Q,), -1 for none, and which quads have a defect, uint8 (Q,).

    Args:
        surface: The surface as it was extracted, with the quads' ranks.
    """
    frame, numbering, device = surface.placement.frame, surface.numbering, surface.mesh.device
    grid, count = frame.grid, surface.mesh.face_count
    twins, defects = device.empty(count, wp.vec4i), device.empty(count, wp.uint8)
    inputs = [grid.struct(), numbering.cells.bits, numbering.polygons.special, int(numbering.is_reversed)]
    inputs += [frame.field.has_nodata, numbering.quad_words, numbering.quad_starts, surface.mesh.faces]
    device.launch(find_twins_kernel, block_count(grid), inputs, [twins, defects], BLOCKS_A_CHUNK)
    return twins, defects


@wp.func
def face_on_side(
    grid: Grid, bits: CellBits, special: SpecialCells, axis: wp.int32, node: wp.vec3i, side: wp.int32
) -> Face:
    """Return the face that a quad's side crosses; node is the lower one of the quad's edge."""
    face = undecided_face(grid, bits, axis, node, side)
    if face.is_ambiguous:
        s = find_special(bits, face.node[1] + grid.ny * face.node[2], face.node[0])
        face.cuts_f1 = face.f0 == has_bit(special.joined[s], 2 * face.axis)
    return face


@wp.func
def joins_same(quads: wp.array(dtype=wp.vec4i), h: wp.int32, other: wp.int32) -> wp.bool:
    """Return whether two halfedges join the same two vertices, either way."""
    a = quads[h // 4][h % 4]
    b = quads[h // 4][(h + 1) % 4]
    c = quads[other // 4][other % 4]
    d = quads[other // 4][(other + 1) % 4]
    return (a == c and b == d) or (a == d and b == c)


@wp.func
def is_nonmanifold(
    grid: Grid,
    words: wp.array2d(dtype=QuadWord),
    quads: wp.array(dtype=wp.vec4i),
    is_reversed: wp.int32,
    face: Face,
    place: wp.int32,
) -> wp.bool:
    """Return whether more than two quads join the two vertices of the halfedge at a place of a face."""
    count = int(0)
    if face.is_ambiguous:
        h = halfedge_at(grid, words, is_reversed, face, place)
        for other_place in range(4):
            other = halfedge_at(grid, words, is_reversed, face, other_place)
            if other >= 0:
                if joins_same(quads, h, other):
                    count += 1
    return count > 2


@wp.func
def find_with_care(
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    is_reversed: wp.int32,
    words: wp.array2d(dtype=QuadWord),
    quads: wp.array(dtype=wp.vec4i),
    n: wp.int32,
    axis: wp.int32,
    plain: wp.uint32,
    inner: wp.uint32,
    forward: wp.uint32,
    twins_out: wp.array(dtype=wp.vec4i),
    defects_out: wp.array(dtype=wp.uint8),
) -> None:
    """Find the twins of those quads along an axis of word n that may have special cells beside them.

    Those of `inner` nodes are there already, but for sides that are `UNSURE`.
    """
    row = n / grid.words
    w = n - row * grid.words
    k = row / grid.ny
    word = words[row, w]
    remaining = word[axis] & ~plain
    while remaining != wp.uint32(0):
        b = bit_index(remaining)
        remaining &= remaining - wp.uint32(1)
        q = quad_in(word, axis, b)
        node = wp.vec3i(32 * w + b, row - k * grid.ny, k)
        reversal = wp.where(has_bit(forward, b), 0, 3)
        t = wp.vec4i(UNSURE, UNSURE, UNSURE, UNSURE)
        if has_bit(inner, b):
            t = twins_out[q]
        for side in range(4):
            if t[side ^ reversal] == UNSURE:
                face = face_on_side(grid, bits, special, axis, node, side)
                h = halfedge_at(grid, words, is_reversed, face, joined_place(face, side ^ 1))
                t[side ^ reversal] = h
                if h < 0 or is_nonmanifold(grid, words, quads, is_reversed, face, side ^ 1):
                    defects_out[q] = wp.uint8(1)
        twins_out[q] = t


@wp.kernel
def find_twins_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    is_reversed: wp.int32,
    has_nodata: wp.int32,
    words: wp.array2d(dtype=QuadWord),
    starts: wp.array(dtype=wp.int64),
    quads: wp.array(dtype=wp.vec4i),
    # Out:
    twins_out: wp.array(dtype=wp.vec4i),
    defects_out: wp.array(dtype=wp.uint8),
) -> None:
    """Find the twins of the halfedges of all quads. One thread per block of words."""
    block = first + wp.tid()
    start = block * LANES
    q = wp.int32(starts[block])
    end = wp.int32(starts[block + 1])
    if q == end:
        return
    for other in range(q, end):
        defects_out[other] = wp.uint8(0)
    plain = surely_ordinary(grid, bits, before_line(grid) + start)
    reversal = wp.where(is_reversed == 1, ALL_BITS, wp.uint32(0))
    for n in range(start, wp.min(start + LANES, grid.layer * grid.nz)):
        row = n / grid.words
        w = n - row * grid.words
        word = words[row, w]
        some = word[0] | word[1] | word[2]
        if some != wp.uint32(0):
            q = wp.int32(word[3])
            forward = bits.inside[row, w] ^ reversal
            inner = inner_nodes(grid, has_nodata, row, w)
            known = plain[n - start] | inner
            store_plain_twins(words, n, grid.words, grid.layer, known, forward, q, twins_out)
            if (some & ~plain[n - start]) != wp.uint32(0):
                for axis in range(3):
                    find_with_care(
                        grid,
                        bits,
                        special,
                        is_reversed,
                        words,
                        quads,
                        n,
                        axis,
                        plain[n - start],
                        inner,
                        forward,
                        twins_out,
                        defects_out,
                    )
