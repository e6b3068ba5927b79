"""Find the vertices on the edges of a cell: ranks, from where its row begins and the words before its own."""

import warp as wp

from dmc_cli.bits import Words
from dmc_cli.contouring.stages.edge_ranks import EdgeBits
from dmc_cli.field import Grid, before_line
from dmc_cli.runtime import native

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

EdgeVertices12 = wp.types.vector(length=12, dtype=wp.int32)
"""The vertex on each edge of a cell; of those that are not crossed it means nothing."""


@wp.func_native(native(__file__, "vertices_of_cell"))
def vertices_of_cell(
    inside: wp.array(dtype=Words),
    exists: wp.array(dtype=Words),
    is_marked: wp.int32,
    nodes: wp.vec3i,
    words: wp.int32,
    ahead: wp.int32,
    row: wp.int32,
    i: wp.int32,
    starts: wp.array(dtype=wp.int64),
    along_x: wp.array(dtype=wp.int32),
    along_y: wp.array(dtype=wp.int32),
) -> EdgeVertices12:
    """Return the vertices of the cell at node i of a row; `ahead` words lie before the lines."""
    ...


@wp.func
def edge_vertices_of(grid: Grid, bits: EdgeBits, row: wp.int32, i: wp.int32) -> EdgeVertices12:
    """Return the vertices on the edges of the cell at node i of a row."""
    return vertices_of_cell(
        bits.inside,
        bits.exists,
        bits.is_marked,
        wp.vec3i(grid.nx, grid.ny, grid.nz),
        grid.words,
        before_line(grid),
        row,
        i,
        bits.starts,
        bits.along_x,
        bits.along_y,
    )
