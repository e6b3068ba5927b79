"""Mend what remeshing leaves: high quads get lower and the worst better, vertex by vertex.

Smoothing moves all vertices towards the mean of what their quads want; the worst quad may lose there, and
stays as it is. Here each vertex of a bad quad tries steps of three lengths in eight directions of its tangent
plane, of a sliver also out of that plane, and takes those that make its worst quad better, as long as none of
its quads turns or folds, rises from the surface or leaves a tracked point behind. A sliver's quads may also
come to be warped, as far as its region can pay for that (`warp_accounts.py`).

A *high* quad's centre is too far from the surface: a square at the foot of a bump of one cell whose other
quads the pattern 3-3-3-3 removed. Its vertices take the steps up the bump that lower it, as long as no sliver
comes of it. Where the bump's sides are at right angles that takes a fold, so those that stay high may fold at
last.
"""

from typing import Any

import warp as wp

from dmc_cli.mesh import WorkingMesh, next_outgoing, quad_corner
from dmc_cli.processing.quad_square import quad_area
from dmc_cli.processing.relaxation import SLIVER
from dmc_cli.processing.remeshing.checks import (
    PatchMeasures,
    excess_of_patch,
    folded_sides,
    gather_patch,
    highest_of_patch,
    measure_patch,
)
from dmc_cli.processing.remeshing.moves import keep_places, restore_places, settle_core
from dmc_cli.processing.remeshing.tracked_points import assign_points
from dmc_cli.processing.remeshing.warp_accounts import can_pay, pay
from dmc_cli.processing.remeshing.work import Work, begin, fail, has_failed, touch
from dmc_cli.processing.surface_distance import excess_height
from dmc_cli.processing.tangent_step import SurfaceContext

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

LEAST_GAIN = wp.constant(1.0e-4)
"""What a step must gain in shape, or in cells of height."""

MEND_PASSES = 6
"""Times that a region goes through its vertices."""

DIRECTIONS, LENGTHS = 8, 3
"""Steps that are tried at a vertex: of 0.4 of the mean length of its sides, and a third of that twice."""


COS_45 = wp.constant(0.70710678)
"""cos 45°, which is sin 45°: what a direction turned by 45° has of it, and of it turned by 90°."""


@wp.struct
class Measures:
    """Of the quads round a vertex: their patch's measures, largest height, excess."""

    patch: PatchMeasures
    height: wp.float32
    excess: wp.float32


@wp.struct
class Limits:
    """What steps may leave.

    Attributes:
        bad: The shape up to which quads are bad.
        height: What height any may have.
        warp_cosine: The cosine of the largest warp that any may have.
        may_fold: 1 if high ones may fold.
    """

    bad: wp.float32
    height: wp.float32
    warp_cosine: wp.float32
    may_fold: wp.int32


def flag_high(mesh: WorkingMesh, context: Any) -> Any:
    """Return a flag for each vertex, uint8 (V,): 1 if one of its quads is high."""
    high, arrays = mesh.device.zeros(mesh.vertex_count, wp.uint8), mesh.arrays
    inputs = [context, arrays.corners, arrays.cell, arrays.local]
    mesh.device.launch(flag_high_kernel, mesh.face_count, inputs, [high])
    return high


@wp.func
def mean_side(work: Work, v: wp.int32) -> wp.float32:
    """Return the mean length of the sides at a vertex."""
    total = float(0.0)
    h = work.mesh.vertex_halfedge[v]
    size = work.mesh.valence[v]
    for _n in range(size):
        total += wp.length(work.mesh.position[quad_corner(work.mesh.corners, h, 1)] - work.mesh.position[v])
        h = next_outgoing(work.mesh.twin, h)
    return total / float(size)


@wp.func
def upward(work: Work, v: wp.int32) -> wp.vec3:
    """Return the surface's normal at a vertex; where the field's gradient vanishes, that of its quads."""
    up = work.normal[v]
    if wp.length_sq(up) == 0.0:
        h = work.mesh.vertex_halfedge[v]
        for _n in range(work.mesh.valence[v]):
            up += quad_area(work.mesh.corners, work.mesh.position, h >> 2)
            h = next_outgoing(work.mesh.twin, h)
    return wp.normalize(up)


@wp.func
def measure_ring(context: SurfaceContext, work: Work, b: wp.int32) -> Measures:
    """Return the measures of the quads round the touched vertex."""
    gather_patch(work, b)
    ring = Measures()
    ring.patch = measure_patch(work, b)
    ring.patch.folds = folded_sides(work, b)
    ring.height = highest_of_patch(context, work, b)
    ring.excess = excess_of_patch(context, work, b)
    return ring


@wp.func
def is_better(after: Measures, before: Measures, limits: Limits) -> wp.bool:
    """Return whether a ring is lower, or where none is high better in shape, and no worse otherwise."""
    now = after.patch
    then = before.patch
    may_fold = then.least < SLIVER
    better = now.least > then.least + LEAST_GAIN and after.excess == 0.0
    if before.excess > 0.0:
        may_fold = may_fold or limits.may_fold == 1
        better = after.excess < before.excess - LEAST_GAIN and now.least >= wp.min(then.least, SLIVER)
    better = better and (may_fold or now.folds <= then.folds)
    better = better and (then.least < SLIVER or now.warped <= then.warped)
    better = better and now.warp_cosine >= wp.min(then.warp_cosine, limits.warp_cosine)
    better = better and now.inverted <= then.inverted
    return better and after.height <= wp.max(before.height, limits.height)


@wp.func
def try_step(
    context: SurfaceContext,
    work: Work,
    b: wp.int32,
    v: wp.int32,
    step: wp.vec3,
    before: Measures,
    limits: Limits,
) -> Measures:
    """Move a vertex if that makes its quads better; return their measures."""
    found = before
    begin(work, b)
    touch(work, b, v)
    keep_places(work, b)
    work.mesh.position[v] = work.mesh.position[v] + step
    settle_core(context, work, b)
    if not has_failed(work, b):
        found = measure_ring(context, work, b)
        if not is_better(found, before, limits) or not can_pay(work, b, found.patch, before.patch):
            fail(work, b)
    if not has_failed(work, b):
        assign_points(context, work, b)
    if has_failed(work, b):
        restore_places(work, b)
        found = before
    else:
        pay(work, b, found.patch, before.patch)
    return found


@wp.func
def try_steps(
    context: SurfaceContext, work: Work, b: wp.int32, v: wp.int32, planes: wp.int32, limits: Limits
) -> None:
    """Try steps of all lengths and directions in the tangent plane, or in three planes at right angles."""
    normal = upward(work, v)
    way = wp.where(wp.abs(normal[0]) < 0.6, wp.vec3(1.0, 0.0, 0.0), wp.vec3(0.0, 1.0, 0.0))
    way = wp.normalize(wp.cross(normal, way))
    longest = 0.4 * mean_side(work, v)
    length = longest
    before = measure_ring(context, work, b)
    for n in range(planes * LENGTHS * DIRECTIONS):
        before = try_step(context, work, b, v, length * way, before, limits)
        way = COS_45 * (way + wp.cross(normal, way))
        if n % DIRECTIONS == DIRECTIONS - 1:
            length = length / 3.0
        if n % (LENGTHS * DIRECTIONS) == LENGTHS * DIRECTIONS - 1:
            length = longest
            along = wp.cross(normal, way)
            normal = way
            way = along


@wp.func
def mend_vertex(
    context: SurfaceContext, work: Work, b: wp.int32, v: wp.int32, is_high: wp.bool, limits: Limits
) -> None:
    """Try steps at a vertex if one of its quads is high or bad."""
    begin(work, b)
    touch(work, b, v)
    gather_patch(work, b)
    least = measure_patch(work, b).least
    if (is_high or least <= limits.bad) and not has_failed(work, b):
        try_steps(context, work, b, v, wp.where(least < SLIVER, 3, 1), limits)


@wp.kernel
def flag_high_kernel(
    # In:
    first: wp.int32,
    context: SurfaceContext,
    corners: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    # Out:
    high_out: wp.array(dtype=wp.uint8),
) -> None:
    """Flag the vertices of a high quad; threads that flag one vertex write the same. One thread a quad."""
    q = first + wp.tid()
    if excess_height(context, corners, cell, local, q) > 0.0:
        for c in range(4):
            high_out[corners[4 * q + c]] = wp.uint8(1)


@wp.kernel
def mend_kernel(
    # In:
    first: wp.int32,
    context: SurfaceContext,
    starts: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    high: wp.array(dtype=wp.uint8),
    limits: Limits,
    begin: wp.int32,
    end: wp.int32,
    # In/out:
    work_inout: Work,
) -> None:
    """Mend the quads round the vertices of a region, one by one, from visit `begin` up to `end`.

    One thread a region; `MEND_PASSES` visits a vertex.
    """
    b = first + wp.tid()
    count = starts[b + 1] - starts[b]
    for visit in range(begin, wp.min(end, MEND_PASSES * count)):
        v = items[starts[b] + visit % count]
        mend_vertex(context, work_inout, b, v, high[v] != wp.uint8(0), limits)
