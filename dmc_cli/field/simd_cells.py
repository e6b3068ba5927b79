"""Load sixteen cells and points into lanes and store them again, on CPU.

Loops over lanes have no branch, so that the compiler turns them into vector instructions. What needs one is
done by the callers afterwards, lane by lane.
"""

import warp as wp

from dmc_cli.bits import LANES
from dmc_cli.field.grid import Grid
from dmc_cli.field.sample_reader import DoubleLanes, IntLanes
from dmc_cli.runtime import native

FloatLanes = wp.types.vector(length=LANES, dtype=wp.float32)

PointLanes = wp.types.vector(length=3 * LANES, dtype=wp.float32)
"""Sixteen points: their x, then their y, then their z."""

FARTHEST = wp.constant(wp.float64(2**30))
"""Nodes between the first cell of a block and the others at most, so that offsets fit into 32 bits."""


@wp.struct
class BlockCells:
    """The cells of a block of vertices.

    `i`, `j`, `k` are their indices in the grid; their lowest nodes are `offsets` after `node` of the volume.
    A cell at the virtual border has the node of the nearest cell of the volume; one that is `far` (1) from
    the first cell has the node of the first.
    """

    i: IntLanes
    j: IntLanes
    k: IntLanes
    node: wp.int64
    offsets: IntLanes
    far: IntLanes


@wp.func_native(native(__file__, "load_cells"))
def load_cells(cells: wp.array(dtype=wp.int64), start: wp.int32, size: wp.int32) -> DoubleLanes:
    """Return the numbers of `size` cells from `start` on, the last one again for the lanes that remain."""
    ...


@wp.func_native(native(__file__, "store_points"))
def store_points(
    x: FloatLanes, y: FloatLanes, z: FloatLanes, start: wp.int32, size: wp.int32, out: wp.array(dtype=wp.vec3)
) -> None:
    """Store the first `size` of sixteen points from `start` on."""
    ...


@wp.func
def whole_part(a: wp.float64, inverse: wp.float64) -> wp.int32:
    """Return a divided by an integer, given as its inverse; exact for a below 2^50."""
    return wp.int32((a + wp.float64(0.5)) * inverse)


@wp.func
def find_block_cells(
    grid: Grid, cells: wp.array(dtype=wp.int64), start: wp.int32, size: wp.int32
) -> BlockCells:
    """Return the cells of the `size` vertices from `start` on; lanes that remain have the last one's.

    What `cell_node` does of one cell is here once more on purpose: divisions of integers have no vectors.
    """
    found = BlockCells()
    b = grid.border
    nx = grid.nx - 2 * b
    ny = grid.ny - 2 * b
    nz = grid.nz - 2 * b
    a_row = wp.float64(grid.nx)
    inverse_row = wp.float64(1.0) / a_row
    inverse_layer = wp.float64(1.0) / wp.float64(grid.ny)
    ci = IntLanes()
    cj = IntLanes()
    ck = IntLanes()
    numbers = load_cells(cells, start, size)
    nodes = load_cells(cells, start, size)  # with an open border a cell has the number of its lowest node
    for lane in range(LANES):
        row = whole_part(numbers[lane], inverse_row)
        k = whole_part(wp.float64(row), inverse_layer)
        ci[lane] = wp.int32(numbers[lane] - wp.float64(row) * a_row)
        cj[lane] = row - k * grid.ny
        ck[lane] = k
    if b == 1:
        for lane in range(LANES):
            layers = wp.float64(wp.clamp(ck[lane] - b, 0, nz - 2))
            rows = layers * wp.float64(ny) + wp.float64(wp.clamp(cj[lane] - b, 0, ny - 2))
            nodes[lane] = rows * wp.float64(nx) + wp.float64(wp.clamp(ci[lane] - b, 0, nx - 2))
    offsets = IntLanes()
    far = IntLanes()
    node = nodes[0]
    for lane in range(LANES):
        distance = nodes[lane] - node
        is_far = wp.abs(distance) > FARTHEST
        far[lane] = wp.where(is_far, 1, 0)
        offsets[lane] = wp.int32(wp.where(is_far, wp.float64(0.0), distance))
    found.i = ci
    found.j = cj
    found.k = ck
    found.node = wp.int64(node)
    found.offsets = offsets
    found.far = far
    return found


@wp.func_native(native(__file__, "load_points"))
def load_points(points: wp.array(dtype=wp.vec3), start: wp.int32, size: wp.int32) -> PointLanes:
    """Return `size` points from `start` on, the last one again for the lanes that remain."""
    ...
