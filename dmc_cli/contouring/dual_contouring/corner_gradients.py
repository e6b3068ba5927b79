"""Take the gradients of F at the corners of cells by central differences, in single precision.

A cell away from the volume's ends and from nodes without data takes them from its stored values, sixteen
cells at a time on CPU; any other one as normals do, one-sided where a neighbour is missing. The sign of F is
left out: a plane has two sides.
"""

import warp as wp

from dmc_cli.contouring.normals import is_interior
from dmc_cli.field import (
    Field,
    Grid,
    corner_differences,
    node_of_volume,
    stored_value,
)

CornerGradients = wp.types.vector(length=24, dtype=wp.float32)
"""Derivatives along x, y and z at the eight corners of a cell."""


@wp.func
def half_step(before: wp.float64, after: wp.float64) -> wp.float32:
    """Return the central difference between two values."""
    return wp.float32(wp.float64(0.5) * (after - before))


@wp.func
def interior_gradients(field: Field, grid: Grid, node: wp.vec3i) -> CornerGradients:
    """Return the derivatives at the corners of a cell that has neighbours all round."""
    b = grid.border
    row = wp.int64(grid.nx - 2 * b)
    layer = row * wp.int64(grid.ny - 2 * b)
    lowest = node_of_volume(grid, node[0] - b, node[1] - b, node[2] - b)
    found = CornerGradients()
    for c in range(8):
        at = lowest + wp.int64(c & 1) + wp.int64((c >> 1) & 1) * row + wp.int64(c >> 2) * layer
        step = wp.int64(1)
        for axis in range(3):
            found[3 * c + axis] = half_step(stored_value(field, at - step), stored_value(field, at + step))
            step = wp.where(axis == 0, row, layer)
    return found


@wp.func
def end_gradients(field: Field, grid: Grid, node: wp.vec3i, is_scaled: wp.bool) -> CornerGradients:
    """Return the derivatives at the corners of any cell, scaled by the largest where that is asked for."""
    differences = corner_differences(field, grid, node[0], node[1], node[2])
    unit = wp.where(is_scaled, wp.max(wp.abs(differences)), wp.float64(1.0))
    found = CornerGradients()
    if unit > wp.float64(0.0):
        for n in range(24):
            found[n] = wp.float32(differences[n] / unit)
    return found


@wp.func
def cell_gradients(field: Field, grid: Grid, node: wp.vec3i) -> CornerGradients:
    """Return the derivatives at the corners of any cell."""
    found = CornerGradients()
    if is_interior(field.has_nodata, grid, node[0], node[1], node[2]):
        found = interior_gradients(field, grid, node)
    else:
        found = end_gradients(field, grid, node, False)
    return found


@wp.func
def scaled_gradients(field: Field, grid: Grid, node: wp.vec3i) -> CornerGradients:
    """Return the derivatives at the corners of any cell in units of the largest of them."""
    return end_gradients(field, grid, node, True)
