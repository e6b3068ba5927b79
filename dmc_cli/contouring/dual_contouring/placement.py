"""Place the vertices of cells by the planes that touch the surface at their crossings.

`qef`: the point of the least sum of squared distances from the planes, nearest to the mean of the crossings,
where directions whose eigenvalue is below a hundredth of the largest count for nothing; drawn into the cell.
`particle`: from the mean, steps along the force of the planes, kept in the cell (Schmitz et al. 2009).

On CPU sixteen vertices at a time; what these leave, and all on a GPU, is up to `single_cells.py`. The
arithmetic is the same: single precision, enough where small eigenvalues are dropped.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import LANES, VECTOR_FLAGS
from dmc_cli.contouring.dual_contouring.cell_planes import (
    LEAST_ERROR,
    LEFT,
    OUTSIDE,
    PlacedLanes,
)
from dmc_cli.contouring.dual_contouring.single_cells import GROUP, place_left_kernel, place_vertices_kernel
from dmc_cli.contouring.dual_grid import CellContext, CellVertices
from dmc_cli.field import (
    BLOCKS_A_CHUNK,
    Field,
    FloatLanes,
    Grid,
    IntLanes,
    find_block_cells,
    store_points,
    world_lanes,
)
from dmc_cli.runtime import native

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


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


@wp.func_native(native(__file__, "place_block"))
def place_block(
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    node: wp.int64,
    offsets: IntLanes,
    ends: IntLanes,
    row: wp.int64,
    layer: wp.int64,
    sign: wp.float64,
    isovalue: wp.float64,
    steps: wp.int32,
    step_size: wp.float32,
) -> PlacedLanes:
    """Place the vertices of the cells at `node` + `offsets`; `ends` says what `ends_at` does of them.

    A row and a layer of the volume have that many nodes. In C++, since clang makes no vectors of these loops
    over Warp's, and a vector of all that is at the corners would be copied several times.
    """
    ...


@wp.func
def ends_at(grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.int32:
    """Return at which ends of the volume cell (i, j, k) lies: two bits an axis; beyond them too."""
    b = grid.border
    first = wp.where(i <= b, 1, 0) | wp.where(j <= b, 4, 0) | wp.where(k <= b, 16, 0)
    last = wp.where(i >= grid.nx - b - 2, 2, 0) | wp.where(j >= grid.ny - b - 2, 8, 0)
    return first | last | wp.where(k >= grid.nz - b - 2, 32, 0)


@wp.func
def is_settled(field: Field, grid: Grid, ends: wp.int32) -> wp.bool:
    """Return whether what is at a cell's corners follows from stored values and its ends."""
    is_whole = grid.border == 0 and grid.nx >= 4  # a row of four values
    return field.has_nodata == 0 and (is_whole or ends == 0)


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
    ends = IntLanes()
    left = IntLanes()
    safe = int(-1)
    for lane in range(LANES):
        ends[lane] = ends_at(grid, ci[lane], cj[lane], ck[lane])
        left[lane] = wp.where(is_settled(field, grid, ends[lane]), far[lane], 1)
        safe = wp.where(left[lane] == 0, lane, safe)
    outside = int(0)
    bits = wp.uint32(0xFFFF)
    if safe >= 0:
        for lane in range(LANES):
            offsets[lane] = wp.where(left[lane] == 1, offsets[safe], offsets[lane])
            ends[lane] = wp.where(left[lane] == 1, ends[safe], ends[lane])
        row = wp.int64(grid.nx - 2 * grid.border)
        placed = place_block(
            field.values,
            field.kind,
            found.node,
            offsets,
            ends,
            row,
            row * wp.int64(grid.ny - 2 * grid.border),
            field.sign,
            field.isovalue,
            steps,
            step_size,
        )
        us = FloatLanes()
        vs = FloatLanes()
        ws = FloatLanes()
        bits = wp.uint32(0)
        for lane in range(LANES):
            us[lane] = placed[lane]
            vs[lane] = placed[LANES + lane]
            ws[lane] = placed[2 * LANES + lane]
            became = wp.int32(placed[3 * LANES + lane])
            is_left = wp.where((became & LEFT) != 0, 1, left[lane])
            bits |= wp.uint32(is_left) << wp.uint32(lane)
            outside += wp.where(is_left == 1 or lane >= size, 0, became & OUTSIDE)
        m = matrix
        xs = world_lanes(wp.vec4d(m[0, 0], m[0, 1], m[0, 2], m[0, 3]), ci, cj, ck, us, vs, ws)
        ys = world_lanes(wp.vec4d(m[1, 0], m[1, 1], m[1, 2], m[1, 3]), ci, cj, ck, us, vs, ws)
        zs = world_lanes(wp.vec4d(m[2, 0], m[2, 1], m[2, 2], m[2, 3]), ci, cj, ck, us, vs, ws)
        store_points(us, vs, ws, start, size, local_out)
        store_points(xs, ys, zs, start, size, position_out)
    outside_out[block] = wp.uint8(outside)
    left_out[block] = bits
