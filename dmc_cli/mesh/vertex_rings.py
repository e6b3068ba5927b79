"""What the grid knows of each vertex: an outgoing halfedge, and how many mesh edges meet there.

The quads of a vertex go round the grid edges of its cell that its polygon crosses. All edges of an ordinary
cell's polygon have quads, so its valence is the number of its crossed edges, and any of its halfedges will
do: the first of fixed candidates is taken. A special cell lists its vertices' edges; a vertex on a boundary
takes the outgoing halfedge without a twin (the first by edge, should there be several fans), so that
twin-of-previous walks the whole fan, and has one mesh edge more for each fan.
"""

from typing import Any

import warp as wp

from dmc_cli.device import Device
from dmc_cli.mesh.grid_twins import is_inside, one_step
from dmc_cli.mesh.quad_ranks import QuadWord, quad_in, quad_round, word_after
from dmc_cli.surface import Surface
from dmc_cli.surface.cells import CellBits
from dmc_cli.surface.grid import ALL_BITS, Grid, bit_index, has_bit, next_node
from dmc_cli.surface.special_cells import SpecialCells
from dmc_cli.surface.tracing import EDGE_HIGH, EDGE_LOW, NO_LABEL, label_of

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def find_vertex_rings(surface: Surface, words: Any, twin: Any, device: Device) -> tuple[Any, Any]:
    """Return an outgoing halfedge, int32 (V,), and the valence, int32 (V,), of each vertex.

    Args:
        surface: The surface as it was extracted.
        words: As `rank_quads` returns them.
        twin: Twin of each halfedge, int32 (4Q,).
        device: Where to work.
    """
    count = surface.vertices.shape[0]
    halfedge, valence = device.empty(count, wp.int32), device.empty(count, wp.int32)
    grid, cells, polygons = surface.grid.struct(), surface.cells, surface.polygons
    is_reversed = int(surface.is_reversed)
    inputs = [grid, cells.bits, is_reversed, words]
    device.launch(ring_ordinary_kernel, surface.grid.rows, inputs, [halfedge, valence])
    inputs = [grid, cells.bits, polygons.special, cells.ordinary_count, is_reversed, words, twin]
    device.launch(ring_special_kernel, polygons.special_count, inputs, [halfedge, valence])
    return halfedge, valence


@wp.func
def corner_halfedge(q: wp.int32, corner: wp.int32, forward: wp.bool) -> wp.int32:
    """Return the halfedge from a corner of a quad, the corner numbered as if the quad were not reversed."""
    return 4 * q + wp.where(forward, corner, (4 - corner) & 3)


@wp.struct
class FullSum:
    """A digit of a sum of bits, for 32 sums at a time, and what is carried to the next digit."""

    digit: wp.uint32
    carry: wp.uint32


@wp.func
def add_bits(a: wp.uint32, b: wp.uint32, c: wp.uint32) -> FullSum:
    """Add three bits, 32 times."""
    result = FullSum()
    result.digit = a ^ b ^ c
    result.carry = (a & b) | (c & (a ^ b))
    return result


@wp.struct
class EdgeCounts:
    """The number of crossed edges of each of 32 cells: its binary digits, a word each."""

    ones: wp.uint32
    twos: wp.uint32
    fours: wp.uint32
    eights: wp.uint32


@wp.func
def count_edges(
    here: QuadWord,
    here_after: QuadWord,
    y: QuadWord,
    y_after: QuadWord,
    z: QuadWord,
    z_after: QuadWord,
    yz: QuadWord,
) -> EdgeCounts:
    """Count the edges with quads of 32 cells from the words of their rows; y, z: the rows one step along."""
    a = add_bits(here[0], y[0], z[0])
    b = add_bits(yz[0], here[1], z[1])
    c = add_bits(next_node(here[1], here_after[1]), next_node(z[1], z_after[1]), here[2])
    d = add_bits(y[2], next_node(here[2], here_after[2]), next_node(y[2], y_after[2]))
    ones = add_bits(a.digit, b.digit, c.digit)
    last_one = add_bits(ones.digit, d.digit, wp.uint32(0))
    e = add_bits(a.carry, b.carry, c.carry)
    f = add_bits(d.carry, ones.carry, last_one.carry)
    twos = add_bits(e.digit, f.digit, wp.uint32(0))
    fours = add_bits(e.carry, f.carry, twos.carry)
    counts = EdgeCounts()
    counts.ones = last_one.digit
    counts.twos = twos.digit
    counts.fours = fours.digit
    counts.eights = fours.carry
    return counts


@wp.func
def digit_at(word: wp.uint32, b: wp.int32) -> wp.int32:
    """Return bit b of a word as a number."""
    return wp.int32((word >> wp.uint32(b)) & wp.uint32(1))


@wp.func
def some_halfedge(
    here: QuadWord,
    y: QuadWord,
    z: QuadWord,
    yz: QuadWord,
    inside: wp.uint32,
    inside_y: wp.uint32,
    inside_z: wp.uint32,
    inside_yz: wp.uint32,
    b: wp.int32,
) -> wp.int32:
    """Return a halfedge from the vertex of ordinary cell b of a word.

    If none of its x edges is crossed, its low and its high face across x are alike: then one of the low
    face's edges is crossed. `inside` words are those of the rows, turned where quads are reversed.
    """
    h = int(0)
    if has_bit(here[0], b):
        h = corner_halfedge(quad_in(here, 0, b), 2, has_bit(inside, b))
    elif has_bit(y[0], b):
        h = corner_halfedge(quad_in(y, 0, b), 3, has_bit(inside_y, b))
    elif has_bit(z[0], b):
        h = corner_halfedge(quad_in(z, 0, b), 1, has_bit(inside_z, b))
    elif has_bit(yz[0], b):
        h = corner_halfedge(quad_in(yz, 0, b), 0, has_bit(inside_yz, b))
    elif has_bit(here[1], b):
        h = corner_halfedge(quad_in(here, 1, b), 2, has_bit(inside, b))
    elif has_bit(z[1], b):
        h = corner_halfedge(quad_in(z, 1, b), 3, has_bit(inside_z, b))
    elif has_bit(here[2], b):
        h = corner_halfedge(quad_in(here, 2, b), 2, has_bit(inside, b))
    else:
        h = corner_halfedge(quad_in(y, 2, b), 1, has_bit(inside_y, b))
    return h


@wp.kernel
def ring_ordinary_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    is_reversed: wp.int32,
    words: wp.array2d(dtype=QuadWord),
    # Out:
    halfedge_out: wp.array(dtype=wp.int32),
    valence_out: wp.array(dtype=wp.int32),
):
    """Find a halfedge and the valence of the ordinary cells' vertices. One thread a row."""
    row = first + wp.tid()
    turn = wp.where(is_reversed == 1, ALL_BITS, wp.uint32(0))
    for w in range(grid.words):
        left = bits.ordinary[row, w]
        if left != wp.uint32(0):
            v = bits.rank[row * grid.words + w]
            y = row + 1
            z = row + grid.ny
            here = words[row, w]
            word_y = words[y, w]
            word_z = words[z, w]
            word_yz = words[z + 1, w]
            counts = count_edges(
                here,
                word_after(words, row, w),
                word_y,
                word_after(words, y, w),
                word_z,
                word_after(words, z, w),
                word_yz,
            )
            inside = bits.inside[row, w] ^ turn
            inside_y = bits.inside[y, w] ^ turn
            inside_z = bits.inside[z, w] ^ turn
            inside_yz = bits.inside[z + 1, w] ^ turn
            while left != wp.uint32(0):
                b = bit_index(left)
                left &= left - wp.uint32(1)
                count = digit_at(counts.ones, b) + 2 * digit_at(counts.twos, b)
                count += 4 * digit_at(counts.fours, b) + 8 * digit_at(counts.eights, b)
                valence_out[v] = count
                halfedge_out[v] = some_halfedge(
                    here, word_y, word_z, word_yz, inside, inside_y, inside_z, inside_yz, b
                )
                v += 1


@wp.func
def halfedge_from_cell(
    grid: Grid,
    bits: CellBits,
    words: wp.array2d(dtype=QuadWord),
    is_reversed: wp.int32,
    cell: wp.vec3i,
    edge: wp.int32,
) -> wp.int32:
    """Return the halfedge that leaves a cell's vertex in the quad round one of its edges."""
    low = EDGE_LOW[edge]
    across = EDGE_HIGH[edge] - low
    axis = wp.where(across == 1, 0, wp.where(across == 2, 1, 2))
    step = wp.vec3i(low & 1, (low >> 1) & 1, low >> 2)
    node = cell + step
    along_b = wp.dot(step, one_step((axis + 1) % 3))
    along_c = wp.dot(step, one_step((axis + 2) % 3))
    # corners of a quad: low low, high low, high high, low high, by the cell's place from the edge
    corner = wp.where(along_c == 1, wp.where(along_b == 1, 0, 1), wp.where(along_b == 1, 3, 2))
    q = quad_round(words, node[1] + grid.ny * node[2], node[0], axis)
    return corner_halfedge(q, corner, is_inside(bits, grid, node) == (is_reversed == 0))


@wp.kernel
def ring_special_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    ordinary_count: wp.int32,
    is_reversed: wp.int32,
    words: wp.array2d(dtype=QuadWord),
    twin: wp.array(dtype=wp.int32),
    # Out:
    halfedge_out: wp.array(dtype=wp.int32),
    valence_out: wp.array(dtype=wp.int32),
):
    """Find a halfedge and the valence of the special cells' vertices. One thread a special cell."""
    s = first + wp.tid()
    row = special.row[s]
    cell = wp.vec3i(special.i[s], row % grid.ny, row // grid.ny)
    start = ordinary_count + wp.int32(special.first_vertex[s])
    count = wp.int32(special.first_vertex[s + 1] - special.first_vertex[s])
    for n in range(count):
        valence = int(0)
        leaving = int(-1)
        for edge in range(12):
            if label_of(special.vertices[s], edge) == n and n != NO_LABEL:
                h = halfedge_from_cell(grid, bits, words, is_reversed, cell, edge)
                valence += 1
                entering = (h & ~3) | ((h + 3) & 3)
                if twin[entering] < 0:
                    valence += 1
                if leaving < 0:
                    leaving = h
                elif twin[h] < 0 and twin[leaving] >= 0:
                    leaving = h
        halfedge_out[start + n] = leaving
        valence_out[start + n] = valence
