"""Sum up the neighbours of each vertex, for their mean.

A row's thread goes through the triangles round its vertices and sums up their other corners: each neighbour
is in two of them, those at an open border in one.
"""

import warp as wp

from dmc_cli.contouring.macet.triangle_ranges import rows_of_cells
from dmc_cli.contouring.stages.edge_ranks import EdgeBits
from dmc_cli.field import Grid

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.kernel
def sum_neighbors_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: EdgeBits,
    triangle_starts: wp.array(dtype=wp.int64),
    faces: wp.array(dtype=wp.vec4i),
    rows: wp.int32,
    span: wp.int32,
    position: wp.array(dtype=wp.vec3),
    # Out:
    sum_out: wp.array(dtype=wp.vec4),
) -> None:
    """Sum up the other corners of the triangles at the vertices of some rows. One thread per `span` rows."""
    start = (first + wp.tid()) * span
    end = wp.min(start + span, rows)
    low = wp.int32(bits.starts[start])
    high = wp.int32(bits.starts[end])
    if low == high:
        return
    for v in range(low, high):
        sum_out[v] = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for part in range(2):
        near = rows_of_cells(grid, start, end, part)
        if near[0] < near[1]:
            for t in range(wp.int32(triangle_starts[near[0]]), wp.int32(triangle_starts[near[1]])):
                face = faces[t]
                for corner in range(3):
                    v = face[corner]
                    if v >= low and v < high:
                        both = position[face[(corner + 1) % 3]] + position[face[(corner + 2) % 3]]
                        sum_out[v] = sum_out[v] + wp.vec4(both[0], both[1], both[2], 2.0)
