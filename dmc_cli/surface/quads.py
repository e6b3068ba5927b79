"""Quads: one round each crossed grid edge whose four cells exist.

Order: word by word of 32 nodes in grid order; in a word first the edges along x, then y, then z, each by
their lower node. So a quad's number is a rank, as a vertex's is. The quad round an edge goes
through its four cells counter-clockwise about the edge's axis, beginning with the lowest cell, so that its
normal points along the axis; it is reversed where the surface's normal points the other way (Grosso & Zint
2021, section 3.1.3, with the misprints of table 1 put right).
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.device import Device
from dmc_cli.surface.cells import CellBits, Cells, load_word
from dmc_cli.surface.grid import Grid, GridShape, bit_index, has_bit, low_bits, next_node, previous_node
from dmc_cli.surface.polygons import Polygons
from dmc_cli.surface.special_cells import SpecialCells, find_special
from dmc_cli.surface.tracing import label_of

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class QuadEdges:
    """The nodes of a word from which an edge along x, y or z goes up that carries a quad: a bit each."""

    x: wp.uint32
    y: wp.uint32
    z: wp.uint32


@dataclass(frozen=True)
class Quads:
    """Quads in the order of their numbers.

    Attributes:
        corners: int32 vec4 (Q,), vertex numbers.
        starts: Quads before each row of nodes, int64, one item more than rows.
    """

    corners: Any
    starts: Any


def connect_quads(
    cells: Cells, polygons: Polygons, grid: GridShape, is_reversed: bool, device: Device
) -> Quads:
    """Return the quads.

    Args:
        cells: Active cells, with the ordinary ones' numbers.
        polygons: The special cells' vertices.
        grid: The grid over the volume.
        is_reversed: Make normals point towards the inside nodes instead of away from them.
        device: Where to work.
    """
    struct = grid.struct()
    counts = device.empty(grid.rows, wp.int64)
    device.launch(count_quads_kernel, grid.rows, [struct, cells.bits], [counts])
    starts, quad_count = device.starts(counts)
    quads = device.empty(quad_count, wp.vec4i)
    inputs = [struct, cells.bits, polygons.special, cells.ordinary_count, int(is_reversed), starts]
    device.launch(connect_quads_kernel, grid.rows, inputs, [quads])
    return Quads(quads, starts)


@wp.func
def quad_edges(grid: Grid, bits: CellBits, row: wp.int32, j: wp.int32, k: wp.int32, w: wp.int32) -> QuadEdges:
    """Find the edges with a quad from the nodes of a word: crossed, and their four cells active.

    A cell at a crossed edge is active if it exists. Each of the edges has the cell at its lower node.
    """
    edges = QuadEdges()
    here = bits.active[row, w]
    if here != wp.uint32(0):
        inside = bits.inside[row, w]
        before_here = active_before(bits.active, row, w)
        if j > 0:
            below = bits.active[row - 1, w]
            if k > 0:
                front = bits.active[row - grid.ny, w]
                both = bits.active[row - grid.ny - 1, w]
                crossed = inside ^ next_node(inside, load_word(bits.inside, row, w + 1, grid.words))
                edges.x = crossed & here & below & front & both
            crossed = inside ^ bits.inside[row + grid.ny, w]
            edges.z = crossed & here & before_here & below & active_before(bits.active, row - 1, w)
        if k > 0:
            front = bits.active[row - grid.ny, w]
            crossed = inside ^ bits.inside[row + 1, w]
            edges.y = crossed & here & before_here & front & active_before(bits.active, row - grid.ny, w)
    return edges


@wp.func
def active_before(active: wp.array2d(dtype=wp.uint32), row: wp.int32, w: wp.int32) -> wp.uint32:
    """Return a bit for each cell of a word: whether the cell before it along x is active."""
    before = wp.uint32(0)
    if w > 0:
        before = active[row, w - 1]
    return previous_node(active[row, w], before)


@wp.kernel
def count_quads_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    # Out:
    counts_out: wp.array(dtype=wp.int64),
):
    """Count the quads. One thread a row of nodes."""
    row = first + wp.tid()
    j = row % grid.ny
    k = row // grid.ny
    count = wp.int32(0)
    for w in range(grid.words):
        edges = quad_edges(grid, bits, row, j, k, w)
        count += wp.int32(wp.bit_count(edges.x) + wp.bit_count(edges.y) + wp.bit_count(edges.z))
    counts_out[row] = wp.int64(count)


@wp.func
def vertex_at(
    bits: CellBits,
    special: SpecialCells,
    ordinary_count: wp.int32,
    row: wp.int32,
    i: wp.int32,
    edge: wp.int32,
) -> wp.int32:
    """Return the vertex of an active cell whose polygon crosses its local edge `edge`."""
    w = i // 32
    b = i % 32
    ordinary = bits.ordinary[row, w]
    v = wp.int32(0)
    if has_bit(ordinary, b):
        v = bits.rank[row, w] + wp.int32(wp.bit_count(ordinary & low_bits(b)))
    else:
        s = find_special(special, row, i)
        v = ordinary_count + wp.int32(special.first_vertex[s]) + label_of(special.vertices[s], edge)
    return v


@wp.func
def careful_quad_x(
    bits: CellBits, special: SpecialCells, ordinary_count: wp.int32, row: wp.int32, ny: wp.int32, i: wp.int32
) -> wp.vec4i:
    """Return the quad round the edge along x from node i of a row, whatever its cells; normal along x."""
    return wp.vec4i(
        vertex_at(bits, special, ordinary_count, row - ny - 1, i, 6),
        vertex_at(bits, special, ordinary_count, row - ny, i, 4),
        vertex_at(bits, special, ordinary_count, row, i, 0),
        vertex_at(bits, special, ordinary_count, row - 1, i, 2),
    )


@wp.func
def careful_quad_y(
    bits: CellBits, special: SpecialCells, ordinary_count: wp.int32, row: wp.int32, ny: wp.int32, i: wp.int32
) -> wp.vec4i:
    """The same along y."""
    return wp.vec4i(
        vertex_at(bits, special, ordinary_count, row - ny, i - 1, 5),
        vertex_at(bits, special, ordinary_count, row, i - 1, 1),
        vertex_at(bits, special, ordinary_count, row, i, 3),
        vertex_at(bits, special, ordinary_count, row - ny, i, 7),
    )


@wp.func
def careful_quad_z(
    bits: CellBits, special: SpecialCells, ordinary_count: wp.int32, row: wp.int32, i: wp.int32
) -> wp.vec4i:
    """The same along z."""
    return wp.vec4i(
        vertex_at(bits, special, ordinary_count, row - 1, i - 1, 10),
        vertex_at(bits, special, ordinary_count, row - 1, i, 11),
        vertex_at(bits, special, ordinary_count, row, i, 8),
        vertex_at(bits, special, ordinary_count, row, i - 1, 9),
    )


@wp.struct
class WordRank:
    """A word of ordinary cells and the number of the first of them."""

    cells: wp.uint32
    first: wp.int32


@wp.func
def word_rank(bits: CellBits, row: wp.int32, w: wp.int32) -> WordRank:
    """Return the rank of a word."""
    rank = WordRank()
    rank.cells = bits.ordinary[row, w]
    rank.first = bits.rank[row, w]
    return rank


@wp.func
def number(rank: WordRank, b: wp.int32) -> wp.int32:
    """Return the vertex of the word's cell b, if that is ordinary; b is below 32."""
    below = (wp.uint32(1) << wp.uint32(b)) - wp.uint32(1)
    return rank.first + wp.int32(wp.bit_count(rank.cells & below))


@wp.func
def oriented(quad: wp.vec4i, forward: wp.bool) -> wp.vec4i:
    """Return a quad with its normal along the axis (forward) or against it."""
    return wp.vec4i(
        quad[0], wp.where(forward, quad[1], quad[3]), quad[2], wp.where(forward, quad[3], quad[1])
    )


@wp.func
def surely_ordinary(
    grid: Grid, bits: CellBits, row: wp.int32, j: wp.int32, k: wp.int32, w: wp.int32
) -> wp.uint32:
    """Return a bit for each node of a word: whether all active cells round its edges are ordinary."""
    special = bits.active[row, w] & ~bits.ordinary[row, w]
    behind = special_before(bits, row, w)
    if j > 0:
        special |= bits.active[row - 1, w] & ~bits.ordinary[row - 1, w]
        behind |= special_before(bits, row - 1, w)
        if k > 0:
            both = row - 1 - grid.ny
            special |= bits.active[both, w] & ~bits.ordinary[both, w]
    if k > 0:
        special |= bits.active[row - grid.ny, w] & ~bits.ordinary[row - grid.ny, w]
        behind |= special_before(bits, row - grid.ny, w)
    return ~(special | behind)


@wp.func
def special_before(bits: CellBits, row: wp.int32, w: wp.int32) -> wp.uint32:
    """Return a bit for each cell of a word: whether the cell before it along x is special."""
    before = wp.uint32(0)
    if w > 0:
        before = bits.active[row, w - 1] & ~bits.ordinary[row, w - 1]
    return previous_node(bits.active[row, w] & ~bits.ordinary[row, w], before)


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
):
    """Connect the vertices round each edge with a quad. One thread a row of nodes.

    Where all cells are ordinary, the cell before another one along x has the number before its.
    """
    row = first + wp.tid()
    q = starts[row]
    if q == starts[row + 1]:
        return
    j = row % grid.ny
    k = row // grid.ny
    row_y = wp.max(row - 1, 0)
    row_z = wp.max(row - grid.ny, 0)
    row_yz = wp.max(row - grid.ny - 1, 0)
    for w in range(grid.words):
        edges = quad_edges(grid, bits, row, j, k, w)
        if (edges.x | edges.y | edges.z) != wp.uint32(0):
            forward = bits.inside[row, w]  # the normal away from the inside is along the axis
            if is_reversed == 1:
                forward = ~forward
            plain = surely_ordinary(grid, bits, row, j, k, w)
            here = word_rank(bits, row, w)
            below = word_rank(bits, row_y, w)
            front = word_rank(bits, row_z, w)
            both = word_rank(bits, row_yz, w)
            left = edges.x
            while left != wp.uint32(0):
                b = bit_index(left)
                left &= left - wp.uint32(1)
                quad = wp.vec4i(number(both, b), number(front, b), number(here, b), number(below, b))
                if not has_bit(plain, b):
                    quad = careful_quad_x(bits, special, ordinary_count, row, grid.ny, 32 * w + b)
                quads_out[q] = oriented(quad, has_bit(forward, b))
                q += wp.int64(1)
            left = edges.y
            while left != wp.uint32(0):
                b = bit_index(left)
                left &= left - wp.uint32(1)
                v = number(here, b)
                v_z = number(front, b)
                quad = wp.vec4i(v_z - 1, v - 1, v, v_z)
                if not has_bit(plain, b):
                    quad = careful_quad_y(bits, special, ordinary_count, row, grid.ny, 32 * w + b)
                quads_out[q] = oriented(quad, has_bit(forward, b))
                q += wp.int64(1)
            left = edges.z
            while left != wp.uint32(0):
                b = bit_index(left)
                left &= left - wp.uint32(1)
                v = number(here, b)
                v_y = number(below, b)
                quad = wp.vec4i(v_y - 1, v_y, v, v - 1)
                if not has_bit(plain, b):
                    quad = careful_quad_z(bits, special, ordinary_count, row, 32 * w + b)
                quads_out[q] = oriented(quad, has_bit(forward, b))
                q += wp.int64(1)
