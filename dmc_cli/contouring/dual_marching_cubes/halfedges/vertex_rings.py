"""Find an outgoing halfedge and the valence of each vertex, from the grid.

The quads of a vertex go round the grid edges of its cell that its polygon crosses. All edges of an ordinary
cell's polygon have quads, so its valence is the number of its crossed edges, and any of its halfedges will
do: the first of fixed candidates is taken (`plain_rings.py`). A special cell lists its vertices' edges; a
vertex on a boundary takes the outgoing halfedge without a twin (the first by edge, should there be several
fans), so that twin-of-previous walks the whole fan, and has one mesh edge more for each fan.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import ALL_BITS, LANES, VECTOR_FLAGS, bit_index
from dmc_cli.contouring.dual_marching_cubes.halfedges.plain_rings import store_plain_rings
from dmc_cli.contouring.dual_marching_cubes.special_cells import SpecialCells
from dmc_cli.contouring.stages.cell_words import CellBits
from dmc_cli.contouring.stages.face_twins import is_inside, one_step
from dmc_cli.contouring.stages.quad_ranks import QuadWord, quad_round
from dmc_cli.contouring.stages.tracing import EDGE_HIGH, EDGE_LOW, edges_owned
from dmc_cli.contouring.surface import Surface
from dmc_cli.field import BLOCKS_A_CHUNK, Grid, before_line, block_count, row_place
from dmc_cli.mesh import previous_in_quad

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


def find_vertex_rings(surface: Surface, twin: Any) -> tuple[Any, Any]:
    """Return an outgoing halfedge, int32 (V,), and the valence, int32 (V,), of each vertex.

    Args:
        surface: The surface as it was extracted, with the quads' ranks.
        twin: Twin of each halfedge, int32 (4Q,).
    """
    device, count = surface.mesh.device, surface.mesh.vertex_count
    halfedge, valence = device.empty(count, wp.int32), device.empty(count, wp.int32)
    shape, numbering = surface.placement.frame.grid, surface.numbering
    grid, cells, polygons = shape.struct(), numbering.cells, numbering.polygons
    words, is_reversed = numbering.quad_words, int(numbering.is_reversed)
    inputs = [grid, cells.bits, cells.ordinary_starts, is_reversed, words]
    blocks = block_count(shape)
    device.launch(ring_ordinary_kernel, blocks, inputs, [halfedge, valence], BLOCKS_A_CHUNK)
    inputs = [grid, cells.bits, polygons.special, cells.ordinary_count, is_reversed, words, twin]
    device.launch(ring_special_kernel, polygons.special_count, inputs, [halfedge, valence])
    return halfedge, valence


@wp.func
def corner_halfedge(q: wp.int32, corner: wp.int32, forward: wp.bool) -> wp.int32:
    """Return the halfedge from a corner of a quad, the corner numbered as if the quad were not reversed."""
    return 4 * q + wp.where(forward, corner, (4 - corner) & 3)


@wp.kernel
def ring_ordinary_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    starts: wp.array(dtype=wp.int64),
    is_reversed: wp.int32,
    words: wp.array2d(dtype=QuadWord),
    # Out:
    halfedge_out: wp.array(dtype=wp.int32),
    valence_out: wp.array(dtype=wp.int32),
) -> None:
    """Find a halfedge and the valence of the ordinary cells' vertices. One thread a block of words."""
    block = first + wp.tid()
    if starts[block] == starts[block + 1]:
        return
    reversal = wp.where(is_reversed == 1, ALL_BITS, wp.uint32(0))
    at = before_line(grid) + block * LANES
    ordinary = bits.ordinary_line[at]
    inside = bits.inside_line[at]
    inside_y = bits.inside_line[at + grid.words]
    inside_z = bits.inside_line[at + grid.layer]
    inside_yz = bits.inside_line[at + grid.layer + grid.words]
    v = wp.int32(starts[block])
    for lane in range(LANES):
        if ordinary[lane] != wp.uint32(0):
            store_plain_rings(
                words,
                block * LANES + lane,
                grid.words,
                grid.layer,
                ordinary[lane],
                v,
                inside[lane] ^ reversal,
                inside_y[lane] ^ reversal,
                inside_z[lane] ^ reversal,
                inside_yz[lane] ^ reversal,
                halfedge_out,
                valence_out,
            )
            v += wp.int32(wp.bit_count(ordinary[lane]))


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
) -> None:
    """Find a halfedge and the valence of the special cells' vertices. One thread a special cell."""
    s = first + wp.tid()
    place = row_place(grid, special.row[s])
    cell = wp.vec3i(special.i[s], place[0], place[1])
    start = ordinary_count + wp.int32(special.first_vertex[s])
    count = wp.int32(special.first_vertex[s + 1] - special.first_vertex[s])
    for n in range(count):
        valence = int(0)
        leaving = int(-1)
        remaining = edges_owned(special.vertices[s], n)
        while remaining != wp.uint32(0):
            h = halfedge_from_cell(grid, bits, words, is_reversed, cell, bit_index(remaining))
            remaining &= remaining - wp.uint32(1)
            valence += 1
            if twin[previous_in_quad(h)] < 0:
                valence += 1
            if leaving < 0:
                leaving = h
            elif twin[h] < 0 and twin[leaving] >= 0:
                leaving = h
        halfedge_out[start + n] = leaving
        valence_out[start + n] = valence
