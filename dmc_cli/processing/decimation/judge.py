"""Judge an operation of decimation by the quads that it changes: shapes, folds, and distances both ways."""

import warp as wp

from dmc_cli.mesh import next_outgoing
from dmc_cli.processing.decimation.guard import (
    Guard,
    distance_from_triangles,
    height_of_sample,
    sample_of,
    sample_steps,
)
from dmc_cli.processing.remeshing import (
    CORNER,
    FACE_GONE,
    JOURNALLED,
    KEPT,
    PATCH,
    PATCHED,
    PatchMeasures,
    Work,
    fail,
    folded_sides,
    gather_patch,
    has_failed,
    list_points_of_patch,
    measure_patch,
    redo,
    take_new_nearest,
    undo,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def add_to_patch(work: Work, b: wp.int32, q: wp.int32) -> None:
    """Add a quad to the patch unless it is there; fail if that is full."""
    count = work.tally[b, PATCHED]
    known = bool(False)
    for m in range(count):
        if work.patch[b, m] == q:
            known = bool(True)
    if not known:
        if count == PATCH:
            fail(work, b)
        else:
            work.patch[b, count] = q
            work.tally[b, PATCHED] = count + 1


@wp.func
def gather_changed(work: Work, b: wp.int32, gone_too: wp.bool) -> None:
    """List the quads that an operation changes: those round the kept vertex, with another corner, or gone."""
    work.tally[b, PATCHED] = 0
    kept = work.tally[b, KEPT]
    h = work.mesh.vertex_halfedge[kept]
    for _n in range(work.mesh.valence[kept]):
        add_to_patch(work, b, h >> 2)
        h = next_outgoing(work.mesh.twin, h)
    for n in range(work.tally[b, JOURNALLED]):
        place = work.journal_place[b, n]
        index = wp.int32(place >> wp.int64(3))
        kind = wp.int32(place & wp.int64(7))
        if kind == CORNER:
            if work.mesh.face_gone[index >> 2] == wp.uint8(0):
                add_to_patch(work, b, index >> 2)
        elif kind == FACE_GONE and gone_too:
            add_to_patch(work, b, index)


@wp.func
def gather_patch_of(work: Work, b: wp.int32, is_wide: wp.bool, gone_too: wp.bool) -> None:
    """List the quads that an operation changes, or where it is wide all round the touched vertices."""
    if is_wide:
        gather_patch(work, b)
    else:
        gather_changed(work, b, gone_too)


@wp.func
def measure_before(work: Work, b: wp.int32, is_wide: wp.bool) -> PatchMeasures:
    """Return the measures of the changed quads before an operation."""
    gather_patch_of(work, b, is_wide, True)
    undo(work, b)
    found = measure_patch(work, b)
    found.folds = folded_sides(work, b)
    redo(work, b)
    return found


@wp.func
def is_well_shaped(
    guard: Guard, work: Work, b: wp.int32, before: PatchMeasures, budget: wp.float32, may_warp: wp.bool
) -> wp.bool:
    """Return whether the patch has no worse quad than before, no new fold, and costs what it may.

    Unless it may warp, no more of its quads are warped by over 30 degrees than before either.
    """
    after = measure_patch(work, b)
    fine = after.least >= wp.min(before.least, guard.least_shape) and after.cost <= budget
    fine = fine and after.inverted <= before.inverted
    fine = fine and (may_warp or after.warped <= before.warped)
    if fine:
        fine = folded_sides(work, b) <= before.folds
    return fine


@wp.func
def is_low(guard: Guard, work: Work, b: wp.int32, count: wp.int32) -> wp.bool:
    """Return whether samples of the patch's quads, all but their corners, are near the surface."""
    low = bool(True)
    for n in range(work.tally[b, PATCHED]):
        q = work.patch[b, n]
        steps = sample_steps(guard, work.mesh.corners, work.mesh.position, q)
        for m in range((steps + 1) * (steps + 1)):
            i = m % (steps + 1)
            j = m / (steps + 1)
            if low and not ((i == 0 or i == steps) and (j == 0 or j == steps)):
                s = float(i) / float(steps)
                t = float(j) / float(steps)
                x = sample_of(work.mesh.corners, work.mesh.position, q, s, t)
                low = height_of_sample(guard, work, b, count, x) <= guard.highest
    return low


@wp.func
def nearest_of_patch(guard: Guard, work: Work, b: wp.int32, g: wp.int32) -> wp.int32:
    """Return a point's quad as long as it is near enough, else the nearest one of the patch, or -1."""
    point = guard.place[g]
    old = work.nearest_quad[g]
    best = int(-1)
    if work.mesh.face_gone[old] == wp.uint8(0):
        if distance_from_triangles(work.mesh.corners, work.mesh.position, old, point) <= guard.farthest:
            best = old
    if best < 0:
        least = guard.farthest
        for n in range(work.tally[b, PATCHED]):
            q = work.patch[b, n]
            distance = distance_from_triangles(work.mesh.corners, work.mesh.position, q, point)
            if distance <= least:
                least = distance
                best = q
    return best


@wp.func
def assign_points(guard: Guard, work: Work, b: wp.int32, count: wp.int32) -> None:
    """Assign the listed points to quads of the patch; fail if one is left behind."""
    n = int(0)
    while n < count and not has_failed(work, b):
        work.new_nearest[b, n] = nearest_of_patch(guard, work, b, work.listed[b, n])
        if work.new_nearest[b, n] < 0:
            fail(work, b)
        n += 1
    if not has_failed(work, b):
        take_new_nearest(work, b, count)


@wp.func
def list_points(work: Work, b: wp.int32) -> wp.int32:
    """List the points of the patch's quads and of those that are gone; fail if there are too many."""
    count = list_points_of_patch(work, b)
    if count > work.listed.shape[1]:
        fail(work, b)
    return count
