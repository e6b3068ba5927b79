"""Place the vertices of cells at the mean of the cells' crossings.

On CPU sixteen at a time, in loops over lanes without a branch; what these leave, cells at a virtual border,
values that single precision does not hold, is placed one by one, as a GPU places all. The arithmetic is the
same. Single precision serves: values are small once the isovalue is subtracted, and only ratios count.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import ANY, LANES, VECTOR_FLAGS, bit_index, flagged
from dmc_cli.contouring.dual_grid import CellContext, CellVertices
from dmc_cli.field import (
    BLOCKS_A_CHUNK,
    CornerLanes,
    CornerValues,
    Field,
    FloatLanes,
    Grid,
    cell_node,
    cell_values,
    crossed_edges,
    find_block_cells,
    find_crossings,
    fits_single,
    gather_corners,
    mean_crossing,
    needs_care,
    node_position,
    single_precision,
    store_points,
    world_lanes,
    world_position,
)

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


def place_at_means(cell: Any, context: CellContext) -> CellVertices:
    """Place a vertex at the mean of the crossings of each cell; the last launch is begun only."""
    device, count = context.device, cell.shape[0]
    vertices = CellVertices(position=device.empty(count, wp.vec3), local=device.empty(count, wp.vec3))
    inputs = [context.grid.struct(), context.field, context.matrix, cell]
    outputs = [vertices.local, vertices.position]
    if not device.is_cpu:
        device.launch(place_means_kernel, count, inputs, outputs)
        return vertices
    blocks = -(-count // LANES)
    left = device.empty(blocks, wp.uint8)
    device.begin(place_mean_block_kernel, blocks, inputs, [*outputs, left], BLOCKS_A_CHUNK)
    threads = -(-blocks // device.span)
    device.begin(place_left_means_kernel, threads, [*inputs, left, device.span], outputs, 1)
    return vertices


@wp.func
def mean_in_cell(f: CornerValues) -> wp.vec3:
    """Return the mean of a cell's crossings in local coordinates."""
    edges = crossed_edges(f)
    return mean_crossing(find_crossings(f, edges), edges)


@wp.struct
class MeanLanes:
    """Local coordinates of a block's vertices; u is -1 where single precision does not hold the values."""

    u: FloatLanes
    v: FloatLanes
    w: FloatLanes


@wp.func
def mean_lanes(values: CornerLanes) -> MeanLanes:
    """Place all lanes."""
    u = FloatLanes()
    v = FloatLanes()
    w = FloatLanes()
    for lane in range(LANES):
        f = CornerValues(
            values[lane],
            values[LANES + lane],
            values[2 * LANES + lane],
            values[3 * LANES + lane],
            values[4 * LANES + lane],
            values[5 * LANES + lane],
            values[6 * LANES + lane],
            values[7 * LANES + lane],
        )
        mean = mean_in_cell(f)
        u[lane] = wp.where(fits_single(f), mean[0], -1.0)
        v[lane] = mean[1]
        w[lane] = mean[2]
    placed = MeanLanes()
    placed.u = u
    placed.v = v
    placed.w = w
    return placed


@wp.kernel
def place_mean_block_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    cells: wp.array(dtype=wp.int64),
    # Out:
    local_out: wp.array(dtype=wp.vec3),
    position_out: wp.array(dtype=wp.vec3),
    left_out: wp.array(dtype=wp.uint8),
) -> None:
    """Place a block of vertices, and tell whether some are left, with u below 0. One thread per block."""
    block = first + wp.tid()
    start = block * LANES
    size = wp.min(LANES, cells.shape[0] - start)
    block_cells = find_block_cells(grid, cells, start, size)
    ci = block_cells.i
    cj = block_cells.j
    ck = block_cells.k
    far = block_cells.far
    placed = mean_lanes(gather_corners(field, grid, block_cells.node, block_cells.offsets))
    us = placed.u
    vs = placed.v
    ws = placed.w
    has_nodata = field.has_nodata
    left = int(0)
    for lane in range(LANES):
        care = needs_care(has_nodata, grid, ci[lane], cj[lane], ck[lane])
        is_left = wp.where(us[lane] < 0.0, 1, far[lane]) | wp.where(care, 1, 0)
        us[lane] = wp.where(is_left == 1, -1.0, us[lane])
        left |= is_left
    xs = world_lanes(wp.vec4d(matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[0, 3]), ci, cj, ck, us, vs, ws)
    ys = world_lanes(wp.vec4d(matrix[1, 0], matrix[1, 1], matrix[1, 2], matrix[1, 3]), ci, cj, ck, us, vs, ws)
    zs = world_lanes(wp.vec4d(matrix[2, 0], matrix[2, 1], matrix[2, 2], matrix[2, 3]), ci, cj, ck, us, vs, ws)
    store_points(us, vs, ws, start, size, local_out)
    store_points(xs, ys, zs, start, size, position_out)
    left_out[block] = wp.uint8(left)


@wp.func
def mean_of_cell(grid: Grid, field: Field, node: wp.vec3i) -> wp.vec3:
    """Return the mean of the crossings of any cell in local coordinates."""
    return mean_in_cell(single_precision(cell_values(field, grid, node[0], node[1], node[2])))


@wp.kernel
def place_left_means_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    cells: wp.array(dtype=wp.int64),
    left: wp.array(dtype=wp.uint8),
    span: wp.int32,
    # In/out:
    local_inout: wp.array(dtype=wp.vec3),
    position_inout: wp.array(dtype=wp.vec3),
) -> None:
    """Place the vertices that their blocks have left. One thread `span` blocks."""
    start = span * (first + wp.tid())
    remaining = flagged(left, start, span, ANY)
    while remaining != wp.uint32(0):
        block = start + bit_index(remaining)
        remaining &= remaining - wp.uint32(1)
        for v in range(block * LANES, wp.min((block + 1) * LANES, cells.shape[0])):
            if local_inout[v][0] < 0.0:
                node = cell_node(grid, cells[v])
                local = mean_of_cell(grid, field, node)
                local_inout[v] = local
                position_inout[v] = world_position(matrix, node_position(node, local))


@wp.kernel
def place_means_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    cells: wp.array(dtype=wp.int64),
    # Out:
    local_out: wp.array(dtype=wp.vec3),
    position_out: wp.array(dtype=wp.vec3),
) -> None:
    """Place each vertex by itself, on a GPU. One thread per vertex."""
    v = first + wp.tid()
    node = cell_node(grid, cells[v])
    local = mean_of_cell(grid, field, node)
    local_out[v] = local
    position_out[v] = world_position(matrix, node_position(node, local))
