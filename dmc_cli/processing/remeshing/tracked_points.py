"""Assign the tracked points of the quads that an operation changes to the nearest quads of its patch."""

import warp as wp

from dmc_cli.processing.distance_guard import FARTHEST, distance_from_quad
from dmc_cli.processing.remeshing.work import FACE_GONE, JOURNALLED, PATCHED, Work, fail, has_failed
from dmc_cli.processing.tangent_step import SurfaceContext

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def list_points_of(work: Work, b: wp.int32, q: wp.int32, count: wp.int32) -> wp.int32:
    """Add a quad's tracked points to the region's list of `count`; return how many there are then."""
    size = count
    g = work.first_point[q]
    while g >= 0:
        if size < work.listed.shape[1]:
            work.listed[b, size] = g
        size += 1
        g = work.next_point[g]
    return size


@wp.func
def list_points_of_patch(work: Work, b: wp.int32) -> wp.int32:
    """List the points of the patch's quads and of those that the operation removed; return their number."""
    size = int(0)
    for n in range(work.tally[b, PATCHED]):
        size = list_points_of(work, b, work.patch[b, n], size)
    for n in range(work.tally[b, JOURNALLED]):
        place = work.journal_place[b, n]
        q = wp.int32(place >> wp.int64(3))
        if wp.int32(place & wp.int64(7)) == FACE_GONE:
            if work.mesh.face_gone[q] != wp.uint8(0):
                size = list_points_of(work, b, q, size)
    return size


@wp.func
def nearest_in_patch(context: SurfaceContext, work: Work, b: wp.int32, g: wp.int32) -> wp.int32:
    """Return a point's quad as long as it is near enough, else the nearest one of the patch, or -1."""
    nearest_quad = work.nearest_quad[g]
    point = work.tracked_point[g]
    least = float(FARTHEST)
    best = int(-1)
    if work.mesh.face_gone[nearest_quad] == wp.uint8(0):
        if (
            distance_from_quad(
                context.grid, work.mesh.corners, work.mesh.cell, work.mesh.local, nearest_quad, point
            )
            <= FARTHEST
        ):
            best = nearest_quad
    if best < 0:
        for n in range(work.tally[b, PATCHED]):
            q = work.patch[b, n]
            distance = distance_from_quad(
                context.grid, work.mesh.corners, work.mesh.cell, work.mesh.local, q, point
            )
            if distance <= least:
                least = distance
                best = q
    return best


@wp.func
def take_new_nearest(work: Work, b: wp.int32, count: wp.int32) -> None:
    """Move the listed points to the lists of their new nearest quads."""
    for m in range(count):
        work.first_point[work.nearest_quad[work.listed[b, m]]] = -1
    for m in range(count):
        g = work.listed[b, m]
        nearest_quad = work.new_nearest[b, m]
        work.nearest_quad[g] = nearest_quad
        work.next_point[g] = work.first_point[nearest_quad]
        work.first_point[nearest_quad] = g


@wp.func
def assign_points(context: SurfaceContext, work: Work, b: wp.int32) -> None:
    """Assign the points of an operation's quads to quads of the patch; fail if one is left behind."""
    size = list_points_of_patch(work, b)
    if size > work.listed.shape[1]:
        fail(work, b)
    n = int(0)
    while n < size and not has_failed(work, b):
        work.new_nearest[b, n] = nearest_in_patch(context, work, b, work.listed[b, n])
        if work.new_nearest[b, n] < 0:
            fail(work, b)
        n += 1
    if not has_failed(work, b):
        take_new_nearest(work, b, size)
