"""Place the vertices of cells read one by one: those that their blocks have left, and all on a GPU.

On CPU that are cells beside missing or virtual nodes, and those of values that single precision does not
hold. They are placed sixteen at a time as well, by the same arithmetic.
"""

import warp as wp

from dmc_cli.bits import LANES, VECTOR_FLAGS, bit_index, low_bits
from dmc_cli.contouring.dual_contouring.cell_planes import (
    LEFT,
    OUTSIDE,
    CellLanes,
    X,
    Y,
    Z,
    place_gathered,
    place_one,
)
from dmc_cli.contouring.dual_contouring.corner_gradients import cell_gradients, scaled_gradients
from dmc_cli.field import (
    Field,
    Grid,
    IntLanes,
    cell_node,
    cell_values,
    node_position,
    single_precision,
    world_position,
)

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

GROUP = 64
"""Blocks whose left vertices one thread places."""


@wp.func
def place_in_cell(
    grid: Grid, field: Field, node: wp.vec3i, steps: wp.int32, step_size: wp.float32
) -> wp.vec4:
    """Place the vertex of any cell; the fourth number is 1 if it lay outside it."""
    f = single_precision(cell_values(field, grid, node[0], node[1], node[2]))
    placed = place_one(f, cell_gradients(field, grid, node), steps, step_size)
    if (wp.int32(placed[3]) & LEFT) != 0:  # a float32 square would lose digits
        placed = place_one(f, scaled_gradients(field, grid, node), steps, step_size)
    return placed


@wp.func
def place_listed(
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    steps: wp.int32,
    step_size: wp.float32,
    cells: wp.array(dtype=wp.int64),
    gathered: CellLanes,
    listed: IntLanes,
    count: wp.int32,
    local_out: wp.array(dtype=wp.vec3),
    position_out: wp.array(dtype=wp.vec3),
) -> wp.int32:
    """Place the first `count` of the listed vertices; return how many lay outside their cells."""
    placed = place_gathered(gathered, steps, step_size)
    outside = int(0)
    for lane in range(count):
        v = listed[lane]
        node = cell_node(grid, cells[v])
        p = wp.vec4(placed[lane], placed[LANES + lane], placed[2 * LANES + lane], placed[3 * LANES + lane])
        if (wp.int32(p[3]) & LEFT) != 0:
            p = place_in_cell(grid, field, node, steps, step_size)
        local = wp.vec3(p[0], p[1], p[2])
        local_out[v] = local
        position_out[v] = world_position(matrix, node_position(node, local))
        outside += wp.int32(p[3]) & OUTSIDE
    return outside


@wp.kernel
def place_left_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    steps: wp.int32,
    step_size: wp.float32,
    cells: wp.array(dtype=wp.int64),
    left: wp.array(dtype=wp.uint32),
    # In/out:
    local_inout: wp.array(dtype=wp.vec3),
    position_inout: wp.array(dtype=wp.vec3),
    # Out:
    outside_out: wp.array(dtype=wp.int32),
) -> None:
    """Place the vertices that their blocks have left. One thread per group of blocks."""
    group = first + wp.tid()
    outside = int(0)
    count = int(0)
    listed = IntLanes()
    gathered = CellLanes()  # lanes that are not listed hold other cells, which count for nothing
    for block in range(group * GROUP, wp.min((group + 1) * GROUP, left.shape[0])):
        remaining = left[block] & low_bits(cells.shape[0] - block * LANES)
        while remaining != wp.uint32(0):
            v = block * LANES + bit_index(remaining)
            remaining &= remaining - wp.uint32(1)
            node = cell_node(grid, cells[v])
            f = single_precision(cell_values(field, grid, node[0], node[1], node[2]))
            g = cell_gradients(field, grid, node)
            for c in range(8):
                gathered[LANES * c + count] = f[c]
                gathered[X + LANES * c + count] = g[3 * c]
                gathered[Y + LANES * c + count] = g[3 * c + 1]
                gathered[Z + LANES * c + count] = g[3 * c + 2]
            listed[count] = v
            count += 1
            if count == LANES:
                outside += place_listed(
                    grid,
                    field,
                    matrix,
                    steps,
                    step_size,
                    cells,
                    gathered,
                    listed,
                    count,
                    local_inout,
                    position_inout,
                )
                count = int(0)
    outside += place_listed(
        grid, field, matrix, steps, step_size, cells, gathered, listed, count, local_inout, position_inout
    )
    outside_out[group] = outside


@wp.kernel
def place_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    steps: wp.int32,
    step_size: wp.float32,
    cells: wp.array(dtype=wp.int64),
    # Out:
    local_out: wp.array(dtype=wp.vec3),
    position_out: wp.array(dtype=wp.vec3),
    outside_out: wp.array(dtype=wp.uint8),
) -> None:
    """Place each vertex by itself, on a GPU. One thread per vertex."""
    v = first + wp.tid()
    node = cell_node(grid, cells[v])
    p = place_in_cell(grid, field, node, steps, step_size)
    local = wp.vec3(p[0], p[1], p[2])
    local_out[v] = local
    position_out[v] = world_position(matrix, node_position(node, local))
    outside_out[v] = wp.uint8(wp.int32(p[3]) & OUTSIDE)
