"""Connect the triangles of polygons whose vertices have left their edges, as well as can be.

This is what `stages/cell_triangles.py` does, compiled for places of three numbers: steps from the middles of
the edges.
"""

import warp as wp

from dmc_cli.bits import VECTOR_FLAGS, Words
from dmc_cli.contouring.stages import cell_triangles
from dmc_cli.contouring.stages.cell_triangles import Tables
from dmc_cli.contouring.stages.edge_ranks import EdgeBits
from dmc_cli.field import Grid, before_line
from dmc_cli.runtime import native

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

POOR = wp.constant(0.401)
"""The least quality of triangles that are not looked at again: rounding aside, `edge_guard` asks for less."""


@wp.func_native(native(cell_triangles.__file__, "connect_rows", WIDTH=3))
def connect_moved(
    inside: wp.array(dtype=Words),
    exists: wp.array(dtype=Words),
    is_marked: wp.int32,
    nodes: wp.vec3i,
    words: wp.int32,
    ahead: wp.int32,
    start: wp.int32,
    end: wp.int32,
    edge_starts: wp.array(dtype=wp.int64),
    along_x: wp.array(dtype=wp.int32),
    along_y: wp.array(dtype=wp.int32),
    triangle_starts: wp.array(dtype=wp.int64),
    depths: wp.array(dtype=wp.float64),
    place: wp.array(dtype=wp.float32),
    frame: wp.array(dtype=wp.float32),
    polygon_count: wp.array(dtype=wp.uint8),
    first_polygon: wp.array(dtype=wp.int32),
    edges: wp.array(dtype=wp.uint32),
    sizes: wp.array(dtype=wp.uint8),
    standard: wp.array(dtype=wp.uint8),
    allowed: wp.array(dtype=wp.uint64),
    corners: wp.array(dtype=wp.uint8),
    members: wp.array(dtype=wp.uint8),
    is_best: wp.int32,
    is_reversed: wp.int32,
    least: wp.float32,
    faces_out: wp.array(dtype=wp.vec4i),
    poor_out: wp.array(dtype=wp.uint8),
) -> None:
    """Connect the triangles of rows `start` to `end` - 1; `ahead` words lie before the lines."""
    ...


@wp.kernel
def connect_moved_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: EdgeBits,
    triangle_starts: wp.array(dtype=wp.int64),
    depths: wp.array(dtype=wp.float64),
    steps: wp.array(dtype=wp.float32),
    tables: Tables,
    is_reversed: wp.int32,
    listed: wp.array(dtype=wp.int32),
    rows: wp.int32,
    span: wp.int32,
    # Out:
    faces_out: wp.array(dtype=wp.vec4i),
    poor_out: wp.array(dtype=wp.uint8),
) -> None:
    """Connect the triangles of some rows, and tell which rows have poor ones.

    One thread per listed row or, where none is listed, per `span` rows.
    """
    n = first + wp.tid()
    start = n * span
    end = wp.min(start + span, rows)
    if listed.shape[0] > 0:
        start = listed[n]
        end = start + 1
    connect_moved(
        bits.inside,
        bits.exists,
        bits.is_marked,
        wp.vec3i(grid.nx, grid.ny, grid.nz),
        grid.words,
        before_line(grid),
        start,
        end,
        bits.starts,
        bits.along_x,
        bits.along_y,
        triangle_starts,
        depths,
        steps,
        tables.frame,
        tables.polygon_count,
        tables.first_polygon,
        tables.edges,
        tables.sizes,
        tables.standard,
        tables.allowed,
        tables.corners,
        tables.members,
        1,
        is_reversed,
        POOR,
        faces_out,
        poor_out,
    )
