"""Connect quads: one round each crossed grid edge whose four cells exist, between the vertices of these.

The order is that of dual marching cubes: word by word of 32 nodes in grid order, in a word the edges along x,
then y, then z, each by their lower node. A cell's vertex is the rank of its bit, so all quads are plain ones.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import ALL_BITS, LANES, VECTOR_FLAGS
from dmc_cli.contouring.dual_grid.active_cells import ActiveCells
from dmc_cli.contouring.stages.cell_words import CellBits
from dmc_cli.contouring.stages.plain_quads import quad_edges, store_plain_quads
from dmc_cli.field import BLOCKS_A_CHUNK, Grid, GridShape, before_line, block_count
from dmc_cli.runtime import Device

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


def connect_cells(cells: ActiveCells, grid: GridShape, is_reversed: bool, device: Device) -> Any:
    """Begin to connect the quads, int32 vec4 (Q,); they are there for the next launch.

    Args:
        cells: Active cells, numbered.
        grid: The grid over the volume.
        is_reversed: Make normals point towards the inside nodes instead of away from them.
        device: Where to work.
    """
    quads = device.empty(cells.quad_count, wp.vec4i)
    inputs = [grid.struct(), cells.bits, int(is_reversed), cells.quad_starts]
    device.begin(connect_cells_kernel, block_count(grid), inputs, [quads], BLOCKS_A_CHUNK)
    return quads


@wp.kernel
def connect_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
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
    forward = bits.inside_line[at]  # the normal away from the inside is along the axis
    reversal = wp.where(is_reversed == 1, ALL_BITS, wp.uint32(0))
    for lane in range(LANES):
        forward[lane] ^= reversal
    store_plain_quads(
        edges, forward, bits.active_line, bits.rank, at, n, grid.words, grid.layer, q, quads_out
    )
