"""Vertices on CPU: sixteen at a time, so that the compiler can use vector instructions.

The arithmetic is that of `placement`; only the loops are turned inside out. Corner values are gathered into
lanes, and one loop without a branch places all lanes, each as the one polygon of its cell. Vertices that it
cannot place, and those that are one of several polygons, get local coordinates below 0, for `exact_vertices`
to place one by one.
"""

from typing import Any

import warp as wp

from dmc_cli.surface.field import (
    FLOAT32,
    INT8,
    INT16,
    INT32,
    UINT8,
    UINT16,
    UINT32,
    Field,
    needs_care,
)
from dmc_cli.surface.grid import Grid, world_coordinate
from dmc_cli.surface.placement import crossed_edges, solve_on_steepest_axis
from dmc_cli.surface.trilinear import CornerValues, below_zero, fits_single

VECTOR_FLAGS = f"{wp.config.cpu_compiler_flags or '-march=native'} -mprefer-vector-width=512"
"""Warp's own flags, and leave to use the widest vector registers there are."""

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

LANES = 16
"""Vertices a block: one or two vector registers of float32."""

ONE_OF_SEVERAL = wp.constant(wp.vec3(-2.0, -2.0, -2.0))
"""Local coordinates, at first, of a vertex that does not stand for all crossed edges of its cell."""

IntLanes = wp.types.vector(length=LANES, dtype=wp.int32)
FloatLanes = wp.types.vector(length=LANES, dtype=wp.float32)
CornerLanes = wp.types.vector(length=8 * LANES, dtype=wp.float32)
"""F at the corners of a block's cells: corner after corner."""


@wp.func
def gather(
    values: wp.array2d(dtype=Any), rows: IntLanes, columns: IntLanes, sign: wp.float64, isovalue: wp.float64
) -> FloatLanes:
    """Return F at nodes of the volume, in single precision."""
    lanes = FloatLanes()
    for lane in range(LANES):
        lanes[lane] = below_zero(sign * (wp.float64(values[rows[lane], columns[lane]]) - isovalue))
    return lanes


@wp.func
def gather_field(field: Field, rows: IntLanes, columns: IntLanes) -> FloatLanes:
    """Return F at nodes of the volume, whatever the type of its values."""
    lanes = FloatLanes()
    if field.kind == INT16:
        lanes = gather(field.i16, rows, columns, field.sign, field.isovalue)
    elif field.kind == UINT8:
        lanes = gather(field.u8, rows, columns, field.sign, field.isovalue)
    elif field.kind == FLOAT32:
        lanes = gather(field.f32, rows, columns, field.sign, field.isovalue)
    elif field.kind == UINT16:
        lanes = gather(field.u16, rows, columns, field.sign, field.isovalue)
    elif field.kind == INT8:
        lanes = gather(field.i8, rows, columns, field.sign, field.isovalue)
    elif field.kind == INT32:
        lanes = gather(field.i32, rows, columns, field.sign, field.isovalue)
    elif field.kind == UINT32:
        lanes = gather(field.u32, rows, columns, field.sign, field.isovalue)
    else:
        lanes = gather(field.f64, rows, columns, field.sign, field.isovalue)
    return lanes


@wp.func
def gather_corners(field: Field, rows: IntLanes, columns: IntLanes, ny: wp.int32) -> CornerLanes:
    """Return F at the corners of cells of the volume, ny rows a layer."""
    values = CornerLanes()
    for corner in range(8):
        corner_rows = rows + IntLanes(((corner >> 1) & 1) + ny * (corner >> 2))
        corner_values = gather_field(field, corner_rows, columns + IntLanes(corner & 1))
        for lane in range(LANES):
            values[corner * LANES + lane] = corner_values[lane]
    return values


@wp.struct
class PlacedLanes:
    """Local coordinates of a block's vertices; u is -1 where the steepest axis gave none."""

    u: FloatLanes
    v: FloatLanes
    w: FloatLanes


@wp.func
def place_lanes(values: CornerLanes) -> PlacedLanes:
    """Place all lanes as the only polygon of their cell."""
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
        q = solve_on_steepest_axis(f, crossed_edges(f))
        u[lane] = wp.where(fits_single(f), q[0], -1.0)
        v[lane] = q[1]
        w[lane] = q[2]
    placed = PlacedLanes()
    placed.u = u
    placed.v = v
    placed.w = w
    return placed


@wp.func
def world_lanes(
    m: wp.vec4d, i: IntLanes, j: IntLanes, k: IntLanes, u: FloatLanes, v: FloatLanes, w: FloatLanes
) -> FloatLanes:
    """Return one world coordinate of points of cells; m is that row of the affine map."""
    world = FloatLanes()
    a = m[0]
    b = m[1]
    c = m[2]
    d = m[3]
    for lane in range(LANES):
        x = wp.float64(i[lane]) + wp.float64(u[lane])
        y = wp.float64(j[lane]) + wp.float64(v[lane])
        z = wp.float64(k[lane]) + wp.float64(w[lane])
        world[lane] = world_coordinate(a, b, c, d, x, y, z)
    return world


@wp.kernel
def place_block_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    ordinary_count: wp.int32,
    cells: wp.array(dtype=wp.int64),
    # In/out:
    local_inout: wp.array(dtype=wp.vec3),
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    left_out: wp.array(dtype=wp.uint8),
):
    """Place a block of vertices, as far as each is all of its cell's surface. One thread a block."""
    block = first + wp.tid()
    start = block * LANES
    size = wp.min(LANES, cells.shape[0] - start)
    ci = IntLanes()
    cj = IntLanes()
    ck = IntLanes()
    rows = IntLanes()
    columns = IntLanes()
    ny = grid.ny - 2 * grid.border
    nz = grid.nz - 2 * grid.border
    last = grid.nx - 2 * grid.border - 2
    j = int(0)
    k = int(0)
    row_start = wp.int64(0)
    row_end = wp.int64(0)
    for lane in range(LANES):
        cell = cells[start + wp.min(lane, size - 1)]
        if cell >= row_end or cell < row_start:
            row = wp.int32(cell / wp.int64(grid.nx))
            row_start = wp.int64(row) * wp.int64(grid.nx)
            row_end = row_start + wp.int64(grid.nx)
            k = row / grid.ny
            j = row - k * grid.ny
        i = wp.int32(cell - row_start)
        ci[lane] = i
        cj[lane] = j
        ck[lane] = k
        # any cell of the volume does for one that needs care: it is done again below
        columns[lane] = wp.clamp(i - grid.border, 0, last)
        rows[lane] = wp.clamp(j - grid.border, 0, ny - 2) + ny * wp.clamp(k - grid.border, 0, nz - 2)
    values = gather_corners(field, rows, columns, ny)
    placed = place_lanes(values)
    us = placed.u
    vs = placed.v
    ws = placed.w
    left = int(0)
    for lane in range(LANES):
        v = start + wp.min(lane, size - 1)
        is_left = us[lane] < 0.0 or needs_care(field, grid, ci[lane], cj[lane], ck[lane])
        if v >= ordinary_count:
            is_left = is_left or local_inout[v][0] < -1.0
        if is_left:
            us[lane] = -1.0
            left = 1
    xs = world_lanes(wp.vec4d(matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[0, 3]), ci, cj, ck, us, vs, ws)
    ys = world_lanes(wp.vec4d(matrix[1, 0], matrix[1, 1], matrix[1, 2], matrix[1, 3]), ci, cj, ck, us, vs, ws)
    zs = world_lanes(wp.vec4d(matrix[2, 0], matrix[2, 1], matrix[2, 2], matrix[2, 3]), ci, cj, ck, us, vs, ws)
    for lane in range(size):
        local_inout[start + lane] = wp.vec3(us[lane], vs[lane], ws[lane])
        position_out[start + lane] = wp.vec3(xs[lane], ys[lane], zs[lane])
    left_out[block] = wp.uint8(left)
