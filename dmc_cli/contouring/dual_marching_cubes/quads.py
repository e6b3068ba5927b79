"""Connect quads: one round each crossed grid edge whose four cells exist.

Order: word by word of 32 nodes in grid order; in a word first the edges along x, then y, then z, each by
their lower node. So a quad's number is a rank, as a vertex's is. The quad round an edge goes
through its four cells counter-clockwise about the edge's axis, beginning with the lowest cell, so that its
normal points along the axis; it is reversed where the surface's normal points the other way (Grosso & Zint
2021, section 3.1.3, with the misprints of table 1 put right).
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.bits import (
    ALL_BITS,
    LANES,
    VECTOR_FLAGS,
    Words,
    bit_index,
    has_bit,
    low_bits,
    previous_node,
)
from dmc_cli.contouring.dual_marching_cubes.cells import Cells
from dmc_cli.contouring.dual_marching_cubes.polygons import Polygons
from dmc_cli.contouring.dual_marching_cubes.special_cells import SpecialCells
from dmc_cli.contouring.stages.cell_words import CellBits
from dmc_cli.contouring.stages.plain_quads import count_bits, quad_edges, store_plain_quads
from dmc_cli.contouring.stages.tracing import EDGE_LOW, owner_of
from dmc_cli.field import BLOCKS_A_CHUNK, Grid, GridShape, before_line, block_count
from dmc_cli.runtime import Device, native

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

QUAD_EDGES = wp.constant(wp.types.vector(length=12, dtype=wp.int32)(6, 4, 0, 2, 5, 1, 3, 7, 10, 11, 8, 9))
"""Which edge of its four cells an edge along x, y, z is, the cells in the order of its quad's corners."""


@dataclass(frozen=True)
class Quads:
    """Quads in the order of their numbers.

    Attributes:
        corners: int32 vec4 (Q,), vertex numbers.
        starts: Quads before each block of words, int64, one item more than blocks.
    """

    corners: Any
    starts: Any


def connect_quads(
    cells: Cells, polygons: Polygons, grid: GridShape, is_reversed: bool, device: Device
) -> Quads:
    """Begin to connect the quads; they are there for the next launch.

    Args:
        cells: Active cells, with the ordinary ones' numbers.
        polygons: The special cells' vertices.
        grid: The grid over the volume.
        is_reversed: Make normals point towards the inside nodes instead of away from them.
        device: Where to work.
    """
    struct, blocks = grid.struct(), block_count(grid)
    starts, quad_count = cells.quad_starts, cells.quad_count
    if starts is None:
        counts = device.empty(blocks, wp.int64)
        inputs = [struct, cells.bits, cells.ordinary_starts, cells.special_starts]
        device.launch(count_quads_kernel, blocks, inputs, [counts], BLOCKS_A_CHUNK)
        starts, quad_count = device.starts(counts)
    quads = device.empty(quad_count, wp.vec4i)
    inputs = [struct, cells.bits, polygons.special, cells.ordinary_count, int(is_reversed), starts]
    device.begin(connect_quads_kernel, blocks, inputs, [quads], BLOCKS_A_CHUNK)
    return Quads(quads, starts)


@wp.func
def surely_ordinary(grid: Grid, bits: CellBits, n: wp.int32) -> Words:
    """Return a bit for each node of a block: whether all active cells round its edges are ordinary."""
    here = bits.active_line[n] & ~bits.ordinary_line[n]
    here_before = bits.active_line[n - 1] & ~bits.ordinary_line[n - 1]
    below = bits.active_line[n - grid.words] & ~bits.ordinary_line[n - grid.words]
    below_before = bits.active_line[n - grid.words - 1] & ~bits.ordinary_line[n - grid.words - 1]
    front = bits.active_line[n - grid.layer] & ~bits.ordinary_line[n - grid.layer]
    front_before = bits.active_line[n - grid.layer - 1] & ~bits.ordinary_line[n - grid.layer - 1]
    both_n = n - grid.layer - grid.words
    both = bits.active_line[both_n] & ~bits.ordinary_line[both_n]
    plain = Words()
    for lane in range(LANES):
        special = here[lane] | below[lane] | front[lane]
        before = here_before[lane] | below_before[lane] | front_before[lane]
        plain[lane] = ~(special | both[lane] | previous_node(special, before))
    return plain


@wp.kernel
def count_quads_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    ordinary_starts: wp.array(dtype=wp.int64),
    special_starts: wp.array(dtype=wp.int64),
    # Out:
    counts_out: wp.array(dtype=wp.int64),
) -> None:
    """Count the quads where some cells do not exist. One thread per block of words."""
    block = first + wp.tid()
    count = wp.int32(0)
    has_cells = ordinary_starts[block] != ordinary_starts[block + 1]
    if has_cells or special_starts[block] != special_starts[block + 1]:
        count = count_bits(quad_edges(grid, bits, before_line(grid) + block * LANES))
    counts_out[block] = wp.int64(count)


@wp.func_native(native(__file__, "word_at"))
def word_at(line: wp.array(dtype=Words), at: wp.int32) -> wp.uint32:
    """Return word `at` of a line."""
    ...


@wp.func
def vertex_at(
    bits: CellBits,
    special: SpecialCells,
    ordinary_count: wp.int32,
    ahead: wp.int32,
    n: wp.int32,
    b: wp.int32,
    edge: wp.int32,
) -> wp.int32:
    """Return the vertex of an active cell, bit b of word n, whose polygon crosses its local edge `edge`.

    `ahead` are the words before the line.
    """
    ordinary = word_at(bits.ordinary_line, ahead + n)
    v = wp.int32(0)
    if has_bit(ordinary, b):
        v = bits.rank[n] + wp.int32(wp.bit_count(ordinary & low_bits(b)))
    else:
        before = low_bits(b) & word_at(bits.active_line, ahead + n) & ~ordinary
        s = bits.special_rank[n] + wp.int32(wp.bit_count(before))
        v = ordinary_count + wp.int32(special.first_vertex[s]) + owner_of(special.vertices[s], edge)
    return v


@wp.func
def oriented(quad: wp.vec4i, forward: wp.bool) -> wp.vec4i:
    """Return a quad with its normal along the axis (forward) or against it."""
    return wp.vec4i(
        quad[0], wp.where(forward, quad[1], quad[3]), quad[2], wp.where(forward, quad[3], quad[1])
    )


@wp.func
def connect_with_care(
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    ordinary_count: wp.int32,
    n: wp.int32,
    edges: wp.vec3ui,
    plain: wp.uint32,
    forward: wp.uint32,
    q: wp.int32,
    quads_out: wp.array(dtype=wp.vec4i),
) -> None:
    """Write the quads round those edges of word n that may have special cells beside them.

    `edges` are all of the word's, by axis; q is the number of the first one's quad. One loop for all corners,
    so that the structs are not copied for each.
    """
    ahead = before_line(grid)
    first = q
    for axis in range(3):
        of_axis = edges[axis]
        remaining = of_axis & ~plain
        while remaining != wp.uint32(0):
            b = bit_index(remaining)
            remaining &= remaining - wp.uint32(1)
            quad = wp.vec4i()
            for c in range(4):
                edge = QUAD_EDGES[4 * axis + c]
                corner = EDGE_LOW[edge]
                i = b - (corner & 1)  # -1: the last cell of the word before
                word = n - grid.words * ((corner >> 1) & 1) - grid.layer * (corner >> 2) + (i >> 5)
                quad[c] = vertex_at(bits, special, ordinary_count, ahead, word, i & 31, edge)
            slot = first + wp.int32(wp.bit_count(of_axis & low_bits(b)))
            quads_out[slot] = oriented(quad, has_bit(forward, b))
        first += wp.int32(wp.bit_count(of_axis))


@wp.kernel
def connect_quads_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    ordinary_count: wp.int32,
    is_reversed: wp.int32,
    starts: wp.array(dtype=wp.int64),
    # Out:
    quads_out: wp.array(dtype=wp.vec4i),
) -> None:
    """Connect the vertices round each edge with a quad. One thread per block of words."""
    block = first + wp.tid()
    q = wp.int32(starts[block])
    if q == wp.int32(starts[block + 1]):
        return
    n = block * LANES
    at = before_line(grid) + n
    edges = quad_edges(grid, bits, at)
    plain = surely_ordinary(grid, bits, at)
    forward = bits.inside_line[at]  # the normal away from the inside is along the axis
    reversal = wp.where(is_reversed == 1, ALL_BITS, wp.uint32(0))
    for lane in range(LANES):
        forward[lane] ^= reversal
    store_plain_quads(
        edges, forward, bits.ordinary_line, bits.rank, at, n, grid.words, grid.layer, q, quads_out
    )
    for lane in range(LANES):
        words = wp.vec3ui(edges[lane], edges[LANES + lane], edges[2 * LANES + lane])
        some = words[0] | words[1] | words[2]
        if (some & ~plain[lane]) != wp.uint32(0):
            connect_with_care(
                grid,
                bits,
                special,
                ordinary_count,
                n + lane,
                words,
                plain[lane],
                forward[lane],
                q,
                quads_out,
            )
        q += wp.int32(wp.bit_count(words[0]) + wp.bit_count(words[1]) + wp.bit_count(words[2]))
