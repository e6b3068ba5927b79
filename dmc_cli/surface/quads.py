"""Quads: one round each crossed grid edge whose four cells exist.

Order: by the edge's lower node in grid order, at a node by axis x, y, z. The quad round an edge goes
through its four cells counter-clockwise about the edge's axis, beginning with the lowest cell, so that its
normal points along the axis; it is reversed where the surface's normal points the other way (Grosso & Zint
2021, section 3.1.3, with the misprints of table 1 put right).
"""

from typing import Any

import warp as wp

from dmc_cli.device import Device
from dmc_cli.surface.cells import CellBits, Cells, load_word
from dmc_cli.surface.grid import Grid, GridShape, bit_index, has_bit, low_bits, next_node, previous_node
from dmc_cli.surface.polygons import Polygons, SpecialCells, find_special, label_of

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class QuadEdges:
    """The nodes of a word from which an edge along x, y or z goes up that carries a quad: a bit each."""

    x: wp.uint32
    y: wp.uint32
    z: wp.uint32


def connect_quads(cells: Cells, polygons: Polygons, grid: GridShape, reversed_: bool, device: Device) -> Any:
    """Return the quads, int32 vec4 array of vertex numbers.

    Args:
        cells: Active cells, with the ordinary ones' numbers.
        polygons: The special cells' vertices.
        grid: The grid over the volume.
        reversed_: Make normals point towards the inside nodes instead of away from them.
        device: Where to work.
    """
    struct = grid.struct()
    counts = device.empty(grid.rows, wp.int64)
    device.launch(count_quads_kernel, grid.rows, [struct, cells.bits], [counts])
    starts, quad_count = device.starts(counts)
    quads = device.empty(quad_count, wp.vec4i)
    inputs = [struct, cells.bits, polygons.special, cells.ordinary_count, int(reversed_), starts]
    device.launch(connect_quads_kernel, grid.rows, inputs, [quads])
    return quads


@wp.func
def quad_edges(grid: Grid, bits: CellBits, row: wp.int32, j: wp.int32, k: wp.int32, w: wp.int32) -> QuadEdges:
    """Find the edges with a quad from the nodes of a word: crossed, and their four cells active.

    A cell at a crossed edge is active if it exists. Each of the edges has the cell at its lower node.
    """
    edges = QuadEdges()
    here = bits.active[row, w]
    if here != wp.uint32(0):
        inside = bits.inside[row, w]
        before_here = here_shifted(bits.active, row, w)
        if j > 0:
            below = bits.active[row - 1, w]
            if k > 0:
                front = bits.active[row - grid.ny, w]
                both = bits.active[row - grid.ny - 1, w]
                crossed = inside ^ next_node(inside, load_word(bits.inside, row, w + 1, grid.words))
                edges.x = crossed & here & below & front & both
            crossed = inside ^ bits.inside[row + grid.ny, w]
            edges.z = crossed & here & before_here & below & here_shifted(bits.active, row - 1, w)
        if k > 0:
            front = bits.active[row - grid.ny, w]
            crossed = inside ^ bits.inside[row + 1, w]
            edges.y = crossed & here & before_here & front & here_shifted(bits.active, row - grid.ny, w)
    return edges


@wp.func
def here_shifted(active: wp.array2d(dtype=wp.uint32), row: wp.int32, w: wp.int32) -> wp.uint32:
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
    bits: CellBits, special: SpecialCells, ordinary_count: wp.int32, row: wp.int32, i: wp.int32, edge: wp.int32
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
def oriented(a: wp.int32, b: wp.int32, c: wp.int32, d: wp.int32, forward: wp.bool) -> wp.vec4i:
    """Return a quad with its normal along the axis (forward) or against it."""
    quad = wp.vec4i(a, b, c, d)
    if not forward:
        quad = wp.vec4i(a, d, c, b)
    return quad


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
    """Connect the vertices round each edge with a quad. One thread a row of nodes."""
    row = first + wp.tid()
    if starts[row] < starts[row + 1]:
        j = row % grid.ny
        k = row // grid.ny
        q = starts[row]
        for w in range(grid.words):
            edges = quad_edges(grid, bits, row, j, k, w)
            inside = bits.inside[row, w]
            left = edges.x | edges.y | edges.z
            while left != wp.uint32(0):
                b = bit_index(left)
                left &= left - wp.uint32(1)
                i = 32 * w + b
                # an inside lower node: the normal away from the inside is along the axis
                forward = has_bit(inside, b) != (is_reversed == 1)
                if has_bit(edges.x, b):
                    quads_out[q] = oriented(
                        vertex_at(bits, special, ordinary_count, row - grid.ny - 1, i, 6),
                        vertex_at(bits, special, ordinary_count, row - grid.ny, i, 4),
                        vertex_at(bits, special, ordinary_count, row, i, 0),
                        vertex_at(bits, special, ordinary_count, row - 1, i, 2),
                        forward,
                    )
                    q += wp.int64(1)
                if has_bit(edges.y, b):
                    quads_out[q] = oriented(
                        vertex_at(bits, special, ordinary_count, row - grid.ny, i - 1, 5),
                        vertex_at(bits, special, ordinary_count, row, i - 1, 1),
                        vertex_at(bits, special, ordinary_count, row, i, 3),
                        vertex_at(bits, special, ordinary_count, row - grid.ny, i, 7),
                        forward,
                    )
                    q += wp.int64(1)
                if has_bit(edges.z, b):
                    quads_out[q] = oriented(
                        vertex_at(bits, special, ordinary_count, row - 1, i - 1, 10),
                        vertex_at(bits, special, ordinary_count, row - 1, i, 11),
                        vertex_at(bits, special, ordinary_count, row, i, 8),
                        vertex_at(bits, special, ordinary_count, row, i - 1, 9),
                        forward,
                    )
                    q += wp.int64(1)
