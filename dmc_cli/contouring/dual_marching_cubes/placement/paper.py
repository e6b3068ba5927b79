"""Place vertices as the papers do: the kernel of `--placement sampled`, `iterative` and `centroid`.

None of the three keeps every vertex on the surface; they are here for the papers' numbers. So one plain
kernel serves all cells, ordinary and special, on CPU and on CUDA.
"""

import warp as wp

from dmc_cli.contouring.dual_marching_cubes.placement.exact import LOST
from dmc_cli.contouring.dual_marching_cubes.placement.iterative import place_at_mean, place_by_steps
from dmc_cli.contouring.dual_marching_cubes.placement.sampled import place_by_samples
from dmc_cli.contouring.dual_marching_cubes.special_cells import (
    SpecialCells,
    polygon_of_vertex,
    special_cell_of,
)
from dmc_cli.field import (
    CornerValues,
    EdgeSet,
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

SAMPLED, ITERATIVE, CENTROID = range(3)

METHODS = {"sampled": SAMPLED, "iterative": ITERATIVE, "centroid": CENTROID}
"""The placements that this kernel knows, by their names in the settings."""


@wp.func
def place_by(method: wp.int32, f: CornerValues, edges: EdgeSet) -> wp.vec4:
    """Return a polygon's vertex in local coordinates, and 1 if the method failed and left it at the mean."""
    p = wp.vec4()
    if method == SAMPLED:
        p = place_by_samples(f, edges)
    elif method == ITERATIVE:
        p = place_by_steps(f, edges)
    else:
        p = place_at_mean(f, edges)
    return p


@wp.kernel
def place_paper_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    method: wp.int32,
    ordinary_count: wp.int32,
    special: SpecialCells,
    special_count: wp.int32,
    # In/out:
    cell_inout: wp.array(dtype=wp.int64),
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    local_out: wp.array(dtype=wp.vec3),
    fallback_out: wp.array(dtype=wp.uint8),
) -> None:
    """Place vertices and note the cells of special ones. One thread per vertex."""
    v = first + wp.tid()
    s = int(-1)
    n = wp.int64(v - ordinary_count)
    if n >= wp.int64(0):
        s = special_cell_of(special, special_count, n)
        cell_inout[v] = wp.int64(special.row[s]) * wp.int64(grid.nx) + wp.int64(special.i[s])
    node = cell_node(grid, cell_inout[v])
    f = single_precision(cell_values(field, grid, node[0], node[1], node[2]))
    edges = crossed_edges(f)
    if s >= 0:
        edges = edge_set(polygon_of_vertex(special, wp.int64(s), wp.int32(n - special.first_vertex[s])))
    p = place_by(method, f, edges)
    local = wp.vec3(p[0], p[1], p[2])
    local_out[v] = local
    position_out[v] = world_position(matrix, node_position(node, local))
    fallback_out[v] = wp.uint8(wp.where(is_in_cell(local), int(p[3]), LOST))
