"""Place the vertices of cells by the planes that touch the surface at their crossings.

`qef`: the point of the least sum of squared distances from the planes, nearest to the mean of the crossings,
where directions whose eigenvalue is below a hundredth of the largest count for nothing; drawn into the cell.
`particle`: from the mean, steps along the force of the planes, kept in the cell (Schmitz et al. 2009).

On CPU sixteen vertices at a time. What these leave, cells near the volume's ends or missing nodes, is read
one by one, as a GPU does for all, and placed sixteen at a time as well. The arithmetic is the same: single
precision, enough where small eigenvalues are dropped.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import LANES, VECTOR_FLAGS, bit_index, low_bits
from dmc_cli.contouring.dual_contouring.cell_planes import (
    SummedLanes,
    SummedPlanes,
    X,
    Y,
    Z,
    sum_plane_lanes,
    sum_planes,
)
from dmc_cli.contouring.dual_contouring.corner_gradients import (
    CellLanes,
    cell_gradients,
    gather_cells,
    scaled_gradients,
)
from dmc_cli.contouring.dual_contouring.symmetric_matrix import Planes, least_point
from dmc_cli.contouring.dual_grid import CellContext, CellVertices
from dmc_cli.contouring.normals import NO_OFFSET, is_interior
from dmc_cli.field import (
    BLOCKS_A_CHUNK,
    CornerValues,
    Field,
    FloatLanes,
    Grid,
    IntLanes,
    cell_node,
    cell_values,
    find_block_cells,
    fits_single,
    node_position,
    single_precision,
    store_points,
    world_lanes,
    world_position,
)

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

CUT = wp.constant(0.01)
"""Eigenvalues up to this share of the largest are dropped: on a scan they are noise."""

GROUP = 64
"""Blocks whose left vertices one thread places."""

LEAST_ERROR = -1
"""What stands for `qef` where a kernel takes a number of steps."""


@wp.struct
class PlacedLanes:
    """Local coordinates of sixteen vertices, and which of them lay outside their cell (1)."""

    u: FloatLanes
    v: FloatLanes
    w: FloatLanes
    outside: IntLanes


def place_by_planes(cell: Any, context: CellContext) -> CellVertices:
    """Place a vertex in each cell by its planes, as the settings choose."""
    device, count, chosen = context.device, cell.shape[0], context.settings
    steps = LEAST_ERROR if chosen.steps is None else chosen.steps
    position, local = device.empty(count, wp.vec3), device.empty(count, wp.vec3)
    inputs = [context.grid.struct(), context.field, context.matrix, steps, chosen.step_size or 0.0, cell]
    outputs, blocks = [local, position], -(-count // LANES)
    outside = device.empty(blocks if device.is_cpu else count, wp.uint8)
    if device.is_cpu:
        left = device.empty(blocks, wp.uint32)
        device.begin(place_plane_block_kernel, blocks, inputs, [*outputs, outside, left], BLOCKS_A_CHUNK)
        groups = -(-blocks // GROUP)
        more = device.empty(groups, wp.int32)
        device.launch(place_left_kernel, groups, [*inputs, left], [*outputs, more], 1)
        return CellVertices(position, local, device.total(outside) + device.total(more))
    device.launch(place_vertices_kernel, count, inputs, [*outputs, outside])
    return CellVertices(position, local, device.total(outside))


@wp.func
def forced(sums: Planes, mean: wp.vec3, p: wp.vec3, step_size: wp.float32) -> wp.vec3:
    """Return a particle after a step from p along the force of the planes, kept in the cell."""
    x = p[0] - mean[0]
    y = p[1] - mean[1]
    z = p[2] - mean[2]
    along_x = sums[6] - (sums[0] * x + sums[3] * y + sums[4] * z)
    along_y = sums[7] - (sums[3] * x + sums[1] * y + sums[5] * z)
    along_z = sums[8] - (sums[4] * x + sums[5] * y + sums[2] * z)
    return wp.vec3(
        wp.clamp(p[0] + step_size * along_x, 0.0, 1.0),
        wp.clamp(p[1] + step_size * along_y, 0.0, 1.0),
        wp.clamp(p[2] + step_size * along_z, 0.0, 1.0),
    )


@wp.func
def is_outside(p: wp.vec3) -> wp.int32:
    """Return 1 if a point is not in the cell, else 0."""
    low = wp.min(p[0], wp.min(p[1], p[2]))
    high = wp.max(p[0], wp.max(p[1], p[2]))
    return wp.where(low < 0.0, 1, wp.where(high > 1.0, 1, 0))


@wp.func
def least_lanes(lanes: SummedLanes) -> PlacedLanes:
    """Place sixteen vertices at the least error."""
    mean_u = lanes.u
    mean_v = lanes.v
    mean_w = lanes.w
    s = lanes.sums
    u = FloatLanes()
    v = FloatLanes()
    w = FloatLanes()
    outside = IntLanes()
    for lane in range(LANES):
        sums = Planes(
            s[lane],
            s[LANES + lane],
            s[2 * LANES + lane],
            s[3 * LANES + lane],
            s[4 * LANES + lane],
            s[5 * LANES + lane],
            s[6 * LANES + lane],
            s[7 * LANES + lane],
            s[8 * LANES + lane],
        )
        step = least_point(sums, CUT)
        p = wp.vec3(mean_u[lane] + step[0], mean_v[lane] + step[1], mean_w[lane] + step[2])
        outside[lane] = is_outside(p)
        u[lane] = wp.clamp(p[0], 0.0, 1.0)
        v[lane] = wp.clamp(p[1], 0.0, 1.0)
        w[lane] = wp.clamp(p[2], 0.0, 1.0)
    placed = PlacedLanes()
    placed.u = u
    placed.v = v
    placed.w = w
    placed.outside = outside
    return placed


@wp.func
def particle_lanes(lanes: SummedLanes, steps: wp.int32, step_size: wp.float32) -> PlacedLanes:
    """Place sixteen vertices by so many steps."""
    mean_u = lanes.u
    mean_v = lanes.v
    mean_w = lanes.w
    s = lanes.sums
    u = mean_u
    v = mean_v
    w = mean_w
    for _step in range(steps):
        for lane in range(LANES):
            sums = Planes(
                s[lane],
                s[LANES + lane],
                s[2 * LANES + lane],
                s[3 * LANES + lane],
                s[4 * LANES + lane],
                s[5 * LANES + lane],
                s[6 * LANES + lane],
                s[7 * LANES + lane],
                s[8 * LANES + lane],
            )
            mean = wp.vec3(mean_u[lane], mean_v[lane], mean_w[lane])
            p = forced(sums, mean, wp.vec3(u[lane], v[lane], w[lane]), step_size)
            u[lane] = p[0]
            v[lane] = p[1]
            w[lane] = p[2]
    placed = PlacedLanes()
    placed.u = u
    placed.v = v
    placed.w = w
    return placed


@wp.func
def place_one(summed: SummedPlanes, steps: wp.int32, step_size: wp.float32) -> wp.vec4:
    """Place one vertex; the fourth number is 1 if it lay outside its cell."""
    p = summed.mean
    outside = int(0)
    if steps < 0:
        p = summed.mean + least_point(summed.sums, CUT)
        outside = is_outside(p)
        p = wp.vec3(wp.clamp(p[0], 0.0, 1.0), wp.clamp(p[1], 0.0, 1.0), wp.clamp(p[2], 0.0, 1.0))
    for _step in range(steps):
        p = forced(summed.sums, summed.mean, p, step_size)
    return wp.vec4(p[0], p[1], p[2], wp.float32(outside))


@wp.func
def place_in_cell(
    grid: Grid, field: Field, node: wp.vec3i, steps: wp.int32, step_size: wp.float32
) -> wp.vec4:
    """Place the vertex of any cell; the fourth number is 1 if it lay outside it."""
    f = single_precision(cell_values(field, grid, node[0], node[1], node[2]))
    summed = sum_planes(f, cell_gradients(field, grid, node))
    if summed.out == 1:  # a float32 square would lose digits
        summed = sum_planes(f, scaled_gradients(field, grid, node))
    return place_one(summed, steps, step_size)


@wp.func
def lanes_fit(f: CellLanes) -> IntLanes:
    """Return for sixteen cells whether their corner values need no scaling in single precision (1)."""
    fits = IntLanes()
    for lane in range(LANES):
        values = CornerValues(
            f[lane],
            f[LANES + lane],
            f[2 * LANES + lane],
            f[3 * LANES + lane],
            f[4 * LANES + lane],
            f[5 * LANES + lane],
            f[6 * LANES + lane],
            f[7 * LANES + lane],
        )
        fits[lane] = wp.where(fits_single(values), 1, 0)
    return fits


@wp.kernel
def place_plane_block_kernel(
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
    left_out: wp.array(dtype=wp.uint32),
) -> None:
    """Place a block of vertices, and tell which are left, a bit each. One thread per block.

    The cell of one that needs care is not read, but another one's in its place.
    """
    block = first + wp.tid()
    start = block * LANES
    size = wp.min(LANES, cells.shape[0] - start)
    found = find_block_cells(grid, cells, start, size)
    ci = found.i
    cj = found.j
    ck = found.k
    far = found.far
    offsets = found.offsets
    has_nodata = field.has_nodata
    safe = NO_OFFSET
    left = IntLanes()
    for lane in range(LANES):
        left[lane] = wp.where(is_interior(has_nodata, grid, ci[lane], cj[lane], ck[lane]), far[lane], 1)
        safe = wp.max(safe, wp.where(left[lane] == 1, NO_OFFSET, offsets[lane]))
    outside = int(0)
    bits = wp.uint32(0xFFFF)
    if safe != NO_OFFSET:
        for lane in range(LANES):
            offsets[lane] = wp.where(left[lane] == 1, safe, offsets[lane])
        gathered = gather_cells(field, grid, found.node, offsets)
        lanes = sum_plane_lanes(gathered)
        placed = PlacedLanes()
        if steps < 0:
            placed = least_lanes(lanes)
        else:
            placed = particle_lanes(lanes, steps, step_size)
        us = placed.u
        vs = placed.v
        ws = placed.w
        lies_outside = placed.outside
        fits = lanes_fit(gathered)
        bits = wp.uint32(0)
        for lane in range(LANES):
            is_left = wp.where(fits[lane] == 1, left[lane], 1) | lanes.out
            bits |= wp.uint32(is_left) << wp.uint32(lane)
            outside += wp.where(is_left == 1 or lane >= size, 0, lies_outside[lane])
        m = matrix
        xs = world_lanes(wp.vec4d(m[0, 0], m[0, 1], m[0, 2], m[0, 3]), ci, cj, ck, us, vs, ws)
        ys = world_lanes(wp.vec4d(m[1, 0], m[1, 1], m[1, 2], m[1, 3]), ci, cj, ck, us, vs, ws)
        zs = world_lanes(wp.vec4d(m[2, 0], m[2, 1], m[2, 2], m[2, 3]), ci, cj, ck, us, vs, ws)
        store_points(us, vs, ws, start, size, local_out)
        store_points(xs, ys, zs, start, size, position_out)
    outside_out[block] = wp.uint8(outside)
    left_out[block] = bits


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
    lanes = sum_plane_lanes(gathered)
    placed = PlacedLanes()
    if steps < 0:
        placed = least_lanes(lanes)
    else:
        placed = particle_lanes(lanes, steps, step_size)
    us = placed.u
    vs = placed.v
    ws = placed.w
    lies_outside = placed.outside
    outside = int(0)
    for lane in range(count):
        v = listed[lane]
        node = cell_node(grid, cells[v])
        p = wp.vec4(us[lane], vs[lane], ws[lane], wp.float32(lies_outside[lane]))
        if lanes.out == 1:  # not all can be summed side by side
            p = place_in_cell(grid, field, node, steps, step_size)
        local = wp.vec3(p[0], p[1], p[2])
        local_out[v] = local
        position_out[v] = world_position(matrix, node_position(node, local))
        outside += wp.int32(p[3])
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
    outside_out[v] = wp.uint8(p[3])
