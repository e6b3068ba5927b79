"""Turn steps from the edges' middles into cells and local coordinates, and these into positions."""

import warp as wp

from dmc_cli.contouring.macet.surface_steps import AXIS, Steps, lower_node, middle_of
from dmc_cli.contouring.stages.edge_ranks import EdgeBits
from dmc_cli.field import (
    Field,
    Grid,
    index_position,
    locate_point,
    node_cell,
    node_position,
    row_place,
    world_position,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.kernel
def place_steps_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    bits: EdgeBits,
    matrix: wp.mat44d,
    rows: wp.int32,
    span: wp.int32,
    # In/out:
    steps: Steps,
    # Out:
    drawn_out: wp.array(dtype=wp.int32),
) -> None:
    """Place the vertices of some rows, and count in each how many the guard has drawn back.

    A vertex on its edge beside a cell that does not exist stays in the cell that it has; one whose step leads
    into no cell goes back to its crossing. One thread per `span` rows.
    """
    start = (first + wp.tid()) * span
    for row in range(start, wp.min(start + span, rows)):
        drawn = int(0)
        place = row_place(grid, row)
        for v in range(wp.int32(bits.starts[row]), wp.int32(bits.starts[row + 1])):
            state = steps.state[v]
            drawn += wp.where(state > AXIS, 1, 0)
            axis = wp.int32(state & AXIS)
            cell = steps.cell[v]
            local = steps.local[v]
            node = lower_node(grid, cell, local, axis, place[0], place[1])
            x = middle_of(node, axis) + wp.vec3d(steps.step[v])
            end = locate_point(field, grid, x)
            if end.is_found:
                steps.cell[v] = node_cell(grid, end.cell)
                steps.local[v] = end.local
                steps.position[v] = world_position(matrix, node_position(end.cell, end.local))
            else:
                step = steps.step[v]
                if wp.length(step) <= wp.abs(step[axis]):
                    local[axis] = wp.clamp(0.5 + step[axis], 0.0, 1.0)
                    steps.local[v] = local
                x = index_position(grid, cell, local)
                steps.position[v] = world_position(matrix, x)
        drawn_out[row] = drawn
