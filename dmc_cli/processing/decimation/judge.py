"""Judge an operation of decimation by the quads that it changes: shapes, folds, and distances both ways."""

import warp as wp

from dmc_cli.processing.decimation.fine_points import are_samples_low, copy_points
from dmc_cli.processing.decimation.guard import Guard, distance_from_triangles
from dmc_cli.processing.remeshing import (
    CORNER,
    FACE_GONE,
    JOURNALLED,
    KEPT,
    PATCHED,
    PatchMeasures,
    Work,
    add_ring_to_patch,
    add_to_patch,
    fail,
    folded_sides,
    gather_patch,
    grow_patch,
    has_failed,
    list_points_of_patch,
    measure_patch,
    redo,
    take_new_nearest,
    undo,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def gather_changed(work: Work, b: wp.int32, gone_too: wp.bool) -> None:
    """List the quads that an operation changes: those round the kept vertex, with another corner, or gone."""
    kept = work.tally[b, KEPT]
    count = add_ring_to_patch(
        work.mesh.twin, work.patch, b, 0, work.mesh.vertex_halfedge[kept], work.mesh.valence[kept]
    )
    for n in range(work.tally[b, JOURNALLED]):
        place = work.journal_place[b, n]
        index = wp.int32(place >> wp.int64(3))
        kind = wp.int32(place & wp.int64(7))
        if kind == CORNER:
            if work.mesh.face_gone[index >> 2] == wp.uint8(0):
                count = add_to_patch(work.patch, b, count, index >> 2)
        elif kind == FACE_GONE and gone_too:
            count = add_to_patch(work.patch, b, count, index)
    grow_patch(work, b, count)


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
    return are_samples_low(
        work.mesh.corners,
        work.mesh.position,
        work.patch,
        work.tally[b, PATCHED],
        guard.copies,
        b,
        count,
        guard.spacing,
        guard.reach,
        guard.highest,
    )


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
def list_points(guard: Guard, work: Work, b: wp.int32) -> wp.int32:
    """List and copy the points of the patch's quads and of those that are gone; fail of too many."""
    count = list_points_of_patch(work, b)
    if count > work.listed.shape[1]:
        fail(work, b)
    else:
        copy_points(guard.place, guard.normal, work.listed, b, count, guard.copies)
    return count
