"""Gather the corners of sixteen cells into lanes, and map sixteen points of cells to the world, on CPU."""

import warp as wp

from dmc_cli.bits import LANES
from dmc_cli.field.field import Field
from dmc_cli.field.grid import Grid, world_coordinate
from dmc_cli.field.sample_reader import IntLanes, pairs_at
from dmc_cli.field.simd_cells import FloatLanes
from dmc_cli.field.trilinear import below_zero

CornerLanes = wp.types.vector(length=8 * LANES, dtype=wp.float32)
"""F at the corners of a block's cells: corner after corner."""


@wp.func
def gather_corners(field: Field, grid: Grid, node: wp.int64, offsets: IntLanes) -> CornerLanes:
    """Return F at the corners of the cells at `node` + `offsets` of the volume."""
    row = wp.int64(grid.nx - 2 * grid.border)
    layer = row * wp.int64(grid.ny - 2 * grid.border)
    sign = field.sign
    isovalue = field.isovalue
    corners = CornerLanes()
    for r in range(4):
        at = node + wp.int64(r & 1) * row + wp.int64(r >> 1) * layer
        stored = pairs_at(field.values, field.kind, at, offsets)
        for lane in range(LANES):
            corners[2 * LANES * r + lane] = below_zero(sign * (stored[lane] - isovalue))
        for lane in range(LANES):
            corners[2 * LANES * r + LANES + lane] = below_zero(sign * (stored[LANES + lane] - isovalue))
    return corners


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
