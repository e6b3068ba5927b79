"""Compute vertex normals: central differences at the nodes, interpolated trilinearly in the cell.

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

from dmc_cli.array_types import FloatArray
from dmc_cli.bits import LANES, VECTOR_FLAGS
from dmc_cli.field import (
    Field,
    FloatLanes,
    Grid,
    IntLanes,
    cell_node,
    corner_differences,
    difference,
    find_block_cells,
    gradient_from_corners,
    load_points,
    mixed,
    node_distance,
    node_of_volume,
    slopes_in_lanes,
    store_points,
    stored_value,
)
from dmc_cli.mesh import Placement, require_placement
from dmc_cli.runtime import ITEMS_A_CHUNK
from dmc_cli.settings import SurfaceSettings

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


def compute_normals(placement: Placement, settings: SurfaceSettings) -> Any:
    """Return the unit normals of the surface at its vertices in the output space, float32 vec3 (V,).

    They point towards lower values, or with `orientation` gradient or `inside` below towards higher ones.

    Raises:
        CallError: It is no placement.
    """
    frame, count = require_placement(placement).frame, placement.cell.shape[0]
    device = frame.device
    normals = device.empty(count, wp.vec3)
    towards_higher = settings.orientation == "gradient" or settings.inside == "below"
    to_output = _in_reach(np.linalg.inv(frame.affine[:3, :3]).T * (1.0 if towards_higher else -1.0))
    inputs = [
        frame.grid.struct(),
        frame.field,
        wp.mat33(*to_output.ravel()),
        frame.depths,
        placement.cell,
        placement.local,
    ]
    if device.is_cpu and frame.depths.shape[0] == 0:
        blocks, grain = -(-count // LANES), 2 * ITEMS_A_CHUNK // LANES
        left = device.empty(blocks, wp.int32)
        device.launch(normal_block_kernel, blocks, inputs, [normals, left], grain)
        # what is left lies close together: small chunks share it evenly
        device.launch(normals_left_kernel, blocks, [*inputs, left], [normals], grain, longest=grain)
    else:
        device.launch(compute_normals_kernel, count, inputs, [normals], ITEMS_A_CHUNK)
    return normals


def _in_reach(matrix: FloatArray) -> FloatArray:
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
def is_interior(has_nodata: wp.int32, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.bool:
    """Return whether cell (i, j, k) and all round it lie in the volume and count as they are stored."""
    b = grid.border
    found = i >= b + 1 and j >= b + 1 and k >= b + 1
    found = found and i < grid.nx - b - 2 and j < grid.ny - b - 2 and k < grid.nz - b - 2
    return found and has_nodata == 0


@wp.func
def field_gradient(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, p: wp.vec3) -> wp.vec3:
    """Return the gradient of F at local coordinates p of cell (i, j, k), a cell being the unit of length."""
    b = grid.border
    gradient = wp.vec3(0.0, 0.0, 0.0)
    if is_interior(field.has_nodata, grid, i, j, k):
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
        gradient = gradient_from_corners(corner_differences(field, grid, i, j, k), p)
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
    cell: wp.int64,
    p: wp.vec3,
) -> wp.vec3:
    """Return the normal at local coordinates p of a cell."""
    node = cell_node(grid, cell)
    step = slice_step(depths, node[2], p[2])
    gradient = field_gradient(field, grid, node[0], node[1], node[2], p)
    gradient[2] = gradient[2] / step
    found = output_gradient(to_output, gradient)
    if is_out_of_reach(square_of(found)) == 1:
        differences = corner_differences(field, grid, node[0], node[1], node[2])
        unit = wp.max(wp.abs(differences))
        entry = wp.max(
            wp.max(wp.abs(to_output[0])), wp.max(wp.max(wp.abs(to_output[1])), wp.max(wp.abs(to_output[2])))
        )
        size = unit * wp.float64(entry)
        if unit > wp.float64(0.0) and (size < LEAST_STEP or size > LARGEST_STEP):
            gradient = gradient_from_corners(differences / unit, p)
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
    local: wp.array(dtype=wp.vec3),
    # Out:
    normals_out: wp.array(dtype=wp.vec3),
) -> None:
    """Compute the normals. One thread a vertex."""
    v = first + wp.tid()
    normals_out[v] = normal_at(field, grid, to_output, depths, cells[v], local[v])


@wp.kernel
def normal_block_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    to_output: wp.mat33,
    depths: wp.array(dtype=wp.float64),
    cells: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    # Out:
    normals_out: wp.array(dtype=wp.vec3),
    left_out: wp.array(dtype=wp.int32),
) -> None:
    """Compute the normals of sixteen vertices, slices even, and tell which are left. One thread a block."""
    start = (first + wp.tid()) * LANES
    size = wp.min(LANES, cells.shape[0] - start)
    block = find_block_cells(grid, cells, start, size)
    points = load_points(local, start, size)
    u = FloatLanes()
    v = FloatLanes()
    w = FloatLanes()
    i = block.i
    j = block.j
    k = block.k
    far = block.far
    offsets = block.offsets
    has_nodata = field.has_nodata
    safe = NO_OFFSET  # then that of a cell that is read in place of those that need care
    care = IntLanes()
    some_care = int(0)
    some_out = int(0)
    for lane in range(LANES):
        u[lane] = points[lane]
        v[lane] = points[LANES + lane]
        w[lane] = points[2 * LANES + lane]
        care[lane] = wp.where(is_interior(has_nodata, grid, i[lane], j[lane], k[lane]), far[lane], 1)
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
    store_points(u, v, w, start, size, normals_out)
    left = int(0)
    if some_care == 1 or some_out == 1:
        for lane in range(LANES):
            left |= wp.where(some_out == 1, 1, care[lane]) << lane
    left_out[first + wp.tid()] = left


@wp.kernel
def normals_left_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    to_output: wp.mat33,
    depths: wp.array(dtype=wp.float64),
    cells: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    left: wp.array(dtype=wp.int32),
    # Out:
    normals_out: wp.array(dtype=wp.vec3),
) -> None:
    """Compute the normals of the vertices that are left, a bit each. One thread a block."""
    start = (first + wp.tid()) * LANES
    bits = left[first + wp.tid()]
    for lane in range(wp.where(bits == 0, 0, wp.min(LANES, cells.shape[0] - start))):
        if ((bits >> lane) & 1) == 1:
            v = start + lane
            normals_out[v] = normal_at(field, grid, to_output, depths, cells[v], local[v])
