"""Vertices of ordinary cells on CPU: sixteen at a time, so that the compiler can use vector instructions.

The arithmetic is that of `placement`; only the loops are turned inside out. Corner values are gathered into
lanes, one loop without a branch places all lanes, and the few that it cannot place are done one by one.
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
    cell_values,
    needs_care,
)
from dmc_cli.surface.grid import Grid, world_coordinate
from dmc_cli.surface.placement import crossed_edges, place_vertex, solve_on_steepest_axis
from dmc_cli.surface.trilinear import CornerValues, CornerValues64, single_precision

VECTOR_FLAGS = f"{wp.config.cpu_compiler_flags} -mprefer-vector-width=512"
"""Warp's own flags, and leave to use the widest vector registers there are."""

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

LANES = 16
"""Vertices a block: one or two vector registers of float32."""

IntLanes = wp.types.vector(length=LANES, dtype=wp.int32)
FloatLanes = wp.types.vector(length=LANES, dtype=wp.float32)
DoubleLanes = wp.types.vector(length=LANES, dtype=wp.float64)


@wp.struct
class CornerLanes:
    """Values at the corners of the cells of a block, one lane a cell."""

    c0: DoubleLanes
    c1: DoubleLanes
    c2: DoubleLanes
    c3: DoubleLanes
    c4: DoubleLanes
    c5: DoubleLanes
    c6: DoubleLanes
    c7: DoubleLanes


@wp.func
def gather_corners(
    values: wp.array2d(dtype=Any), rows: IntLanes, columns: IntLanes, ny: wp.int32
) -> CornerLanes:
    """Return the stored values at the corners of cells; rows and columns are the volume's."""
    corners = CornerLanes()
    for lane in range(LANES):
        row = rows[lane]
        i = columns[lane]
        corners.c0[lane] = wp.float64(values[row, i])
        corners.c1[lane] = wp.float64(values[row, i + 1])
        corners.c2[lane] = wp.float64(values[row + 1, i])
        corners.c3[lane] = wp.float64(values[row + 1, i + 1])
        corners.c4[lane] = wp.float64(values[row + ny, i])
        corners.c5[lane] = wp.float64(values[row + ny, i + 1])
        corners.c6[lane] = wp.float64(values[row + ny + 1, i])
        corners.c7[lane] = wp.float64(values[row + ny + 1, i + 1])
    return corners


@wp.func
def stored_corners(field: Field, rows: IntLanes, columns: IntLanes, ny: wp.int32) -> CornerLanes:
    """Return the stored values at the corners of cells, whatever their type."""
    corners = CornerLanes()
    if field.kind == INT16:
        corners = gather_corners(field.i16, rows, columns, ny)
    elif field.kind == UINT8:
        corners = gather_corners(field.u8, rows, columns, ny)
    elif field.kind == FLOAT32:
        corners = gather_corners(field.f32, rows, columns, ny)
    elif field.kind == UINT16:
        corners = gather_corners(field.u16, rows, columns, ny)
    elif field.kind == INT8:
        corners = gather_corners(field.i8, rows, columns, ny)
    elif field.kind == INT32:
        corners = gather_corners(field.i32, rows, columns, ny)
    elif field.kind == UINT32:
        corners = gather_corners(field.u32, rows, columns, ny)
    else:
        corners = gather_corners(field.f64, rows, columns, ny)
    return corners


@wp.kernel
def place_block_kernel(
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
    """Place the vertices of a block of ordinary cells. One thread a block."""
    block = first + wp.tid()
    start = block * LANES
    size = wp.min(LANES, count - start)
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
        if cell >= row_end:
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
    corners = stored_corners(field, rows, columns, ny)
    # lanes by themselves: a struct would be copied whole for each element that a loop reads
    c0 = corners.c0
    c1 = corners.c1
    c2 = corners.c2
    c3 = corners.c3
    c4 = corners.c4
    c5 = corners.c5
    c6 = corners.c6
    c7 = corners.c7
    f0 = FloatLanes()
    f1 = FloatLanes()
    f2 = FloatLanes()
    f3 = FloatLanes()
    f4 = FloatLanes()
    f5 = FloatLanes()
    f6 = FloatLanes()
    f7 = FloatLanes()
    sign = field.sign
    isovalue = field.isovalue
    m00 = matrix[0, 0]
    m01 = matrix[0, 1]
    m02 = matrix[0, 2]
    m03 = matrix[0, 3]
    m10 = matrix[1, 0]
    m11 = matrix[1, 1]
    m12 = matrix[1, 2]
    m13 = matrix[1, 3]
    m20 = matrix[2, 0]
    m21 = matrix[2, 1]
    m22 = matrix[2, 2]
    m23 = matrix[2, 3]
    for lane in range(LANES):
        scaled = single_precision(
            CornerValues64(
                sign * (c0[lane] - isovalue),
                sign * (c1[lane] - isovalue),
                sign * (c2[lane] - isovalue),
                sign * (c3[lane] - isovalue),
                sign * (c4[lane] - isovalue),
                sign * (c5[lane] - isovalue),
                sign * (c6[lane] - isovalue),
                sign * (c7[lane] - isovalue),
            )
        )
        f0[lane] = scaled[0]
        f1[lane] = scaled[1]
        f2[lane] = scaled[2]
        f3[lane] = scaled[3]
        f4[lane] = scaled[4]
        f5[lane] = scaled[5]
        f6[lane] = scaled[6]
        f7[lane] = scaled[7]
    us = FloatLanes()
    vs = FloatLanes()
    ws = FloatLanes()
    for lane in range(LANES):
        f = CornerValues(f0[lane], f1[lane], f2[lane], f3[lane], f4[lane], f5[lane], f6[lane], f7[lane])
        q = solve_on_steepest_axis(f, crossed_edges(f))
        us[lane] = q[0]
        vs[lane] = q[1]
        ws[lane] = q[2]
    fallbacks = int(0)
    for lane in range(size):
        if us[lane] < 0.0 or needs_care(field, grid, ci[lane], cj[lane], ck[lane]):
            f = single_precision(cell_values(field, grid, ci[lane], cj[lane], ck[lane]))
            p = place_vertex(f, crossed_edges(f))
            us[lane] = p[0]
            vs[lane] = p[1]
            ws[lane] = p[2]
            fallbacks += int(p[3])
    xs = FloatLanes()
    ys = FloatLanes()
    zs = FloatLanes()
    for lane in range(LANES):
        x = wp.float64(ci[lane]) + wp.float64(us[lane])
        y = wp.float64(cj[lane]) + wp.float64(vs[lane])
        z = wp.float64(ck[lane]) + wp.float64(ws[lane])
        xs[lane] = world_coordinate(m00, m01, m02, m03, x, y, z)
        ys[lane] = world_coordinate(m10, m11, m12, m13, x, y, z)
        zs[lane] = world_coordinate(m20, m21, m22, m23, x, y, z)
    for lane in range(size):
        local_out[start + lane] = wp.vec3(us[lane], vs[lane], ws[lane])
        position_out[start + lane] = wp.vec3(xs[lane], ys[lane], zs[lane])
    fallbacks_out[block] = wp.int64(fallbacks)
