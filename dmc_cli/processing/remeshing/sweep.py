"""Sweep over the regions of a round: each tries operations at its irregular vertices.

An operation is drawn by chance, followed by a chain of rotations or not (`chains.py`), and kept if it
lowers the energy, the sum of (valence - 4)^2 and 0.6 times the sum of 1 - shape (equation 9 of Grosso & Zint
2021), or raises it by no more than -T ln(u) with u by chance. Quads that go or come have a price, and so have
those that come to be warped: regions keep account of them (`warp_accounts.py`). Chance is
a hash of round, vertex and try, and a region is the work of one thread, so the mesh is the same on any device
and for any number of threads.
"""

import warp as wp

from dmc_cli.mesh import REGULAR, next_outgoing, quad_corner
from dmc_cli.processing.quad_square import COS_SEVERE
from dmc_cli.processing.remeshing.chains import (
    UNKNOWN,
    allowance,
    collapse_cost,
    link,
    next_rotation,
    rotation_cost,
    scrambled,
)
from dmc_cli.processing.remeshing.checks import (
    SHAPE_WEIGHT,
    PatchMeasures,
    folded_sides,
    gather_patch,
    highest_of_patch,
    irregularity_change,
    is_core_sound,
    measure_patch,
    quads_removed,
)
from dmc_cli.processing.remeshing.moves import keep_places, restore_places, settle_core, smooth_core
from dmc_cli.processing.remeshing.operations import (
    DOUBLETS,
    collapse_quad,
    doublet_of,
    rotate_edge,
    split_vertex,
)
from dmc_cli.processing.remeshing.tracked_points import assign_points
from dmc_cli.processing.remeshing.warp_accounts import can_pay, pay
from dmc_cli.processing.remeshing.work import (
    CHANGES,
    HAS_SPLIT,
    KEPT,
    REMOVED,
    SPARE_QUAD,
    SPARE_VERTEX,
    TOUCHED,
    Work,
    begin,
    fail,
    has_failed,
    is_own,
    outgoing,
    redo,
    undo,
)
from dmc_cli.processing.tangent_step import SurfaceContext

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

SHAPE_FLOOR = wp.constant(0.3)
"""Shapes below this must not become worse."""

WARPED_PRICE = wp.constant(0.2)
"""What a quad more that is warped by over 30 degrees costs."""

HEIGHT_LIMIT = wp.constant(0.35)
"""How far, in cells, centres of quads and midpoints of sides may be from the surface after an operation."""

GEOMETRY_CAN_GIVE = wp.constant(0.6)
"""What better shapes and less warp may make good at most; what costs more is not looked at."""


CHAINED = 160
"""Of 256 operations tried, those that are followed by a chain if they gain nothing."""

NOTHING, ROTATE, COLLAPSE, SPLIT = wp.constant(0), wp.constant(1), wp.constant(2), wp.constant(3)
"""Kinds of operations."""

ROTATIONS, COLLAPSES = 8, 4
"""Of 16 operations tried; the others split a vertex."""


PASSES = 4
"""Times that a region goes through its vertices in a round: making regions takes as long as going once."""


@wp.struct
class Rules:
    """What holds for one sweep: its number, tries, temperature, prices of a quad that goes and of warp."""

    round: wp.int32
    tries: wp.int32
    temperature: wp.float32
    price: wp.float32
    warp_price: wp.float32


@wp.func
def choice(number: wp.uint32, shift: wp.int32, count: wp.int32) -> wp.int32:
    """Return a number below `count` from eight bits of a random number."""
    return (wp.int32((number >> wp.uint32(shift)) & wp.uint32(255)) * count) >> 8


@wp.func
def first_action(work: Work, b: wp.int32, v: wp.int32, number: wp.uint32, most: wp.float32) -> wp.vec3i:
    """Return the operation at or near a vertex that a random number names: its kind, halfedge and detail.

    It is `NOTHING` where it is plain that it adds more than `most` to the irregularity.
    """
    h = outgoing(work, v, choice(number, 0, work.mesh.valence[v]))
    action = wp.vec3i(NOTHING, 0, 0)
    kind = choice(number, 8, 16)
    if kind < ROTATIONS:
        side = (h & ~3) | ((h + choice(number, 16, 4)) & 3)
        forward = choice(number, 24, 2)
        cost = rotation_cost(work, b, side, forward == 1)
        if cost == UNKNOWN or float(cost) <= most:
            action = wp.vec3i(ROTATE, side, forward)
    elif kind < ROTATIONS + COLLAPSES:
        side = (h & ~3) | ((h + choice(number, 16, 2)) & 3)
        if float(collapse_cost(work, side)) <= most:
            work.tally[b, REMOVED] = quad_corner(work.mesh.corners, side, 0)
            work.tally[b, KEPT] = quad_corner(work.mesh.corners, side, 2)
            action = wp.vec3i(COLLAPSE, side, 0)
    else:
        side = (h & ~3) | ((h + choice(number, 16, 4) / 3) & 3)
        if is_own(work, b, work.mesh.corners[side]):
            steps = 2 + choice(number, 24, wp.max(work.mesh.valence[work.mesh.corners[side]] - 3, 1))
            action = wp.vec3i(SPLIT, side, steps)
    return action


@wp.func
def next_action(work: Work, b: wp.int32, number: wp.uint32, done: wp.int32, is_chained: wp.bool) -> wp.vec3i:
    """Return what follows `done` operations: a doublet's removal, the next link of a chain, or nothing."""
    action = wp.vec3i(NOTHING, 0, 0)
    doublet = doublet_of(work, b, work.tally[b, TOUCHED])
    if doublet >= 0:
        if done <= DOUBLETS:
            action = wp.vec3i(COLLAPSE, work.mesh.vertex_halfedge[doublet], 0)
    elif is_chained:
        if irregularity_change(work, b) >= 0:
            rotation = next_rotation(work, b, scrambled(number + wp.uint32(done)))
            if rotation < 0:
                fail(work, b)
            else:
                action = wp.vec3i(ROTATE, rotation >> 1, rotation & 1)
    return action


@wp.func
def propose(
    work: Work, b: wp.int32, v: wp.int32, number: wp.uint32, most: wp.float32, last: wp.vec2i
) -> None:
    """Do the operation that a random number names, and what follows it.

    Each kind is called at one place only: the compiler copies it there.
    """
    action = first_action(work, b, v, number, most)
    is_chained = choice(number, 24, 256) < CHAINED
    done = int(0)
    if action[0] == NOTHING:
        fail(work, b)
    while action[0] != NOTHING and not has_failed(work, b):
        if action[0] == ROTATE:
            if done > 0:
                link(work, b, action[1])
            rotate_edge(work, b, action[1], action[2] == 1)
        elif action[0] == COLLAPSE:
            collapse_quad(work, b, action[1])
        else:
            split_vertex(work, b, action[1], action[2], last[0], last[1])
        done += 1
        action = wp.vec3i(NOTHING, 0, 0)
        if not has_failed(work, b):
            action = next_action(work, b, number, done, is_chained)


@wp.func
def begin_split(work: Work, b: wp.int32, fresh: wp.int32) -> None:
    """Place the new vertex of a split where the vertex is that it was split from."""
    of = work.core[b, 0]
    work.mesh.position[fresh] = work.mesh.position[of]
    work.mesh.cell[fresh] = work.mesh.cell[of]
    work.mesh.local[fresh] = work.mesh.local[of]
    work.normal[fresh] = work.normal[of]


@wp.func
def spread_split(work: Work, fresh: wp.int32) -> None:
    """Move the new vertex of a split 0.4 of the way to the mean of its neighbours."""
    h = work.mesh.vertex_halfedge[fresh]
    mean = wp.vec3(0.0, 0.0, 0.0)
    size = work.mesh.valence[fresh]
    for _n in range(size):
        mean += work.mesh.position[quad_corner(work.mesh.corners, h, 1)]
        h = next_outgoing(work.mesh.twin, h)
    work.mesh.position[fresh] = 0.6 * work.mesh.position[fresh] + 0.4 * mean / float(size)


@wp.func
def measure_before(work: Work, b: wp.int32) -> PatchMeasures:
    """Return the measures of the patch before an operation; it is left as it is after it."""
    undo(work, b)
    gather_patch(work, b)
    before = measure_patch(work, b)
    before.folds = folded_sides(work, b)
    redo(work, b)
    return before


@wp.func
def try_places(
    context: SurfaceContext,
    work: Work,
    b: wp.int32,
    budget: wp.float32,
    before: PatchMeasures,
    warp_price: wp.float32,
) -> None:
    """Smooth an operation's vertices and put them on the surface; fail where it does not pay."""
    keep_places(work, b)
    after = before
    fresh = work.tally[b, SPARE_VERTEX]
    if work.tally[b, HAS_SPLIT] == 1:
        spread_split(work, fresh)
    smooth_core(work, b)
    gather_patch(work, b)
    for stage in range(2):
        if stage == 1 and not has_failed(work, b):
            settle_core(context, work, b)
        if not has_failed(work, b) and (stage == 1 or irregularity_change(work, b) >= 0):
            after = measure_patch(work, b)
            if is_worse(after, before, budget, warp_price) or not can_pay(work, b, after, before):
                fail(work, b)
    if not has_failed(work, b):
        if folded_sides(work, b) > before.folds or highest_of_patch(context, work, b) > HEIGHT_LIMIT:
            fail(work, b)
    if not has_failed(work, b):
        assign_points(context, work, b)
    if has_failed(work, b):
        restore_places(work, b)
    else:
        pay(work, b, after, before)


@wp.func
def attempt(
    context: SurfaceContext,
    work: Work,
    b: wp.int32,
    v: wp.int32,
    rules: Rules,
    number: wp.uint32,
    last: wp.vec2i,
) -> None:
    """Try one operation at a vertex: afterwards it is done, or nothing has changed."""
    begin(work, b)
    margin = allowance(rules.temperature, scrambled(number))
    propose(work, b, v, number, margin + GEOMETRY_CAN_GIVE, last)
    if not has_failed(work, b):
        cost = float(irregularity_change(work, b)) + rules.price * float(quads_removed(work, b))
        if cost > margin + GEOMETRY_CAN_GIVE or not is_core_sound(work, b):
            fail(work, b)
        else:
            judge_places(context, work, b, margin - cost, rules.warp_price)
    if has_failed(work, b):
        undo(work, b)
    else:
        work.tally[b, CHANGES] = work.tally[b, CHANGES] + 1
        work.tally[b, SPARE_VERTEX] = work.tally[b, SPARE_VERTEX] + work.tally[b, HAS_SPLIT]
        work.tally[b, SPARE_QUAD] = work.tally[b, SPARE_QUAD] + work.tally[b, HAS_SPLIT]


@wp.func
def judge_places(
    context: SurfaceContext, work: Work, b: wp.int32, budget: wp.float32, warp_price: wp.float32
) -> None:
    """Fail unless the quads round an operation cost no more than `budget`, against before."""
    before = measure_before(work, b)
    whole = budget + geometry_cost(before, warp_price)
    if work.tally[b, HAS_SPLIT] == 1:
        begin_split(work, b, work.tally[b, SPARE_VERTEX])
    if whole < 0.0:
        fail(work, b)
    if not has_failed(work, b):
        try_places(context, work, b, whole, before, warp_price)


@wp.func
def geometry_cost(patch: PatchMeasures, warp_price: wp.float32) -> wp.float32:
    """Return what the shapes and the warp of a patch's quads cost."""
    warp = WARPED_PRICE * float(patch.warped) + 0.001 * warp_price * float(patch.warp_excess)
    return SHAPE_WEIGHT * patch.cost + warp


@wp.func
def is_worse(
    after: PatchMeasures, before: PatchMeasures, budget: wp.float32, warp_price: wp.float32
) -> wp.bool:
    """Return whether a patch costs more than it may, or has a worse quad than before.

    Worse is one of a lower shape, an inverted one, and one that is warped by over 60 degrees and further.
    """
    worse = geometry_cost(after, warp_price) > budget
    worse = worse or after.severe > before.severe
    worse = worse or after.warp_cosine < wp.min(before.warp_cosine, COS_SEVERE)
    worse = worse or after.least < wp.min(before.least, SHAPE_FLOOR)
    return worse or after.inverted > before.inverted


@wp.func
def try_vertex(
    context: SurfaceContext,
    work: Work,
    b: wp.int32,
    v: wp.int32,
    rules: Rules,
    pass_number: wp.int32,
    last: wp.vec2i,
) -> None:
    """Try operations at a vertex as long as it is there and irregular."""
    for n in range(rules.tries):
        if work.mesh.vertex_gone[v] == wp.uint8(0) and work.mesh.valence[v] != REGULAR:
            seed = scrambled(wp.uint32((rules.round * PASSES + pass_number) * rules.tries + n))
            attempt(context, work, b, v, rules, scrambled(seed ^ wp.uint32(v)), last)


@wp.kernel
def sweep_kernel(
    # In:
    first: wp.int32,
    context: SurfaceContext,
    rules: Rules,
    starts: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    spare_starts: wp.array(dtype=wp.int64),
    vertex_count: wp.int32,
    quad_count: wp.int32,
    begin: wp.int32,
    end: wp.int32,
    # In/out:
    work_inout: Work,
) -> None:
    """Try operations at the irregular vertices of a region, one by one, from visit `begin` up to `end`.

    One thread a region; `PASSES` visits a vertex.
    """
    b = first + wp.tid()
    if begin == 0:
        work_inout.tally[b, SPARE_VERTEX] = vertex_count + wp.int32(spare_starts[b])
        work_inout.tally[b, SPARE_QUAD] = quad_count + wp.int32(spare_starts[b])
        work_inout.tally[b, CHANGES] = 0
    last = wp.vec2i(vertex_count + wp.int32(spare_starts[b + 1]), quad_count + wp.int32(spare_starts[b + 1]))
    count = starts[b + 1] - starts[b]
    for visit in range(begin, wp.min(end, PASSES * count)):
        pass_number = visit // count
        v = items[starts[b] + visit - pass_number * count]
        try_vertex(context, work_inout, b, v, rules, pass_number, last)
