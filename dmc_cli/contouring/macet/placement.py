"""Place vertices that are drawn back: steps from the edges' middles become cells and local coordinates."""

import warp as wp

from dmc_cli.contouring.macet.surface_steps import AXIS, Steps, unit
from dmc_cli.contouring.stages.edge_ranks import EdgeBits
from dmc_cli.contouring.stages.edge_vertices import cell_at_edge
from dmc_cli.field import (
    Field,
    Grid,
    index_position,
    locate_point,
    node_cell,
    node_position,
    world_position,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def index_of(grid: Grid, steps: Steps, v: wp.int32) -> wp.vec3:
    """Return where a vertex is, in node indices, in single precision."""
    return wp.vec3(index_position(grid, steps.cell[v], steps.local[v]))


@wp.func
def lower_node(grid: Grid, steps: Steps, v: wp.int32) -> wp.vec3i:
    """Return the lower node of a vertex's edge, by where the vertex is and its step."""
    middle = index_position(grid, steps.cell[v], steps.local[v]) - wp.vec3d(steps.step[v])
    node = middle - wp.float64(0.5) * wp.vec3d(unit(wp.int32(steps.state[v] & AXIS)))
    return wp.vec3i(wp.int32(wp.round(node[0])), wp.int32(wp.round(node[1])), wp.int32(wp.round(node[2])))


@wp.func
def move_vertex(
    field: Field, grid: Grid, bits: EdgeBits, matrix: wp.mat44d, steps: Steps, v: wp.int32, step: wp.vec3
) -> wp.bool:
    """Have a vertex lie a step from its edge's middle; where that leads into no cell, at its crossing."""
    axis = wp.int32(steps.state[v] & AXIS)
    node = lower_node(grid, steps, v)
    middle = wp.vec3(wp.float32(node[0]), wp.float32(node[1]), wp.float32(node[2])) + 0.5 * unit(axis)
    end = locate_point(field, grid, wp.vec3d(middle) + wp.vec3d(step))
    cell = end.cell
    local = end.local
    if not end.is_found:
        cell = cell_at_edge(grid, bits, node, axis)
        local = wp.vec3(
            wp.float32(node[0] - cell[0]), wp.float32(node[1] - cell[1]), wp.float32(node[2] - cell[2])
        )
        along = steps.crossing[v]
        if wp.length(step) <= wp.abs(step[axis]):  # on its edge, beside a missing cell
            along = wp.clamp(0.5 + step[axis], 0.0, 1.0)
        local[axis] = along
    steps.step[v] = step
    steps.cell[v] = node_cell(grid, cell)
    steps.local[v] = local
    steps.position[v] = world_position(matrix, node_position(cell, local))
    return end.is_found
