"""Project points that have left the trilinear isosurface back on it (`--project`).

The papers leave the vertex of a removed quad midway between two others. From there Newton's method along the
gradient leads through one cell or a few; there the trilinear equation is solved along the axis of the largest
gradient component, on which it is linear. What does not arrive within one cell of its start is not found.

A point is a cell and local coordinates in it, as everywhere.
"""

import warp as wp

from dmc_cli.field.field import Field, cell_values, is_data, node_of_volume, stored_value
from dmc_cli.field.grid import Grid, node_position
from dmc_cli.field.trilinear import (
    CornerValues,
    is_in_cell,
    newton_step,
    single_precision,
    solve_along,
    trilinear_gradient,
    trilinear_value,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

STEPS = 12
"""Newton steps at most; on a smooth field one leads so near that the solution along an axis does the rest."""

REACH = 1.0
"""How far, in cells along an axis, the point may be from its start: beyond lies another sheet."""

OVERSHOOT = 0.25
"""How far into the neighbouring cell a step may lead before its values are looked at."""


@wp.struct
class GridPoint:
    """A point of a grid: the lowest node of its cell, local coordinates, and whether there is one."""

    cell: wp.vec3i
    local: wp.vec3
    is_found: wp.bool


@wp.func
def cell_index(x: wp.float64, nodes: wp.int32) -> wp.int32:
    """Return the index of the cell at a coordinate, the nearest one off the grid."""
    return wp.clamp(wp.int32(wp.floor(x)), 0, nodes - 2)


@wp.func
def point_at(grid: Grid, x: wp.vec3d) -> GridPoint:
    """Return the point at coordinates in node indices; off the grid its local coordinates leave [0, 1]."""
    point = GridPoint()
    point.cell = wp.vec3i(cell_index(x[0], grid.nx), cell_index(x[1], grid.ny), cell_index(x[2], grid.nz))
    point.local = wp.vec3(
        wp.float32(x[0] - wp.float64(point.cell[0])),
        wp.float32(x[1] - wp.float64(point.cell[1])),
        wp.float32(x[2] - wp.float64(point.cell[2])),
    )
    return point


@wp.func
def cell_exists(field: Field, grid: Grid, cell: wp.vec3i) -> wp.bool:
    """Return whether all corners of a cell on the grid have data; under a closed border all cells exist."""
    exists = bool(True)
    if field.has_nodata == 1 and grid.border == 0:
        for c in range(8):
            at = node_of_volume(grid, cell[0] + (c & 1), cell[1] + ((c >> 1) & 1), cell[2] + (c >> 2))
            if not is_data(field, stored_value(field, at)):
                exists = bool(False)
    return exists


@wp.func
def descend(f: CornerValues, p: wp.vec3) -> wp.vec3:
    """Follow the gradient of a cell's interpolant towards its zero, a little out of the cell at most."""
    gradient = trilinear_gradient(f, p)
    p -= newton_step(trilinear_value(f, p[0], p[1], p[2]), gradient)
    return wp.vec3(
        wp.clamp(p[0], -OVERSHOOT, 1.0 + OVERSHOOT),
        wp.clamp(p[1], -OVERSHOOT, 1.0 + OVERSHOOT),
        wp.clamp(p[2], -OVERSHOOT, 1.0 + OVERSHOOT),
    )


@wp.func
def steepest_axis(f: CornerValues, p: wp.vec3) -> wp.int32:
    """Return the axis of the largest gradient component."""
    g = trilinear_gradient(f, p)
    axis = wp.where(wp.abs(g[1]) > wp.abs(g[0]), 1, 0)
    return wp.where(wp.abs(g[2]) > wp.max(wp.abs(g[0]), wp.abs(g[1])), 2, axis)


@wp.func
def project_point(field: Field, grid: Grid, start: wp.vec3d) -> GridPoint:
    """Return the point of the surface that the gradient leads to from `start`, in node indices."""
    x = start
    found = GridPoint()
    step = int(0)
    while step < STEPS:
        step += 1
        point = point_at(grid, x)
        i = point.cell
        f = single_precision(cell_values(field, grid, i[0], i[1], i[2]))
        p = descend(f, point.local)
        if is_in_cell(p):
            point.local = solve_along(f, p, steepest_axis(f, p))
            if is_in_cell(point.local):
                point.is_found = is_near(start, point) and cell_exists(field, grid, i)
                found = point
                step = STEPS
        x = node_position(i, p)
        if not wp.isfinite(x):
            step = STEPS
    return found


@wp.func
def is_near(start: wp.vec3d, point: GridPoint) -> wp.bool:
    """Return whether a point is within `REACH` of coordinates in node indices."""
    return wp.max(wp.abs(node_position(point.cell, point.local) - start)) <= wp.float64(REACH)


@wp.func
def locate_point(field: Field, grid: Grid, x: wp.vec3d) -> GridPoint:
    """Return the point at coordinates in node indices, found if its cell exists."""
    point = point_at(grid, x)
    point.is_found = is_in_cell(point.local) and cell_exists(field, grid, point.cell)
    return point
