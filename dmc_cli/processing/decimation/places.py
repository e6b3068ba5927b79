"""Put a vertex that a collapse keeps, or that glides, on the surface near where it should be.

The nearest tracked point lies on the right sheet of the surface, however large the quads are. From its
tangent plane Newton's method leads to the surface; where it leads elsewhere, the vertex goes to the point
itself. Where no field is known, the vertex stays in that plane.
"""

import warp as wp

from dmc_cli.field import node_cell, output_position, project_point, slice_distance
from dmc_cli.processing.decimation.fine_points import nearest_copy
from dmc_cli.processing.decimation.guard import Guard
from dmc_cli.processing.remeshing import Work, fail
from dmc_cli.processing.tangent_step import SurfaceContext, surface_normal

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

LEAST_COSINE = wp.constant(0.5)
"""Of the angle between the normals at a tracked point and where a vertex goes from there."""


@wp.func
def put_on_surface(
    context: SurfaceContext, guard: Guard, work: Work, b: wp.int32, v: wp.int32, count: wp.int32
) -> None:
    """Put a vertex on the surface near its position, from the nearest of `count` listed points."""
    nearest = nearest_copy(guard.copies, b, count, work.mesh.position[v])
    if nearest < 0:
        fail(work, b)
    elif guard.has_field:
        put_on_level(context, guard, work, b, v, work.listed[b, nearest])
    else:
        put_on_plane(context, guard, work, b, v, work.listed[b, nearest])


@wp.func
def put_on_plane(
    context: SurfaceContext, guard: Guard, work: Work, b: wp.int32, v: wp.int32, g: wp.int32
) -> None:
    """Put a vertex on the plane at a tracked point; fail where that has no normal."""
    up = guard.normal[g]
    place = work.mesh.position[v] - wp.dot(work.mesh.position[v] - guard.place[g], up) * up
    origin = wp.vec3(
        wp.float32(context.to_output[0, 3]),
        wp.float32(context.to_output[1, 3]),
        wp.float32(context.to_output[2, 3]),
    )
    at = context.to_grid * (place - origin)
    last = wp.vec3(wp.float32(context.grid.nx), wp.float32(context.grid.ny), wp.float32(context.grid.nz))
    at = wp.min(wp.max(at, wp.vec3(0.0, 0.0, 0.0)), last - wp.vec3(1.0, 1.0, 1.0))
    cell = wp.vec3i(wp.int32(at[0]), wp.int32(at[1]), wp.int32(at[2]))
    work.mesh.position[v] = place
    work.mesh.cell[v] = node_cell(context.grid, cell)
    work.mesh.local[v] = at - wp.vec3(wp.float32(cell[0]), wp.float32(cell[1]), wp.float32(cell[2]))
    work.normal[v] = up
    if wp.length_sq(up) == 0.0:
        fail(work, b)


@wp.func
def put_on_level(
    context: SurfaceContext, guard: Guard, work: Work, b: wp.int32, v: wp.int32, g: wp.int32
) -> None:
    """Put a vertex where the field is 0, by way of a tracked point; fail where that is not found."""
    start = wp.vec3d(work.tracked_point[g])
    up = guard.normal[g]
    step = work.mesh.position[v] - guard.place[g]
    way = context.to_grid * (step - wp.dot(step, up) * up)
    k = wp.clamp(wp.int32(start[2]), 0, wp.max(context.depths.shape[0] - 2, 0))
    way[2] = way[2] / wp.float32(slice_distance(context.depths, k))
    longest = wp.max(wp.abs(way))
    if longest > 1.0:
        way = way / longest
    is_placed = bool(False)
    for attempt in range(2):
        if not is_placed:
            end = project_point(
                context.field, context.grid, start + wp.vec3d(wp.where(attempt == 0, 1.0, 0.0) * way)
            )
            if end.is_found:
                facing = surface_normal(context, end.cell, end.local)
                if attempt == 1 or wp.dot(facing, up) >= LEAST_COSINE:
                    is_placed = bool(True)
                    work.mesh.position[v] = output_position(
                        context.to_output, context.depths, end.cell, end.local
                    )
                    work.mesh.cell[v] = node_cell(context.grid, end.cell)
                    work.mesh.local[v] = end.local
                    work.normal[v] = facing
    if not is_placed:
        fail(work, b)
