"""Sweep over the regions of a round: each collapses its cheapest quads, or polishes what is left.

Every operation is done first and judged afterwards, and undone where it breaks a rule. A region is the work
of one thread, which goes through its quads from the cheapest on, so the mesh is the same for any number of
threads. Polishing rotates edges near irregular vertices, by the chains of remeshing, and lets vertices glide,
or fits them (`fitting.py`).
"""

import warp as wp

from dmc_cli.mesh import quad_corner
from dmc_cli.processing.decimation.actions import (
    COLLAPSE,
    FIT,
    GLIDE,
    NOTHING,
    ROTATE,
    Sweep,
    action_of,
    first_choice,
    forget_refusals,
    note_refusal,
)
from dmc_cli.processing.decimation.costs import MOST_MERGED
from dmc_cli.processing.decimation.fitting import fit_vertex
from dmc_cli.processing.decimation.guard import Guard
from dmc_cli.processing.decimation.judge import (
    assign_points,
    gather_patch_of,
    is_hopeless,
    is_low,
    is_well_shaped,
    list_points,
    measure_before,
    measure_rings,
)
from dmc_cli.processing.decimation.places import put_on_surface
from dmc_cli.processing.remeshing import (
    KEPT,
    REMOVED,
    TOUCHED,
    PatchMeasures,
    Work,
    begin,
    collapse_quad,
    doublet_of,
    exchange_places,
    fail,
    goal_of,
    has_failed,
    irregularity_change,
    is_core_sound,
    keep_places,
    link,
    measure_patch,
    next_rotation,
    quads_removed,
    restore_places,
    rotate_edge,
    scrambled,
    touch,
    undo,
)
from dmc_cli.processing.tangent_step import SurfaceContext

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

MOST_AT_ONCE = 4
"""Quads that one operation may take away: the one that is collapsed, and doublets that come of it."""

WARPS_BELOW = wp.constant(0.2)
"""Least shapes below which collapses may warp quads as well: nothing else leads on then, and on the stairs of
a mask half of the quads would stay. Rotations always may, or irregular vertices would."""

TOPOLOGY, SHAPE, DISTANCE = wp.constant(0), wp.constant(1), wp.constant(2)
REASONS = 3
"""Why an operation is refused, and how many reasons there are."""

UNBOUNDED = wp.constant(1.0e30)
"""What shapes may cost where an operation is worth any."""


@wp.func
def next_action(work: Work, b: wp.int32, kind: wp.int32, done: wp.int32, seed: wp.uint32) -> wp.vec3i:
    """Return what follows `done` operations: a doublet's removal, a chain's next rotation, or nothing."""
    action = wp.vec3i(NOTHING, 0, 0)
    if kind == COLLAPSE:
        doublet = doublet_of(work, b, work.tally[b, TOUCHED])
        if doublet >= 0:
            action = wp.vec3i(COLLAPSE, work.mesh.vertex_halfedge[doublet], 0)
    elif kind == ROTATE:
        if irregularity_change(work, b) >= 0:
            rotation = next_rotation(work, b, scrambled(seed + wp.uint32(done)))
            if rotation < 0:
                fail(work, b)
            else:
                action = wp.vec3i(ROTATE, rotation >> 1, rotation & 1)
    return action


@wp.func
def change(work: Work, b: wp.int32, first: wp.vec3i, most: wp.int32, seed: wp.uint32) -> None:
    """Do an operation and what follows it; fail where more than `most` quads would go, or it is unsound.

    Each kind is called at one place only: the compiler copies it there.
    """
    action = wp.vec3i(first)
    done = int(0)
    while action[0] != NOTHING and not has_failed(work, b):
        if action[0] == ROTATE:
            if done > 0:
                link(work, b, action[1])
            rotate_edge(work, b, action[1], action[2] == 1)
        elif action[0] == COLLAPSE:
            if done >= wp.min(most, MOST_AT_ONCE):
                fail(work, b)
            else:
                collapse_quad(work, b, action[1])
        else:
            touch(work, b, action[1])
        done += 1
        action = wp.vec3i(NOTHING, 0, 0)
        if not has_failed(work, b):
            action = next_action(work, b, first[0], done, seed)
    kept = work.tally[b, KEPT]
    if work.mesh.vertex_gone[kept] != wp.uint8(0):
        fail(work, b)
    if first[0] < GLIDE and not has_failed(work, b):
        if first[0] == COLLAPSE and work.mesh.valence[kept] > MOST_MERGED:
            fail(work, b)
        if not is_core_sound(work, b):
            fail(work, b)


@wp.func
def smooth_core(work: Work, b: wp.int32, kind: wp.int32) -> None:
    """Move the kept vertex, or all that a rotation touched, to better shapes."""
    for n in range(work.tally[b, TOUCHED]):
        v = work.core[b, n]
        if work.mesh.vertex_gone[v] == wp.uint8(0) and (kind == ROTATE or v == work.tally[b, KEPT]):
            work.mesh.position[v] = goal_of(work, v)


@wp.func
def settle_core(
    context: SurfaceContext, guard: Guard, work: Work, b: wp.int32, kind: wp.int32, count: wp.int32
) -> None:
    """Put what was moved back on the surface."""
    for n in range(work.tally[b, TOUCHED]):
        v = work.core[b, n]
        if work.mesh.vertex_gone[v] == wp.uint8(0) and (kind == ROTATE or v == work.tally[b, KEPT]):
            if not has_failed(work, b):
                put_on_surface(context, guard, work, b, v, count)


@wp.func
def try_places(
    context: SurfaceContext,
    guard: Guard,
    sweep: Sweep,
    work: Work,
    b: wp.int32,
    kind: wp.int32,
    before: PatchMeasures,
    budget: wp.float32,
) -> wp.int32:
    """Move the vertices of an operation, and judge; fail where a rule is broken, and return which."""
    reason = int(DISTANCE)
    then = before
    gather_patch_of(work, b, kind == ROTATE, False)
    if kind != FIT:
        smooth_core(work, b, kind)
        if is_hopeless(guard, work, b, before, budget):
            reason = int(SHAPE)
            fail(work, b)
    count = int(0)
    if not has_failed(work, b):
        count = list_points(guard, work, b)
    if not has_failed(work, b):  # a patch may have more points than there is room for
        if kind == FIT:
            fit_vertex(context, guard, work, b, count, sweep.edge, sweep.stride, (sweep.seed & 1) == 1)
            if not has_failed(work, b):  # most fail, so the quads are measured only now as they were
                exchange_places(work, b)
                then = measure_patch(work, b)
                exchange_places(work, b)
        else:
            for step in range(wp.where(kind == ROTATE, 2, 1)):
                if step > 0:
                    smooth_core(work, b, kind)
                settle_core(context, guard, work, b, kind, count)
    if not has_failed(work, b):
        may_warp = kind == ROTATE or guard.least_shape < WARPS_BELOW
        if not is_well_shaped(guard, work, b, then, budget, may_warp, kind == ROTATE):
            reason = int(SHAPE)
            fail(work, b)
    if not has_failed(work, b):
        if not is_low(guard, work, b, count):
            fail(work, b)
    if not has_failed(work, b):
        assign_points(guard, work, b, count)
    return reason


@wp.func
def attempt(
    context: SurfaceContext,
    guard: Guard,
    sweep: Sweep,
    work: Work,
    b: wp.int32,
    action: wp.vec3i,
    seed: wp.uint32,
) -> wp.bool:
    """Try an operation: afterwards it is done, or nothing has changed."""
    begin(work, b)
    kind = action[0]
    if kind >= GLIDE:
        work.tally[b, KEPT] = action[1]
    else:
        work.tally[b, KEPT] = quad_corner(work.mesh.corners, action[1], wp.where(kind == COLLAPSE, 2, 0))
    work.tally[b, REMOVED] = wp.where(kind == COLLAPSE, work.mesh.corners[action[1]], work.tally[b, KEPT])
    reason = int(TOPOLOGY)
    before = PatchMeasures()
    if kind == COLLAPSE:
        before = measure_rings(work, b)
    change(work, b, action, sweep.quota[b] - sweep.taken[b], seed)
    if not has_failed(work, b):
        if kind == ROTATE or kind == GLIDE or (kind == COLLAPSE and quads_removed(work, b) > 1):
            before = measure_before(work, b, kind == ROTATE)
        keep_places(work, b)
        if not has_failed(work, b):
            budget = wp.where(kind == GLIDE, before.cost, UNBOUNDED)
            reason = try_places(context, guard, sweep, work, b, kind, before, budget)
        if has_failed(work, b):
            restore_places(work, b)
    done = not has_failed(work, b)
    if not done:
        undo(work, b)
    if kind == COLLAPSE:
        if done:
            sweep.taken[b] = sweep.taken[b] + quads_removed(work, b)
        else:
            sweep.refusals[b, reason] = sweep.refusals[b, reason] + 1
    return done


@wp.kernel
def sweep_kernel(
    # In:
    first: wp.int32,
    context: SurfaceContext,
    guard: Guard,
    polishes: wp.bool,
    starts: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    begin_at: wp.int32,
    end_at: wp.int32,
    # In/out:
    sweep_inout: Sweep,
    work_inout: Work,
) -> None:
    """Collapse a region's cheap quads, or polish round its vertices, from visit `begin_at` up to `end_at`.

    One thread a region.
    """
    b = first + wp.tid()
    for visit in range(begin_at, wp.min(end_at, starts[b + 1] - starts[b])):
        item = items[starts[b] + visit]
        choices = wp.where(polishes, sweep_inout.tries + 1, 2)
        for choice in range(first_choice(work_inout, sweep_inout, polishes, item), choices):
            seed = scrambled(scrambled(wp.uint32(sweep_inout.seed * 64 + choice)) ^ wp.uint32(item))
            action = action_of(work_inout, b, sweep_inout, polishes, item, choice, seed)
            if action[0] != NOTHING:
                done = attempt(context, guard, sweep_inout, work_inout, b, action, seed)
                if done:
                    forget_refusals(work_inout, b, sweep_inout, action[0])
                else:
                    note_refusal(sweep_inout, action, item)
