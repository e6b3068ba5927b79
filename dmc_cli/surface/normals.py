# Typed by Warp's own compiler.
# mypy: ignore-errors
"""Vertex normals: central differences at the nodes, interpolated trilinearly in the cell.

Central differences have a smaller truncation error than the interpolant's own gradient and give smoother
shading (Grosso & Zint 2021, section 3.1.2). At the grid's border, and beside a node without data, the
difference is one-sided with the divisor that belongs to it. A normal goes to the output space by the
inverse transpose of the affine and has unit length; where the gradient vanishes it is (0, 0, 1).
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.settings import SurfaceSettings
from dmc_cli.surface.field import (
    FLOAT32,
    INT8,
    INT16,
    INT32,
    UINT8,
    UINT16,
    UINT32,
    Field,
    is_data,
    node_value,
    stored_value,
)
from dmc_cli.surface.grid import Grid
from dmc_cli.surface.slices import node_distance
from dmc_cli.surface.surface import Surface

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


def compute_normals(surface: Surface, settings: SurfaceSettings) -> Any:
    """Return the unit normals of a surface's vertices in the output space, float32 vec3 (V,).

    They point towards lower values, or with `orientation` gradient or `inside` below towards higher ones.
    """
    device = surface.device
    normals = device.empty(surface.vertices.shape[0], wp.vec3)
    towards_higher = settings.orientation == "gradient" or settings.inside == "below"
    to_output = np.linalg.inv(surface.affine[:3, :3]).T * (1.0 if towards_higher else -1.0)
    inputs = [
        surface.grid.struct(),
        surface.field,
        wp.mat33(*to_output.ravel()),
        surface.depths,
        surface.vertex_cell,
        surface.vertex_local,
    ]
    device.launch(compute_normals_kernel, surface.vertices.shape[0], inputs, [normals])
    return normals


@wp.func
def mixed_along_row(
    values: wp.array2d(dtype=Any), row: wp.int32, ny: wp.int32, i: wp.int32, v: wp.float32, w: wp.float32
) -> wp.float64:
    """Interpolate between the nodes i of four rows round a cell, at (v, w) of their square."""
    a = wp.float64(values[row, i])
    b = wp.float64(values[row + 1, i])
    c = wp.float64(values[row + ny, i])
    d = wp.float64(values[row + ny + 1, i])
    s = wp.float64(v)
    low = a + s * (b - a)
    high = c + s * (d - c)
    return low + wp.float64(w) * (high - low)


@wp.func
def mixed_across(
    values: wp.array2d(dtype=Any), row: wp.int32, step: wp.int32, i: wp.int32, u: wp.float32, t: wp.float32
) -> wp.float64:
    """Interpolate between the nodes i and i + 1 of rows `row` and `row + step`, at (u, t)."""
    a = wp.float64(values[row, i])
    b = wp.float64(values[row, i + 1])
    c = wp.float64(values[row + step, i])
    d = wp.float64(values[row + step, i + 1])
    s = wp.float64(u)
    low = a + s * (b - a)
    high = c + s * (d - c)
    return low + wp.float64(t) * (high - low)


@wp.func
def difference(
    before: wp.float64, at_0: wp.float64, at_1: wp.float64, after: wp.float64, t: wp.float32
) -> wp.float32:
    """Interpolate between the central differences at positions 0 and 1, t of the way."""
    low = at_1 - before
    high = after - at_0
    return wp.float32(wp.float64(0.5) * (low + wp.float64(t) * (high - low)))


@wp.func
def interior_gradient(
    values: wp.array2d(dtype=Any), row: wp.int32, ny: wp.int32, i: wp.int32, p: wp.vec3
) -> wp.vec3:
    """Return the gradient in a cell whose neighbours all exist; row is the volume's, ny rows a layer."""
    u = p[0]
    v = p[1]
    w = p[2]
    layer = ny
    gx = difference(
        mixed_along_row(values, row, ny, i - 1, v, w),
        mixed_along_row(values, row, ny, i, v, w),
        mixed_along_row(values, row, ny, i + 1, v, w),
        mixed_along_row(values, row, ny, i + 2, v, w),
        u,
    )
    gy = difference(
        mixed_across(values, row - 1, layer, i, u, w),
        mixed_across(values, row, layer, i, u, w),
        mixed_across(values, row + 1, layer, i, u, w),
        mixed_across(values, row + 2, layer, i, u, w),
        v,
    )
    gz = difference(
        mixed_across(values, row - layer, 1, i, u, v),
        mixed_across(values, row, 1, i, u, v),
        mixed_across(values, row + layer, 1, i, u, v),
        mixed_across(values, row + 2 * layer, 1, i, u, v),
        w,
    )
    return wp.vec3(gx, gy, gz)


@wp.func
def has_value(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.bool:
    """Return whether a node is on the grid and, at an open border, has data."""
    found = i >= 0 and j >= 0 and k >= 0 and i < grid.nx and j < grid.ny and k < grid.nz
    if found and field.has_absent == 1 and grid.border == 0:
        found = is_data(field, stored_value(field, j + grid.ny * k, i))
    return found


@wp.func
def node_difference(
    field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, di: wp.int32, dj: wp.int32, dk: wp.int32
) -> wp.float32:
    """Return the derivative of F at a node along (di, dj, dk): central, one-sided, or 0."""
    here = node_value(field, grid, i, j, k)
    low = here
    high = here
    distance = wp.float64(0.0)
    if has_value(field, grid, i - di, j - dj, k - dk):
        low = node_value(field, grid, i - di, j - dj, k - dk)
        distance += wp.float64(1.0)
    if has_value(field, grid, i + di, j + dj, k + dk):
        high = node_value(field, grid, i + di, j + dj, k + dk)
        distance += wp.float64(1.0)
    return wp.float32((high - low) / wp.max(distance, wp.float64(1.0)))


@wp.func
def careful_gradient(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, p: wp.vec3) -> wp.vec3:
    """Return the gradient of F in a cell whose neighbours may be missing."""
    gradient = wp.vec3(0.0, 0.0, 0.0)
    for c in range(8):
        ci = c & 1
        cj = (c >> 1) & 1
        ck = c >> 2
        weight = wp.where(ci == 1, p[0], 1.0 - p[0])
        weight *= wp.where(cj == 1, p[1], 1.0 - p[1])
        weight *= wp.where(ck == 1, p[2], 1.0 - p[2])
        gradient += weight * wp.vec3(
            node_difference(field, grid, i + ci, j + cj, k + ck, 1, 0, 0),
            node_difference(field, grid, i + ci, j + cj, k + ck, 0, 1, 0),
            node_difference(field, grid, i + ci, j + cj, k + ck, 0, 0, 1),
        )
    return gradient


@wp.func
def field_gradient(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, p: wp.vec3) -> wp.vec3:
    """Return the gradient of F at local coordinates p of cell (i, j, k), a cell being the unit of length."""
    b = grid.border
    gradient = wp.vec3(0.0, 0.0, 0.0)
    is_interior = i >= b + 1 and j >= b + 1 and k >= b + 1
    is_interior = is_interior and i < grid.nx - b - 2 and j < grid.ny - b - 2 and k < grid.nz - b - 2
    if is_interior and field.has_absent == 0:
        ny = grid.ny - 2 * b
        row = j - b + ny * (k - b)
        x = i - b
        if field.kind == INT16:
            gradient = interior_gradient(field.i16, row, ny, x, p)
        elif field.kind == UINT8:
            gradient = interior_gradient(field.u8, row, ny, x, p)
        elif field.kind == FLOAT32:
            gradient = interior_gradient(field.f32, row, ny, x, p)
        elif field.kind == UINT16:
            gradient = interior_gradient(field.u16, row, ny, x, p)
        elif field.kind == INT8:
            gradient = interior_gradient(field.i8, row, ny, x, p)
        elif field.kind == INT32:
            gradient = interior_gradient(field.i32, row, ny, x, p)
        elif field.kind == UINT32:
            gradient = interior_gradient(field.u32, row, ny, x, p)
        else:
            gradient = interior_gradient(field.f64, row, ny, x, p)
        gradient *= wp.float32(field.sign)
    else:
        gradient = careful_gradient(field, grid, i, j, k, p)
    return gradient


@wp.kernel
def compute_normals_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    to_output: wp.mat33,
    depths: wp.array(dtype=wp.float64),
    cells: wp.array(dtype=wp.int64),
    locals: wp.array(dtype=wp.vec3),
    # Out:
    normals_out: wp.array(dtype=wp.vec3),
):
    """Compute the normals. One thread a vertex."""
    v = first + wp.tid()
    row = wp.int32(cells[v] / wp.int64(grid.nx))
    i = wp.int32(cells[v] - wp.int64(row) * wp.int64(grid.nx))
    k = row // grid.ny
    gradient = field_gradient(field, grid, i, row % grid.ny, k, locals[v])
    if depths.shape[0] > 0:
        low = wp.float32(node_distance(depths, k))
        gradient[2] = gradient[2] / (low + locals[v][2] * (wp.float32(node_distance(depths, k + 1)) - low))
    normal = to_output * gradient
    length = wp.length(normal)
    normals_out[v] = wp.where(length > 0.0, normal / length, wp.vec3(0.0, 0.0, 1.0))
