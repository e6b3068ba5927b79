"""Move the vertices that an operation touched: in their tangent planes, then back to the surface."""

import warp as wp

from dmc_cli.field import index_position, node_cell, output_position, project_point, slice_distance
from dmc_cli.mesh import next_outgoing, quad_corner
from dmc_cli.processing.quad_square import nearest_square_corner
from dmc_cli.processing.remeshing.work import (
    KEPT,
    REMOVED,
    TOUCHED,
    Work,
    fail,
    has_failed,
)
from dmc_cli.processing.tangent_step import SurfaceContext, surface_normal

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

STEPS = 3
"""Steps of smoothing before an operation is judged: without them it is judged for the kinks that it makes."""

FARTHEST = wp.constant(wp.float64(1.25))
"""How far, in cells along an axis, a vertex may go at once."""


@wp.func
def note_place(work: Work, b: wp.int32, n: wp.int32, v: wp.int32) -> None:
    """Note where a vertex is, as place number n of the region."""
    work.core_position[b, n] = work.mesh.position[v]
    work.core_cell[b, n] = work.mesh.cell[v]
    work.core_local[b, n] = work.mesh.local[v]
    work.core_normal[b, n] = work.normal[v]


@wp.func
def put_at(work: Work, b: wp.int32, n: wp.int32, v: wp.int32) -> None:
    """Put a vertex at a place that was noted."""
    work.mesh.position[v] = work.core_position[b, n]
    work.mesh.cell[v] = work.core_cell[b, n]
    work.mesh.local[v] = work.core_local[b, n]
    work.normal[v] = work.core_normal[b, n]


@wp.func
def keep_places(work: Work, b: wp.int32) -> None:
    """Note where the touched vertices are, and put the one that a collapse keeps midway."""
    for n in range(work.tally[b, TOUCHED]):
        note_place(work, b, n, work.core[b, n])
    kept = work.tally[b, KEPT]
    if kept >= 0:
        gone = work.tally[b, REMOVED]
        work.mesh.position[kept] = 0.5 * (work.mesh.position[kept] + work.mesh.position[gone])


@wp.func
def restore_places(work: Work, b: wp.int32) -> None:
    """Put the touched vertices back."""
    for n in range(work.tally[b, TOUCHED]):
        put_at(work, b, n, work.core[b, n])


@wp.func
def exchange_places(work: Work, b: wp.int32) -> None:
    """Exchange the touched vertices' positions with those that they had before, or back again."""
    for n in range(work.tally[b, TOUCHED]):
        v = work.core[b, n]
        position = work.mesh.position[v]
        work.mesh.position[v] = work.core_position[b, n]
        work.core_position[b, n] = position


@wp.func
def goal_of(work: Work, v: wp.int32) -> wp.vec3:
    """Return the mean of a vertex's corners of the squares nearest to its quads, on its tangent plane."""
    here = work.mesh.position[v]
    goal = wp.vec3(0.0, 0.0, 0.0)
    h = work.mesh.vertex_halfedge[v]
    size = work.mesh.valence[v]
    for _n in range(size):
        b = work.mesh.position[quad_corner(work.mesh.corners, h, 1)]
        c = work.mesh.position[quad_corner(work.mesh.corners, h, 2)]
        d = work.mesh.position[quad_corner(work.mesh.corners, h, 3)]
        goal += nearest_square_corner(here, b, c, d)
        h = next_outgoing(work.mesh.twin, h)
    step = goal / float(size) - here
    return here + (step - wp.dot(step, work.normal[v]) * work.normal[v])


@wp.func
def smooth_core(work: Work, b: wp.int32) -> None:
    """Smooth the touched vertices, one after the other."""
    for _step in range(STEPS):
        for n in range(work.tally[b, TOUCHED]):
            v = work.core[b, n]
            if work.mesh.vertex_gone[v] == wp.uint8(0):
                work.mesh.position[v] = goal_of(work, v)


@wp.func
def settle(context: SurfaceContext, work: Work, b: wp.int32, n: wp.int32) -> None:
    """Put a touched vertex on the surface near where it has gone; fail where that is not found.

    It may not come to face the other way; where the field's gradient vanishes it faces no way yet.
    """
    v = work.core[b, n]
    cell = work.core_cell[b, n]
    start = index_position(context.grid, cell, work.core_local[b, n])
    way = context.to_grid * (work.mesh.position[v] - work.core_position[b, n])
    k = wp.int32(start[2])
    if context.depths.shape[0] > 0:
        k = wp.min(k, context.depths.shape[0] - 2)
    way[2] = way[2] / wp.float32(slice_distance(context.depths, k))
    end = project_point(context.field, context.grid, start + wp.vec3d(way))
    facing = wp.vec3(0.0, 0.0, 0.0)
    if end.is_found:
        moved = index_position(context.grid, node_cell(context.grid, end.cell), end.local) - start
        if wp.max(wp.abs(moved)) <= FARTHEST:
            facing = surface_normal(context, end.cell, end.local)
    normal = work.core_normal[b, n]
    if wp.dot(facing, normal) > 0.0 or (wp.length_sq(normal) == 0.0 and wp.length_sq(facing) > 0.0):
        work.mesh.position[v] = output_position(context.to_output, context.depths, end.cell, end.local)
        work.mesh.cell[v] = node_cell(context.grid, end.cell)
        work.mesh.local[v] = end.local
        work.normal[v] = facing
    else:
        fail(work, b)


@wp.func
def settle_core(context: SurfaceContext, work: Work, b: wp.int32) -> None:
    """Put the touched vertices on the surface."""
    for n in range(work.tally[b, TOUCHED]):
        if work.mesh.vertex_gone[work.core[b, n]] == wp.uint8(0) and not has_failed(work, b):
            settle(context, work, b, n)
