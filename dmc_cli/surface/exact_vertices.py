"""Vertices exactly on the surface: the kernels of `--placement exact`, but for what `blocks` does.

Ordinary cells on a GPU, and special cells everywhere.
"""

import warp as wp

from dmc_cli.surface.field import Field, cell_values
from dmc_cli.surface.grid import Grid, world_position
from dmc_cli.surface.placement import crossed_edges, edge_set, place_vertex
from dmc_cli.surface.polygons import SpecialCells, polygon_of_vertex
from dmc_cli.surface.trilinear import single_precision

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.kernel
def place_ordinary_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    count: wp.int32,
    cells: wp.array(dtype=wp.int64),
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    local_out: wp.array(dtype=wp.vec3),
    fallbacks_out: wp.array(dtype=wp.int64),
):
    """Place the vertices of the ordinary cells. One thread a vertex; for a GPU."""
    v = first + wp.tid()
    row = wp.int32(cells[v] / wp.int64(grid.nx))
    i = wp.int32(cells[v] - wp.int64(row) * wp.int64(grid.nx))
    j = row % grid.ny
    k = row // grid.ny
    f = single_precision(cell_values(field, grid, i, j, k))
    p = place_vertex(f, crossed_edges(f))
    local = wp.vec3(p[0], p[1], p[2])
    local_out[v] = local
    position_out[v] = world_position(matrix, i, j, k, local)
    fallbacks_out[v] = wp.int64(p[3])


@wp.kernel
def place_special_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    special: SpecialCells,
    ordinary_count: wp.int32,
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    cell_out: wp.array(dtype=wp.int64),
    local_out: wp.array(dtype=wp.vec3),
    fallbacks_out: wp.array(dtype=wp.int64),
):
    """Place the vertices of the special cells. One thread a special cell.

    The fans of one polygon share its position: each is placed from the whole polygon's edges.
    """
    s = first + wp.tid()
    row = special.row[s]
    i = special.i[s]
    j = row % grid.ny
    k = row // grid.ny
    f = single_precision(cell_values(field, grid, i, j, k))
    fallbacks = wp.int32(0)
    count = wp.int32(special.first_vertex[s + 1] - special.first_vertex[s])
    for n in range(count):
        p = place_vertex(f, edge_set(polygon_of_vertex(special, wp.int64(s), n)))
        local = wp.vec3(p[0], p[1], p[2])
        v = ordinary_count + wp.int32(special.first_vertex[s]) + n
        local_out[v] = local
        position_out[v] = world_position(matrix, i, j, k, local)
        cell_out[v] = wp.int64(row) * wp.int64(grid.nx) + wp.int64(i)
        fallbacks += wp.int32(p[3])
    fallbacks_out[s] = wp.int64(fallbacks)
