"""Look up special cells in their list, which is in grid order: by place in the grid, and by vertex."""

import warp as wp

from dmc_cli.bits import has_bit, low_bits
from dmc_cli.contouring.stages.cell_words import CellBits
from dmc_cli.contouring.stages.tracing import NO_OWNER, owner_of
from dmc_cli.field import Grid

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


POLYGONS = wp.constant(0)
UNUSED = wp.constant(1)
MULTI = wp.constant(2)
AMBIGUOUS_FACES = wp.constant(3)
TALLIES = 4
"""How many numbers are counted of each special cell, the rows of an array: its polygons; its polygons
without a vertex; 1 if it has several polygons, else 0; its ambiguous faces. A face that two cells share is
counted once, by the lower one."""


@wp.struct
class SpecialCells:
    """The special cells in grid order, an item each in every array.

    Attributes:
        row: Row of nodes of corner 0, j + k ny.
        i: Node of corner 0 in that row.
        joined: Bit f is set if face f is ambiguous and its inside corners are joined.
        polygons: Four bits for each edge: the number of its polygon in the cell, or `NO_OWNER`.
        vertices: Four bits for each edge: the number of its vertex in the cell, or `NO_OWNER`.
        first_vertex: How many vertices the special cells before this one have.
    """

    row: wp.array(dtype=wp.int32)
    i: wp.array(dtype=wp.int32)
    joined: wp.array(dtype=wp.uint32)
    polygons: wp.array(dtype=wp.uint64)
    vertices: wp.array(dtype=wp.uint64)
    first_vertex: wp.array(dtype=wp.int64)


@wp.func
def find_special(bits: CellBits, row: wp.int32, i: wp.int32) -> wp.int32:
    """Return the place of a special cell in the list; (row, i) must be a special cell."""
    w = i // 32
    n = row * bits.active.shape[1] + w
    before = low_bits(i % 32) & bits.active[row, w] & ~bits.ordinary[row, w]
    return bits.special_rank[n] + wp.int32(wp.bit_count(before))


@wp.func
def special_cell_of(special: SpecialCells, count: wp.int32, n: wp.int64) -> wp.int32:
    """Return the place of the special cell that vertex n of all special cells belongs to, by bisection."""
    low = int(0)
    high = count
    while high - low > 1:
        middle = low + (high - low) // 2
        if special.first_vertex[middle] <= n:
            low = middle
        else:
            high = middle
    return low


@wp.func
def polygon_of_vertex(special: SpecialCells, s: wp.int64, n: wp.int32) -> wp.uint32:
    """Return the edges, a bit each, of the polygon that vertex n of special cell s stands for."""
    polygon = int(NO_OWNER)
    for edge in range(12):
        if owner_of(special.vertices[s], edge) == n:
            polygon = owner_of(special.polygons[s], edge)
    edges = wp.uint32(0)
    for edge in range(12):
        if owner_of(special.polygons[s], edge) == polygon:
            edges |= wp.uint32(1) << wp.uint32(edge)
    return edges


@wp.func
def is_active(grid: Grid, bits: CellBits, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.bool:
    """Return whether (i, j, k) is an active cell; indices may be off the grid."""
    found = bool(False)
    if i >= 0 and j >= 0 and k >= 0 and i < grid.nx - 1 and j < grid.ny - 1 and k < grid.nz - 1:
        found = has_bit(bits.active[j + k * grid.ny, i // 32], i % 32)
    return found
