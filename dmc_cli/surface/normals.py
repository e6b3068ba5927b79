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

from dmc_cli.device import ITEMS_A_SLAB
from dmc_cli.settings import SurfaceSettings
from dmc_cli.surface.field import Field, is_data, node_of_volume, node_value, stored_value
from dmc_cli.surface.grid import Grid
from dmc_cli.surface.lanes import FloatLanes, find_block_cells, load_points, store_points
from dmc_cli.surface.slices import node_distance
from dmc_cli.surface.slopes import difference, mixed, slopes_in_lanes
from dmc_cli.surface.stored import IntLanes
from dmc_cli.surface.surface import Surface
from dmc_cli.surface.words import LANES, VECTOR_FLAGS

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


NO_OFFSET = wp.constant(-(2**31))
"""Less than any offset of a block's cells."""


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
    if device.is_cpu and surface.depths.shape[0] == 0:
        blocks = -(-surface.vertices.shape[0] // LANES)
        device.launch(normal_block_kernel, blocks, inputs, [normals], 2 * ITEMS_A_SLAB // LANES)
    else:
        device.launch(compute_normals_kernel, surface.vertices.shape[0], inputs, [normals], ITEMS_A_SLAB)
    return normals


@wp.func
def square_value(
    field: Field, at: wp.int64, step_s: wp.int64, step_t: wp.int64, s: wp.float32, t: wp.float32
) -> wp.float64:
    """Interpolate the stored values of the square at node `at`, its other corners a step or both away."""
    return mixed(
        stored_value(field, at),
        stored_value(field, at + step_s),
        stored_value(field, at + step_t),
        stored_value(field, at + step_s + step_t),
        wp.float64(s),
        wp.float64(t),
    )


@wp.func
def slope(
    field: Field,
    at: wp.int64,
    along: wp.int64,
    step_s: wp.int64,
    step_t: wp.int64,
    s: wp.float32,
    t: wp.float32,
    r: wp.float32,
) -> wp.float32:
    """Return the derivative of the stored values along an axis, in steps of `along` nodes, in a cell.

    (s, t) are the local coordinates across, r the one along the axis.
    """
    return difference(
        square_value(field, at - along, step_s, step_t, s, t),
        square_value(field, at, step_s, step_t, s, t),
        square_value(field, at + along, step_s, step_t, s, t),
        square_value(field, at + wp.int64(2) * along, step_s, step_t, s, t),
        wp.float64(r),
    )


@wp.func
def has_value(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.bool:
    """Return whether a node is on the grid and, at an open border, has data."""
    found = i >= 0 and j >= 0 and k >= 0 and i < grid.nx and j < grid.ny and k < grid.nz
    if found and field.has_absent == 1 and grid.border == 0:
        found = is_data(field, stored_value(field, node_of_volume(grid, i, j, k)))
    return found


@wp.func
def node_difference(
    field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, di: wp.int32, dj: wp.int32, dk: wp.int32
) -> wp.float32:
    """Return the derivative of F at a node along (di, dj, dk): central, one-sided, or 0."""
    back = wp.where(has_value(field, grid, i - di, j - dj, k - dk), 1, 0)
    on = wp.where(has_value(field, grid, i + di, j + dj, k + dk), 1, 0)
    low = node_value(field, grid, i - back * di, j - back * dj, k - back * dk)
    high = node_value(field, grid, i + on * di, j + on * dj, k + on * dk)
    return wp.float32((high - low) / wp.float64(wp.max(back + on, 1)))


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
def is_interior(has_absent: wp.int32, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.bool:
    """Return whether cell (i, j, k) and all round it lie in the volume and count as they are stored."""
    b = grid.border
    found = i >= b + 1 and j >= b + 1 and k >= b + 1
    found = found and i < grid.nx - b - 2 and j < grid.ny - b - 2 and k < grid.nz - b - 2
    return found and has_absent == 0


@wp.func
def field_gradient(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, p: wp.vec3) -> wp.vec3:
    """Return the gradient of F at local coordinates p of cell (i, j, k), a cell being the unit of length."""
    b = grid.border
    gradient = wp.vec3(0.0, 0.0, 0.0)
    if is_interior(field.has_absent, grid, i, j, k):
        x = wp.int64(1)
        y = wp.int64(grid.nx - 2 * b)
        z = y * wp.int64(grid.ny - 2 * b)
        node = node_of_volume(grid, i - b, j - b, k - b)
        gradient = wp.float32(field.sign) * wp.vec3(
            slope(field, node, x, y, z, p[1], p[2], p[0]),
            slope(field, node, y, x, z, p[0], p[2], p[1]),
            slope(field, node, z, x, y, p[0], p[1], p[2]),
        )
    else:
        gradient = careful_gradient(field, grid, i, j, k, p)
    return gradient


@wp.func
def unit_normal(to_output: wp.mat33, gradient: wp.vec3) -> wp.vec3:
    """Return a gradient's direction in the output space."""
    x = to_output[0, 0] * gradient[0] + to_output[0, 1] * gradient[1] + to_output[0, 2] * gradient[2]
    y = to_output[1, 0] * gradient[0] + to_output[1, 1] * gradient[1] + to_output[1, 2] * gradient[2]
    z = to_output[2, 0] * gradient[0] + to_output[2, 1] * gradient[1] + to_output[2, 2] * gradient[2]
    length = wp.sqrt(x * x + y * y + z * z)
    is_long = length > 0.0
    return wp.vec3(
        wp.where(is_long, x / length, 0.0),
        wp.where(is_long, y / length, 0.0),
        wp.where(is_long, z / length, 1.0),
    )


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
    normals_out[v] = unit_normal(to_output, gradient)


@wp.kernel
def normal_block_kernel(
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
    """Compute the normals of sixteen vertices, slices even. One thread a block."""
    start = (first + wp.tid()) * LANES
    size = wp.min(LANES, cells.shape[0] - start)
    block = find_block_cells(grid, cells, start, size)
    points = load_points(locals, start, size)
    u = FloatLanes()
    v = FloatLanes()
    w = FloatLanes()
    i = block.i
    j = block.j
    k = block.k
    far = block.far
    offsets = block.offsets
    has_absent = field.has_absent
    safe = NO_OFFSET  # then that of a cell that is read in place of those that need care
    care = IntLanes()
    some_care = int(0)
    for lane in range(LANES):
        u[lane] = points[lane]
        v[lane] = points[LANES + lane]
        w[lane] = points[2 * LANES + lane]
        care[lane] = wp.where(is_interior(has_absent, grid, i[lane], j[lane], k[lane]), far[lane], 1)
        some_care |= care[lane]
        safe = wp.max(safe, wp.where(care[lane] == 1, NO_OFFSET, offsets[lane]))
    if safe != NO_OFFSET:
        for lane in range(LANES):
            offsets[lane] = wp.where(care[lane] == 1, safe, offsets[lane])
        slopes = slopes_in_lanes(field, grid, block.node, offsets, u, v, w)
        sign = wp.float32(field.sign)
        for lane in range(LANES):
            slope_here = wp.vec3(slopes[lane], slopes[LANES + lane], slopes[2 * LANES + lane])
            normal = unit_normal(to_output, sign * slope_here)
            u[lane] = normal[0]
            v[lane] = normal[1]
            w[lane] = normal[2]
    if some_care == 1:
        for lane in range(LANES):
            if care[lane] == 1:
                local = wp.vec3(points[lane], points[LANES + lane], points[2 * LANES + lane])
                gradient = field_gradient(field, grid, i[lane], j[lane], k[lane], local)
                normal = unit_normal(to_output, gradient)
                u[lane] = normal[0]
                v[lane] = normal[1]
                w[lane] = normal[2]
    store_points(u, v, w, start, size, normals_out)
