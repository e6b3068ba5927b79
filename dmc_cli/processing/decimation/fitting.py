"""Fit a vertex: of places beside it, take that where its quads are nearest to the surface and to squares.

A vertex is always on the surface, but a coarse quad is not, and where a scan is rough the place decides how
far it is off: from a bump all quads round it hang above the surface, from a pit below it. Smoothing alone
does not know. So what is least here is an energy: how far from a square the quads are, and the squares of the
heights of their samples. Both diagonals count: a quad may be split by either.
"""

import warp as wp

from dmc_cli.processing.decimation.fine_points import energy_of_ring
from dmc_cli.processing.decimation.guard import Guard
from dmc_cli.processing.decimation.places import put_on_surface
from dmc_cli.processing.remeshing import KEPT, Work, clear_failure, fail, goal_of, has_failed
from dmc_cli.processing.tangent_step import SurfaceContext

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

DIRECTIONS = wp.constant(4)
"""Places that are tried round a vertex, and one more: where its quads would best be squares."""

COS_45 = wp.constant(0.70710678)
"""cos 45°, which is sin 45°: what a direction turned by 45° has of it, and of it turned by 90°."""

LEAST_GAIN = wp.constant(1.0e-4)
"""Of energy: what a step must be worth."""


@wp.struct
class Place:
    """A place on the surface: position, cell, local coordinates, unit normal."""

    position: wp.vec3
    cell: wp.int64
    local: wp.vec3
    normal: wp.vec3


@wp.func
def place_of(work: Work, v: wp.int32) -> Place:
    """Return where a vertex is."""
    place = Place()
    place.position = work.mesh.position[v]
    place.cell = work.mesh.cell[v]
    place.local = work.mesh.local[v]
    place.normal = work.normal[v]
    return place


@wp.func
def put_at(work: Work, v: wp.int32, place: Place) -> None:
    """Put a vertex at a place."""
    work.mesh.position[v] = place.position
    work.mesh.cell[v] = place.cell
    work.mesh.local[v] = place.local
    work.normal[v] = place.normal


@wp.func
def energy_at(
    guard: Guard, work: Work, b: wp.int32, v: wp.int32, count: wp.int32, edge: wp.float32
) -> wp.float32:
    """Return the energy of a vertex's quads."""
    return energy_of_ring(
        work.mesh.corners,
        work.mesh.twin,
        work.mesh.position,
        guard.copies,
        b,
        count,
        work.mesh.vertex_halfedge[v],
        work.mesh.valence[v],
        edge,
        guard.reach,
    )


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

    They are in the direction of the goal and at right angles to it, or 45 degrees off.
    """
    v = work.tally[b, KEPT]
    best = place_of(work, v)
    home = best.position
    normal = best.normal
    least = energy_at(guard, work, b, v, count, edge) - LEAST_GAIN
    goal = goal_of(work, v)
    way = direction_of(normal, goal - home)
    if is_turned:
        way = COS_45 * (way + wp.cross(normal, way))
    is_better = bool(False)
    for n in range(DIRECTIONS + 1):
        work.mesh.position[v] = wp.where(n == DIRECTIONS, goal, home + stride * edge * way)
        put_on_surface(context, guard, work, b, v, count)
        if not has_failed(work, b):
            energy = energy_at(guard, work, b, v, count, edge)
            if energy < least:
                least = energy
                best = place_of(work, v)
                is_better = bool(True)
        clear_failure(work, b)
        way = wp.cross(normal, way)
    put_at(work, v, best)
    if not is_better:
        fail(work, b)
