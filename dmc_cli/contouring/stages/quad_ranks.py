"""Number quads by rank: the number of the quad round any grid edge, without a table of edges.

Quads are numbered word by word of 32 nodes in grid order, in a word first those round edges along x, then y,
then z, each by the edge's lower node (`quads.py`). So a word's three planes of bits (which of its nodes have
an edge with a quad) and the number of its first quad give any quad's number by counting bits.

Conventions: a *face* stands across axis p at its lowest node m and spans u = p + 1 and v = p + 2 (mod 3). Its
four edges are U0 (along u at m), U1 (along u at m + v), V0 (along v at m) and V1 (along v at m + u). A quad's
*side* s joins its corners s and s + 1 when its normal points along the edge's axis: with the next two axes
b and c, side 0 crosses the face across b at node - c, side 1 that across c at the node, side 2 that across
b at the node, side 3 that across c at node - b. In a reversed quad, halfedge 3 - s is on side s.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import LANES, VECTOR_FLAGS, has_bit
from dmc_cli.contouring.stages.cell_words import CellBits
from dmc_cli.contouring.stages.plain_quads import quad_edges
from dmc_cli.field import BLOCKS_A_CHUNK, Grid, GridShape, before_line, block_count
from dmc_cli.runtime import Device

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

QuadWord = wp.types.vector(length=4, dtype=wp.uint32)
"""Edges with a quad along x, y, z from the nodes of a word, a bit each; then the number of the first quad."""

LOWEST = wp.uint32(1)


def rank_quads(cells: Any, grid: GridShape, quad_starts: Any, device: Device) -> Any:
    """Return the `QuadWord` of each word of nodes, [row, word], half a byte a node, where the surface is.

    Words more than a row and a layer away from all quads, which nobody looks at, are left as they are.

    Args:
        cells: Active cells.
        grid: The grid over the volume.
        quad_starts: Quads before each block of words, as `Surface` holds them.
        device: Where to work.
    """
    words = device.empty((grid.rows, grid.words), QuadWord)
    inputs = [grid.struct(), cells.bits, quad_starts]
    device.launch(rank_quads_kernel, block_count(grid), inputs, [words.flatten()], BLOCKS_A_CHUNK)
    return words


@wp.func
def has_quads_near(grid: Grid, starts: wp.array(dtype=wp.int64), block: wp.int32) -> wp.bool:
    """Return whether words of a block are beside words with quads: a row, a layer or both away at most."""
    n = block * LANES
    last = starts.shape[0] - 2
    near = bool(False)
    for step in range(-1, 2):
        low = (n + step * grid.layer - grid.words - 1) / LANES - 1  # a division rounds towards 0
        high = (n + step * grid.layer + grid.words + LANES) / LANES
        if starts[wp.clamp(low, 0, last)] != starts[wp.clamp(high, 0, last) + 1]:
            near = bool(True)
    return near


@wp.kernel
def rank_quads_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    starts: wp.array(dtype=wp.int64),
    # Out:
    words_out: wp.array(dtype=QuadWord),
) -> None:
    """Store the edges with a quad and the quads before each word. One thread per block of words."""
    block = first + wp.tid()
    n = block * LANES
    size = wp.min(LANES, words_out.shape[0] - n)
    if starts[block] == starts[block + 1]:
        if has_quads_near(grid, starts, block):
            for lane in range(size):
                words_out[n + lane] = QuadWord()
        return
    count = wp.uint32(starts[block])
    edges = quad_edges(grid, bits, before_line(grid) + n)
    for lane in range(size):
        x = edges[lane]
        y = edges[LANES + lane]
        z = edges[2 * LANES + lane]
        words_out[n + lane] = QuadWord(x, y, z, count)
        count += wp.uint32(wp.bit_count(x) + wp.bit_count(y) + wp.bit_count(z))


@wp.func
def axis_first(word: QuadWord, axis: wp.int32) -> wp.int32:
    """Return the number of the first quad along an axis in a word."""
    number = wp.int32(word[3])
    if axis > 0:
        number += wp.int32(wp.bit_count(word[0]))
    if axis > 1:
        number += wp.int32(wp.bit_count(word[1]))
    return number


@wp.func
def quad_in(word: QuadWord, axis: wp.int32, b: wp.int32) -> wp.int32:
    """Return the number of the quad round the edge from node b of a word along an axis, which has one."""
    below = (LOWEST << wp.uint32(b)) - LOWEST
    return axis_first(word, axis) + wp.int32(wp.bit_count(word[axis] & below))


@wp.func
def has_quad(words: wp.array2d(dtype=QuadWord), row: wp.int32, i: wp.int32, axis: wp.int32) -> wp.bool:
    """Return whether a quad goes round the edge from node i of a row along an axis."""
    return has_bit(words[row, i >> 5][axis], i & 31)


@wp.func
def quad_round(words: wp.array2d(dtype=QuadWord), row: wp.int32, i: wp.int32, axis: wp.int32) -> wp.int32:
    """Return the number of the quad round the edge from node i of a row along an axis, which has one."""
    return quad_in(words[row, i >> 5], axis, i & 31)


@wp.func
def side_halfedge(q: wp.int32, side: wp.int32, forward: wp.bool) -> wp.int32:
    """Return the halfedge on a side of a quad; forward: its normal points along the edge's axis."""
    return 4 * q + wp.where(forward, side, 3 - side)
