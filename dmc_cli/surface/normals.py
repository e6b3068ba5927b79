# Typed by Warp's own compiler.
# mypy: ignore-errors
"""Vertex normals: central differences at the nodes, interpolated trilinearly in the cell.

Central differences have a smaller truncation error than the interpolant's own gradient and give smoother
shading (Grosso & Zint 2021, section 3.1.2). At the grid's border, and beside a node without data, the
difference is one-sided with the divisor that belongs to it. A normal goes to the output space by the
inverse transpose of the affine and has unit length; where the gradient vanishes it is (0, 0, 1).

In single precision the square of a gradient's length may be too small or too large for a number. Then the
gradient is taken once more, in units of the largest difference.
"""

import math
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.device import ITEMS_A_CHUNK
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

LEAST_SQUARE, LARGEST_SQUARE = wp.constant(2.0**-126), wp.constant(3.0e38)
"""Between these a square is a float32 number with all its digits."""

LEAST_STEP, LARGEST_STEP = wp.constant(wp.float64(1.0e-10)), wp.constant(wp.float64(1.0e15))
"""Differences between these need no other unit: where they cancel each other, it would change nothing."""

MOST_DOUBLINGS = 100
"""Of a matrix whose numbers float32 may not hold, by more than that many powers of two off 1."""


def compute_normals(surface: Surface, settings: SurfaceSettings) -> Any:
    """Return the unit normals of a surface's vertices in the output space, float32 vec3 (V,).

    They point towards lower values, or with `orientation` gradient or `inside` below towards higher ones.
    """
    device = surface.device
    normals = device.empty(surface.vertices.shape[0], wp.vec3)
    towards_higher = settings.orientation == "gradient" or settings.inside == "below"
    to_output = _in_reach(np.linalg.inv(surface.affine[:3, :3]).T * (1.0 if towards_higher else -1.0))
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
        device.launch(normal_block_kernel, blocks, inputs, [normals], 2 * ITEMS_A_CHUNK // LANES)
    else:
        device.launch(compute_normals_kernel, surface.vertices.shape[0], inputs, [normals], ITEMS_A_CHUNK)
    return normals


def _in_reach(matrix: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return a matrix, times a power of two where its numbers are far beyond those of float32."""
    exponent = math.frexp(float(np.abs(matrix).max()))[1]
    return np.ldexp(matrix, -exponent) if abs(exponent) > MOST_DOUBLINGS else matrix


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
) -> wp.float64:
    """Return the derivative of F at a node along (di, dj, dk): central, one-sided, or 0."""
    back = wp.where(has_value(field, grid, i - di, j - dj, k - dk), 1, 0)
    on = wp.where(has_value(field, grid, i + di, j + dj, k + dk), 1, 0)
    low = node_value(field, grid, i - back * di, j - back * dj, k - back * dk)
    high = node_value(field, grid, i + on * di, j + on * dj, k + on * dk)
    return (high - low) / wp.float64(wp.max(back + on, 1))


@wp.func
def largest_difference(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.float64:
    """Return the size of the largest derivative of F along an axis at the corners of a cell."""
    largest = wp.float64(0.0)
    for c in range(8):
        for axis in range(3):
            step = node_difference(
                field,
                grid,
                i + (c & 1),
                j + ((c >> 1) & 1),
                k + (c >> 2),
                wp.where(axis == 0, 1, 0),
                wp.where(axis == 1, 1, 0),
                wp.where(axis == 2, 1, 0),
            )
            largest = wp.max(largest, wp.abs(step))
    return largest


@wp.func
def careful_gradient(
    field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, p: wp.vec3, unit: wp.float64
) -> wp.vec3:
    """Return the gradient of F, in a unit, in a cell whose neighbours may be missing."""
    gradient = wp.vec3(0.0, 0.0, 0.0)
    for c in range(8):
        ci = c & 1
        cj = (c >> 1) & 1
        ck = c >> 2
        weight = wp.where(ci == 1, p[0], 1.0 - p[0])
        weight *= wp.where(cj == 1, p[1], 1.0 - p[1])
        weight *= wp.where(ck == 1, p[2], 1.0 - p[2])
        x = node_difference(field, grid, i + ci, j + cj, k + ck, 1, 0, 0)
        y = node_difference(field, grid, i + ci, j + cj, k + ck, 0, 1, 0)
        z = node_difference(field, grid, i + ci, j + cj, k + ck, 0, 0, 1)
        if unit != wp.float64(1.0):  # three divisions take longer than the rest
            x /= unit
            y /= unit
            z /= unit
        gradient += weight * wp.vec3(wp.float32(x), wp.float32(y), wp.float32(z))
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
        gradient = careful_gradient(field, grid, i, j, k, p, wp.float64(1.0))
    return gradient


@wp.func
def output_gradient(to_output: wp.mat33, gradient: wp.vec3) -> wp.vec3:
    """Return a gradient in the output space."""
    x = to_output[0, 0] * gradient[0] + to_output[0, 1] * gradient[1] + to_output[0, 2] * gradient[2]
    y = to_output[1, 0] * gradient[0] + to_output[1, 1] * gradient[1] + to_output[1, 2] * gradient[2]
    z = to_output[2, 0] * gradient[0] + to_output[2, 1] * gradient[1] + to_output[2, 2] * gradient[2]
    return wp.vec3(x, y, z)


@wp.func
def square_of(g: wp.vec3) -> wp.float32:
    """Return the square of a gradient's length."""
    return g[0] * g[0] + g[1] * g[1] + g[2] * g[2]


@wp.func
def unit_normal(g: wp.vec3) -> wp.vec3:
    """Return a gradient's direction."""
    length = wp.sqrt(square_of(g))
    is_long = length > 0.0
    return wp.vec3(
        wp.where(is_long, g[0] / length, 0.0),
        wp.where(is_long, g[1] / length, 0.0),
        wp.where(is_long, g[2] / length, 1.0),
    )


@wp.func
def is_out_of_reach(square: wp.float32) -> wp.int32:
    """Return 1 if a square is no float32 number with all its digits, else 0."""
    return wp.where(square >= LEAST_SQUARE, wp.where(square <= LARGEST_SQUARE, 0, 1), 1)


@wp.func
def slice_step(depths: wp.array(dtype=wp.float64), k: wp.int32, w: wp.float32) -> wp.float32:
    """Return what one step of k means in a cell of layer k, between its slices; 1 where they are even."""
    step = float(1.0)
    if depths.shape[0] > 0:
        low = wp.float32(node_distance(depths, k))
        step = low + w * (wp.float32(node_distance(depths, k + 1)) - low)
    return step


@wp.func
def normal_at(
    field: Field,
    grid: Grid,
    to_output: wp.mat33,
    depths: wp.array(dtype=wp.float64),
    i: wp.int32,
    j: wp.int32,
    k: wp.int32,
    p: wp.vec3,
) -> wp.vec3:
    """Return the normal at local coordinates p of cell (i, j, k)."""
    step = slice_step(depths, k, p[2])
    gradient = field_gradient(field, grid, i, j, k, p)
    gradient[2] = gradient[2] / step
    found = output_gradient(to_output, gradient)
    if is_out_of_reach(square_of(found)) == 1:
        unit = largest_difference(field, grid, i, j, k)
        entry = wp.max(
            wp.max(wp.abs(to_output[0])), wp.max(wp.max(wp.abs(to_output[1])), wp.max(wp.abs(to_output[2])))
        )
        size = unit * wp.float64(entry)
        if unit > wp.float64(0.0) and (size < LEAST_STEP or size > LARGEST_STEP):
            gradient = careful_gradient(field, grid, i, j, k, p, unit)
            gradient[2] = gradient[2] / step
            found = output_gradient((1.0 / entry) * to_output, gradient)
    return unit_normal(found)


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
    normals_out[v] = normal_at(field, grid, to_output, depths, i, row % grid.ny, k, locals[v])


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
    some_out = int(0)
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
            gradient = output_gradient(to_output, sign * slope_here)
            some_out |= is_out_of_reach(square_of(gradient))
            normal = unit_normal(gradient)
            u[lane] = normal[0]
            v[lane] = normal[1]
            w[lane] = normal[2]
    if some_care == 1 or some_out == 1:
        for lane in range(LANES):
            if care[lane] == 1 or some_out == 1:
                local = wp.vec3(points[lane], points[LANES + lane], points[2 * LANES + lane])
                normal = normal_at(field, grid, to_output, depths, i[lane], j[lane], k[lane], local)
                u[lane] = normal[0]
                v[lane] = normal[1]
                w[lane] = normal[2]
    store_points(u, v, w, start, size, normals_out)
