"""Fit a vertex: of places beside it, take that where its quads are nearest to the surface and to squares.

A vertex is always on the surface, but a coarse quad is not, and where a scan is rough the place decides how
far it is off: from a bump all quads round it hang above the surface, from a pit below it. Smoothing alone
does not know. So what is least here is an energy: how far from a square the quads are, and the squares of the
heights of their samples. Both diagonals count: a quad may be split by either.
"""

import warp as wp

from dmc_cli.processing.decimation.fine_points import PLACES, best_place
from dmc_cli.processing.decimation.guard import Guard
from dmc_cli.processing.decimation.places import put_on_surface
from dmc_cli.processing.remeshing import (
    KEPT,
    Work,
    clear_failure,
    fail,
    goal_of,
    has_failed,
    note_place,
    put_at,
)
from dmc_cli.processing.tangent_step import SurfaceContext

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

COS_45 = wp.constant(0.70710678)
"""cos 45°, which is sin 45°: what a direction turned by 45° has of it, and of it turned by 90°."""


@wp.func
def direction_of(normal: wp.vec3, step: wp.vec3) -> wp.vec3:
    """Return a unit vector at right angles to a normal, along a step where that has a length."""
    way = wp.cross(normal, wp.where(wp.abs(normal[0]) < 0.6, wp.vec3(1.0, 0.0, 0.0), wp.vec3(0.0, 1.0, 0.0)))
    if wp.length_sq(step) > 0.0:
        way = step
    return wp.normalize(way)


@wp.func
def fit_vertex(
    context: SurfaceContext,
    guard: Guard,
    work: Work,
    b: wp.int32,
    count: wp.int32,
    edge: wp.float32,
    stride: wp.float32,
    is_turned: wp.bool,
) -> None:
    """Move the kept vertex to the best of the places `stride` mean sides away; fail if none is better.

    They are in the direction of the goal and at right angles to it, or 45 degrees off. They are noted behind
    the place where the vertex was, which `keep_places` has noted; it stands there, too, where one is off the
    surface.
    """
    v = work.tally[b, KEPT]
    home = work.mesh.position[v]
    normal = work.normal[v]
    goal = goal_of(work, v)
    way = direction_of(normal, goal - home)
    if is_turned:
        way = COS_45 * (way + wp.cross(normal, way))
    for n in range(1, PLACES):
        work.mesh.position[v] = wp.where(n == PLACES - 1, goal, home + stride * edge * way)
        put_on_surface(context, guard, work, b, v, count)
        if has_failed(work, b):
            put_at(work, b, 0, v)
            clear_failure(work, b)
        note_place(work, b, n, v)
        way = wp.cross(normal, way)
    best = best_place(
        work.mesh.corners,
        work.mesh.twin,
        work.mesh.position,
        work.core_position,
        guard.copies,
        b,
        count,
        work.mesh.vertex_halfedge[v],
        work.mesh.valence[v],
        edge,
        guard.reach,
    )
    put_at(work, b, best, v)
    if best == 0:
        fail(work, b)
