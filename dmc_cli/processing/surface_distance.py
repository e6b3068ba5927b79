"""Measure distances from the trilinear surface: device functions for stages that stay close to it."""

import warp as wp

from dmc_cli.field import (
    cell_values,
    index_position,
    node_cell,
    point_at,
    project_point,
    single_precision,
    trilinear_gradient,
    trilinear_value,
)
from dmc_cli.processing.tangent_step import SurfaceContext

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

PLAINLY_NEAR = wp.constant(0.15)
"""Heights, in cells, up to which the field's value and slope are believed."""

HIGHEST = wp.constant(0.45)
"""How far a quad's centre may go from the surface where that is looked at: under the half cell promised."""

NOWHERE = wp.constant(1.0)
"""Distance of a point that no point of the surface is found for."""


@wp.func
def height_above_surface(context: SurfaceContext, x: wp.vec3d) -> wp.float32:
    """Return about how far, in cells, a point in node indices is from the surface; 1 where it is flat."""
    point = point_at(context.grid, x)
    i = point.cell
    f = single_precision(cell_values(context.field, context.grid, i[0], i[1], i[2]))
    gradient = trilinear_gradient(f, point.local)
    value = wp.abs(trilinear_value(f, point.local[0], point.local[1], point.local[2]))
    slope = wp.length(gradient)
    return wp.where(slope > 0.0, wp.min(value / slope, NOWHERE), NOWHERE)


@wp.func
def distance_from_surface(context: SurfaceContext, x: wp.vec3d) -> wp.float32:
    """Return how far, in cells, a point in node indices is from the point of the surface found for it."""
    distance = height_above_surface(context, x)
    if distance > PLAINLY_NEAR:
        distance = float(NOWHERE)
        end = project_point(context.field, context.grid, x)
        if end.is_found:
            way = index_position(context.grid, node_cell(context.grid, end.cell), end.local) - x
            distance = wp.float32(wp.length(way))
    return distance


@wp.func
def quad_centre(
    context: SurfaceContext,
    corners: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    q: wp.int32,
) -> wp.vec3d:
    """Return a quad's centre in node indices."""
    centre = wp.vec3d()
    for c in range(4):
        v = corners[4 * q + c]
        centre += wp.float64(0.25) * index_position(context.grid, cell[v], local[v])
    return centre


@wp.func
def excess_height(
    context: SurfaceContext,
    corners: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    q: wp.int32,
) -> wp.float32:
    """Return by how much, in cells, a quad's centre is further than `HIGHEST` from the surface, or 0."""
    distance = distance_from_surface(context, quad_centre(context, corners, cell, local, q))
    return wp.max(distance - HIGHEST, 0.0)
