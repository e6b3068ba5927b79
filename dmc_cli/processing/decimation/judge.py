"""Judge an operation of decimation by the quads that it changes: shapes, folds, and distances both ways."""

import warp as wp

from dmc_cli.processing.decimation.fine_points import are_samples_low, copy_points
from dmc_cli.processing.decimation.guard import Guard, assign_listed
from dmc_cli.processing.remeshing import (
    CORNER,
    FACE_GONE,
    JOURNALLED,
    KEPT,
    PATCHED,
    REMOVED,
    PatchMeasures,
    Work,
    add_ring_to_patch,
    add_to_patch,
    exchange_places,
    fail,
    folded_sides,
    gather_patch,
    grow_patch,
    list_points_of_patch,
    measure_patch,
    redo,
    take_new_nearest,
    undo,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

SLACK = wp.constant(0.15)
"""What shapes may gain when vertices are put on the surface."""


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
    """Return the measures of the changed quads before an operation, without folds."""
    gather_patch_of(work, b, is_wide, True)
    undo(work, b)
    found = measure_patch(work, b)
    redo(work, b)
    return found


@wp.func
def measure_rings(work: Work, b: wp.int32) -> PatchMeasures:
    """Return the measures of the quads round two vertices that are about to be joined, without folds.

    They are those that the collapse will change, if no doublet follows from it.
    """
    twin, first = work.mesh.twin, work.mesh.vertex_halfedge
    kept = work.tally[b, KEPT]
    gone = work.tally[b, REMOVED]
    count = add_ring_to_patch(twin, work.patch, b, 0, first[kept], work.mesh.valence[kept])
    count = add_ring_to_patch(twin, work.patch, b, count, first[gone], work.mesh.valence[gone])
    grow_patch(work, b, count)
    return measure_patch(work, b)


@wp.func
def is_folded_anew(work: Work, b: wp.int32, is_wide: wp.bool) -> wp.bool:
    """Return whether the patch has more folds than the changed quads had before: looked up if it has any."""
    found = folded_sides(work, b)
    before = int(0)
    if found > 0:
        gather_patch_of(work, b, is_wide, True)
        exchange_places(work, b)
        undo(work, b)
        before = folded_sides(work, b)
        redo(work, b)
        exchange_places(work, b)
        gather_patch_of(work, b, is_wide, False)
    return found > before


@wp.func
def is_well_shaped(
    guard: Guard,
    work: Work,
    b: wp.int32,
    before: PatchMeasures,
    budget: wp.float32,
    may_warp: wp.bool,
    is_wide: wp.bool,
) -> wp.bool:
    """Return whether the patch has no worse quad than before, no new fold, and costs what it may.

    Unless it may warp, no more of its quads are warped by over 30 degrees than before either.
    """
    after = measure_patch(work, b)
    fine = after.least >= wp.min(before.least, guard.least_shape) and after.cost <= budget
    fine = fine and after.inverted <= before.inverted
    fine = fine and (may_warp or after.warped <= before.warped)
    if fine:
        fine = not is_folded_anew(work, b, is_wide)
    return fine


@wp.func
def is_hopeless(guard: Guard, work: Work, b: wp.int32, before: PatchMeasures, budget: wp.float32) -> wp.bool:
    """Return whether the patch is too bad to become well shaped when its vertices are put on the surface."""
    found = measure_patch(work, b)
    least = wp.min(before.least, guard.least_shape) - SLACK
    return found.least < least or found.cost > budget + SLACK


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
def assign_points(guard: Guard, work: Work, b: wp.int32, count: wp.int32) -> None:
    """Assign the listed points to quads of the patch; fail if one is left behind."""
    if assign_listed(
        work.mesh.corners,
        work.mesh.position,
        work.mesh.face_gone,
        work.patch,
        work.tally[b, PATCHED],
        guard.place,
        work.nearest_quad,
        work.listed,
        b,
        count,
        guard.farthest,
        work.new_nearest,
    ):
        take_new_nearest(work, b, count)
    else:
        fail(work, b)


@wp.func
def list_points(guard: Guard, work: Work, b: wp.int32) -> wp.int32:
    """List and copy the points of the patch's quads and of those that are gone; fail of too many."""
    count = list_points_of_patch(work, b)
    if count > work.listed.shape[1]:
        fail(work, b)
    else:
        copy_points(guard.place, guard.normal, work.listed, b, count, guard.copies)
    return count
