"""Find the triangles that have vertices of some rows of nodes: those of the cells round them."""

import warp as wp

from dmc_cli.field import Grid

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def rows_of_cells(grid: Grid, start: wp.int32, end: wp.int32, part: wp.int32) -> wp.vec2i:
    """Return the rows of cells with vertices on the edges from rows `start` to `end` - 1, from and to.

    Part 0 are those of the layers before, as far as part 1 does not have them. A row of cells at the end of a
    layer has no triangles, so that rows of the layer after it do no harm.
    """
    low = wp.where(part == 0, start - grid.ny - 1, start - 1)
    high = wp.where(part == 0, wp.min(end - grid.ny, start - 1), end)
    return wp.vec2i(wp.max(low, 0), wp.max(high, 0))
