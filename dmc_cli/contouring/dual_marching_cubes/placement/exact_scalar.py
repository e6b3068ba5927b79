"""Place vertices exactly on the surface, one by one (`--placement exact`).

On CPU `exact_simd` has placed nearly all before; those that remain are placed here. On a GPU all are.
"""

import warp as wp

from dmc_cli.bits import ANY, bit_index, flagged
from dmc_cli.contouring.dual_marching_cubes.placement.exact import LOST, place_vertex
from dmc_cli.contouring.dual_marching_cubes.special_cells import (
    SpecialCells,
    polygon_of_vertex,
    special_cell_of,
)
from dmc_cli.field import (
    Field,
    Grid,
    cell_node,
    cell_values,
    crossed_edges,
    edge_set,
    is_in_cell,
    node_position,
    single_precision,
    world_position,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.kernel
def place_remaining_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    size: wp.int32,
    ordinary_count: wp.int32,
    special: SpecialCells,
    special_count: wp.int32,
    cells: wp.array(dtype=wp.int64),
    span: wp.int32,
    # In/out:
    local_inout: wp.array(dtype=wp.vec3),
    position_inout: wp.array(dtype=wp.vec3),
    remaining_inout: wp.array(dtype=wp.uint8),
) -> None:
    """Place the vertices that have no place yet: local coordinates below 0.

    One thread `span` blocks of `size`: `remaining` says which have any, and then how many of each took a
    fallback, or `LOST` if one is not in its cell. The fans of one polygon share its position: each vertex is
    placed from the whole polygon's edges.
    """
    start = span * (first + wp.tid())
    remaining = flagged(remaining_inout, start, span, ANY)
    while remaining != wp.uint32(0):
        block = start + bit_index(remaining)
        remaining &= remaining - wp.uint32(1)
        fallbacks = int(0)
        is_lost = bool(False)
        for v in range(block * size, wp.min((block + 1) * size, cells.shape[0])):
            if local_inout[v][0] < 0.0:
                s = int(-1)
                n = wp.int64(v - ordinary_count)
                if n >= wp.int64(0):
                    s = special_cell_of(special, special_count, n)
                node = cell_node(grid, cells[v])
                f = single_precision(cell_values(field, grid, node[0], node[1], node[2]))
                edges = crossed_edges(f)
                if s >= 0:
                    fan = wp.int32(n - special.first_vertex[s])
                    edges = edge_set(polygon_of_vertex(special, wp.int64(s), fan))
                p = place_vertex(f, edges)
                local = wp.vec3(p[0], p[1], p[2])
                local_inout[v] = local
                position_inout[v] = world_position(matrix, node_position(node, local))
                fallbacks += int(p[3])
                is_lost = is_lost or not is_in_cell(local)
        remaining_inout[block] = wp.uint8(wp.where(is_lost, LOST, fallbacks))
