"""Take central differences of F at the corners of any cell, beside missing and virtual nodes too.

The nodes round a cell, four along each axis, are read once. At the grid's border, and beside a node without
data, the difference is one-sided with the divisor that belongs to it.
"""

import warp as wp

from dmc_cli.field.field import Field, is_data, value_of_node
from dmc_cli.field.grid import Grid
from dmc_cli.field.sample_reader import AxisOffsets, cube_at

X_LAYER = wp.constant(wp.int64(0x1111111111111111))
Y_LAYER = wp.constant(wp.int64(0x000F000F000F000F))
Z_LAYER = wp.constant(wp.int64(0x000000000000FFFF))
"""Of the 64 nodes round a cell, a bit each, those of the first layer across each axis."""

LOWEST_CORNER = wp.constant(21)
"""The number among the 64 nodes of the cell's own lowest corner."""

CornerDifferences = wp.types.vector(length=24, dtype=wp.float64)
"""Derivatives along x, y and z at the eight corners of a cell."""


@wp.func
def axis_offsets(at: wp.int32, border: wp.int32, size: wp.int32, stride: wp.int64) -> AxisOffsets:
    """Return how many nodes of the volume lie before each of the four layers round node `at` of the grid."""
    offsets = AxisOffsets()
    for n in range(4):
        offsets[n] = stride * wp.int64(wp.clamp(at - 1 + n - border, 0, size - 1 - 2 * border))
    return offsets


@wp.func
def on_axis(layer: wp.int64, stride: wp.int32, at: wp.int32, size: wp.int32) -> wp.int64:
    """Return the bits of the nodes round node `at` that lie between 0 and `size` along an axis.

    `layer` are the bits of the first of the four layers across it.
    """
    bits = wp.int64(-1)
    if at <= 0:
        bits &= ~layer
    if at < 0:
        bits &= ~(layer << wp.int64(stride))
    if at + 1 >= size:
        bits &= ~(layer << wp.int64(2 * stride))
    if at + 2 >= size:
        bits &= ~(layer << wp.int64(3 * stride))
    return bits


@wp.func
def inside_box(i: wp.int32, j: wp.int32, k: wp.int32, nx: wp.int32, ny: wp.int32, nz: wp.int32) -> wp.int64:
    """Return the bits of the nodes round node (i, j, k) that lie in a box of nodes."""
    return on_axis(X_LAYER, 1, i, nx) & on_axis(Y_LAYER, 4, j, ny) & on_axis(Z_LAYER, 16, k, nz)


@wp.func
def bit_of(bits: wp.int64, n: wp.int32) -> wp.int32:
    """Return bit n of `bits`, 0 or 1."""
    return wp.int32((bits >> wp.int64(n)) & wp.int64(1))


@wp.func
def corner_difference(
    present: wp.int64, n: wp.int32, stride: wp.int32, before: wp.float64, here: wp.float64, after: wp.float64
) -> wp.float64:
    """Return the derivative of F at node n along an axis: central, one-sided, or 0."""
    back = bit_of(present, n - stride)
    on = bit_of(present, n + stride)
    low = wp.where(back == 1, before, here)
    high = wp.where(on == 1, after, here)
    return (high - low) / wp.float64(wp.max(back + on, 1))


@wp.func
def corner_differences(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> CornerDifferences:
    """Return the derivatives of F along x, y and z at the corners of cell (i, j, k)."""
    b = grid.border
    nx = grid.nx - 2 * b
    ny = grid.ny - 2 * b
    nz = grid.nz - 2 * b
    row = wp.int64(nx)
    x = axis_offsets(i, b, grid.nx, wp.int64(1))
    y = axis_offsets(j, b, grid.ny, row)
    z = axis_offsets(k, b, grid.nz, row * wp.int64(ny))
    values = cube_at(field.values, field.kind, x, y, z)
    present = inside_box(i, j, k, grid.nx, grid.ny, grid.nz)
    stored = inside_box(i - b, j - b, k - b, nx, ny, nz)
    if field.has_nodata == 1 and b == 0:
        for n in range(64):
            if not is_data(field, values[n]):
                present &= ~(wp.int64(1) << wp.int64(n))
    for n in range(64):
        values[n] = value_of_node(field, b, values[n], 1 - bit_of(stored, n))
    found = CornerDifferences()
    for c in range(8):
        n = LOWEST_CORNER + (c & 1) + ((c >> 1) & 1) * 4 + (c >> 2) * 16
        here = values[n]
        found[3 * c] = corner_difference(present, n, 1, values[n - 1], here, values[n + 1])
        found[3 * c + 1] = corner_difference(present, n, 4, values[n - 4], here, values[n + 4])
        found[3 * c + 2] = corner_difference(present, n, 16, values[n - 16], here, values[n + 16])
    return found


@wp.func
def gradient_from_corners(differences: CornerDifferences, p: wp.vec3) -> wp.vec3:
    """Interpolate the derivatives at a cell's corners at its local coordinates p."""
    gradient = wp.vec3(0.0, 0.0, 0.0)
    for c in range(8):
        weight = wp.where((c & 1) == 1, p[0], 1.0 - p[0])
        weight *= wp.where(((c >> 1) & 1) == 1, p[1], 1.0 - p[1])
        weight *= wp.where((c >> 2) == 1, p[2], 1.0 - p[2])
        along_x = wp.float32(differences[3 * c])
        along_y = wp.float32(differences[3 * c + 1])
        along_z = wp.float32(differences[3 * c + 2])
        gradient += weight * wp.vec3(along_x, along_y, along_z)
    return gradient
