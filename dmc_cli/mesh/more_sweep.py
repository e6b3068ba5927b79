"""A sweep of the further simplification: each block tries operations at its irregular vertices.

An operation is drawn by chance, done, and kept if it lowers the energy, the sum of (valence - 4)^2 and 0.3
times the sum of 1 - shape (equation 9 of Grosso & Zint 2021), or raises it by no more than -T ln(u) with u by
chance; quads that go or come have a price. Chance is a hash of round, vertex and try, and a block is the work
of one thread, so the mesh is the same on any device and for any number of threads.
"""

import warp as wp

from dmc_cli.mesh.glide import Scene
from dmc_cli.mesh.more_checks import (
    SHAPE_WEIGHT,
    gather_patch,
    highest_of_patch,
    irregularity,
    is_core_sound,
    measure_patch,
)
from dmc_cli.mesh.more_moves import keep_places, restore_places, settle_core, smooth_core
from dmc_cli.mesh.more_operations import DOUBLETS, collapse_diagonal, doublet_of, open_quad, rotate_edge
from dmc_cli.mesh.more_work import (
    CHANGES,
    LEFT,
    MERGED,
    OPENED,
    SPARE_QUAD,
    SPARE_VERTEX,
    TOUCHED,
    Work,
    begin,
    fail,
    has_failed,
    is_own,
    onward,
    outgoing,
    quad_corner,
    redo,
    undo,
)
from dmc_cli.mesh.valences import REGULAR

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

SHAPE_FLOOR = wp.constant(0.3)
"""Shapes below this must not become worse."""

HEIGHT_LIMIT = wp.constant(0.35)
"""How far, in cells, centres of quads and midpoints of sides may be from the surface after an operation."""

HIGHEST_BIT = wp.constant(wp.uint32(0x80000000))
HASH_FACTOR, HASH_STEP = wp.constant(wp.uint32(747796405)), wp.constant(wp.uint32(2891336453))
HASH_MIX = wp.constant(wp.uint32(277803737))
"""Of the permuted congruential generator's 32-bit hash (O'Neill 2014)."""

GEOMETRY_CAN_GIVE = wp.constant(0.6)
"""What better shapes may make good at most; what costs more is dropped without looking at them."""


ROTATIONS, COLLAPSES = 8, 4
"""Of 16 operations tried; the others open a quad."""


PASSES = 4
"""Times that a block goes through its vertices in a round: making blocks takes as long as going once."""


@wp.struct
class Rules:
    """What holds for one sweep: its number, tries, temperature, the price of a quad that goes."""

    round: wp.int32
    tries: wp.int32
    temperature: wp.float32
    price: wp.float32


@wp.func
def allowance(temperature: wp.float32, number: wp.uint32) -> wp.float32:
    """Return -T ln(u) for a random number, the logarithm made of straight pieces: the same on any device."""
    zeros = float(0.0)
    x = number | wp.uint32(1)
    while x < HIGHEST_BIT:
        x = x << wp.uint32(1)
        zeros += 1.0
    fraction = wp.float32((x >> wp.uint32(8)) & wp.uint32(0x7FFFFF)) / 8388608.0
    return temperature * 0.6931472 * (zeros + 1.0 - fraction)


@wp.func
def scrambled(x: wp.uint32) -> wp.uint32:
    """Return a hash of 32 bits."""
    y = x * HASH_FACTOR + HASH_STEP
    y = ((y >> ((y >> wp.uint32(28)) + wp.uint32(4))) ^ y) * HASH_MIX
    return (y >> wp.uint32(22)) ^ y


@wp.func
def choice(number: wp.uint32, shift: wp.int32, count: wp.int32) -> wp.int32:
    """Return a number below `count` from eight bits of a random number."""
    return (wp.int32((number >> wp.uint32(shift)) & wp.uint32(255)) * count) >> 8


@wp.func
def distance_change(valence: wp.int32, more: wp.int32) -> wp.int32:
    """Return what a change of a vertex's valence adds to the square of its distance from 4."""
    return (valence + more - 4) * (valence + more - 4) - (valence - 4) * (valence - 4)


@wp.func
def rotation_cost(work: Work, b: wp.int32, h: wp.int32, forward: wp.bool) -> wp.int32:
    """Return what rotating an edge adds to the irregularity: 0 with doublets, 99 off the block."""
    cost = int(99)
    if is_own(work, b, quad_corner(work, h, 0)) and is_own(work, b, quad_corner(work, h, 1)):
        t = work.twin[h]
        u = work.valence[quad_corner(work, h, 0)]
        w = work.valence[quad_corner(work, h, 1)]
        cost = int(0)
        if u > 3 and w > 3:
            step = wp.where(forward, 2, 3)
            cost = distance_change(u, -1) + distance_change(w, -1)
            cost += distance_change(work.valence[quad_corner(work, h, step)], 1)
            cost += distance_change(work.valence[quad_corner(work, t, step)], 1)
    return cost


@wp.func
def collapse_cost(work: Work, h: wp.int32) -> wp.int32:
    """Return what collapsing a diagonal adds to the irregularity, 0 if a doublet comes of it."""
    u = work.valence[quad_corner(work, h, 0)]
    w = work.valence[quad_corner(work, h, 2)]
    s = work.valence[quad_corner(work, h, 1)]
    t = work.valence[quad_corner(work, h, 3)]
    cost = int(0)
    if s > 3 and t > 3:
        cost = distance_change(s, -1) + distance_change(t, -1)
        cost += (u + w - 6) * (u + w - 6) - (u - 4) * (u - 4) - (w - 4) * (w - 4)
    return cost


@wp.func
def propose(work: Work, b: wp.int32, v: wp.int32, number: wp.uint32, most: wp.float32, last: wp.vec2i):
    """Do the operation at or near a vertex that a random number names, and remove the doublets it leaves.

    It fails at once where it is plain that it adds more than `most` to the irregularity.
    """
    h = outgoing(work, v, choice(number, 0, work.valence[v]))
    kind = choice(number, 8, 16)
    if kind < ROTATIONS:
        side = (h & ~3) | ((h + choice(number, 16, 4)) & 3)
        forward = choice(number, 24, 2) == 1
        if float(rotation_cost(work, b, side, forward)) > most:
            fail(work, b)
        else:
            rotate_edge(work, b, side, forward)
    elif kind < ROTATIONS + COLLAPSES:
        side = (h & ~3) | ((h + choice(number, 16, 2)) & 3)
        if float(collapse_cost(work, side)) > most:
            fail(work, b)
        else:
            work.tally[b, LEFT] = quad_corner(work, side, 0)
            work.tally[b, MERGED] = quad_corner(work, side, 2)
            collapse_diagonal(work, b, side)
    else:
        side = (h & ~3) | ((h + choice(number, 16, 4) / 3) & 3)
        if is_own(work, b, work.corners[side]):
            steps = 2 + choice(number, 24, wp.max(work.valence[work.corners[side]] - 3, 1))
            open_quad(work, b, side, steps, last[0], last[1])
        else:
            fail(work, b)
    for _doublet in range(DOUBLETS):
        if not has_failed(work, b):
            doublet = doublet_of(work, b, work.tally[b, TOUCHED])
            if doublet >= 0:
                collapse_diagonal(work, b, work.vertex_halfedge[doublet])


@wp.func
def begin_opened(work: Work, b: wp.int32, fresh: wp.int32):
    """Start a vertex that a quad was opened for where the one is that it was split from."""
    of = work.core[b, 0]
    work.position[fresh] = work.position[of]
    work.cell[fresh] = work.cell[of]
    work.local[fresh] = work.local[of]
    work.normal[fresh] = work.normal[of]


@wp.func
def spread_opened(work: Work, fresh: wp.int32):
    """Move it a little to its side."""
    h = work.vertex_halfedge[fresh]
    mean = wp.vec3(0.0, 0.0, 0.0)
    size = work.valence[fresh]
    for _turn in range(size):
        mean += work.position[quad_corner(work, h, 1)]
        h = onward(work, h)
    work.position[fresh] = 0.6 * work.position[fresh] + 0.4 * mean / float(size)


@wp.func
def value_before(work: Work, b: wp.int32, price: wp.float32) -> wp.vec3:
    """Return what the mesh before an operation is worth more than its new connectivity allows for.

    That is the energy before, less irregularity and price of quads after; with it the least shape and the
    turned corners of the patch before. The journal is left as it was.
    """
    energy = -float(irregularity(work, b))
    gone = gone_count(work, b)
    undo(work, b)
    energy += float(irregularity(work, b)) - price * float(gone - gone_count(work, b))
    gather_patch(work, b)
    before = measure_patch(work, b)
    redo(work, b)
    return wp.vec3(energy + SHAPE_WEIGHT * before[0], before[1], before[2])


@wp.func
def gone_count(work: Work, b: wp.int32) -> wp.int32:
    """Return how many of the touched vertices are not there."""
    gone = int(0)
    for n in range(work.tally[b, TOUCHED]):
        gone += wp.int32(work.vertex_gone[work.core[b, n]])
    return gone


@wp.func
def try_places(scene: Scene, work: Work, b: wp.int32, before: wp.vec3, margin: wp.float32):
    """Smooth an operation's vertices and put them on the surface; fail where it does not pay."""
    keep_places(work, b)
    fresh = work.tally[b, SPARE_VERTEX]
    if work.tally[b, OPENED] == 1:
        spread_opened(work, fresh)
    smooth_core(work, b)
    gather_patch(work, b)
    budget = before[0] + margin
    if is_worse(measure_patch(work, b), budget, before[1], before[2]):
        fail(work, b)
    if not has_failed(work, b):
        settle_core(scene, work, b)
    if not has_failed(work, b):
        if is_worse(measure_patch(work, b), budget, before[1], before[2]):
            fail(work, b)
    if not has_failed(work, b):
        if highest_of_patch(scene, work, b) > HEIGHT_LIMIT:
            fail(work, b)
    if has_failed(work, b):
        restore_places(work, b)


@wp.func
def attempt(
    scene: Scene, work: Work, b: wp.int32, v: wp.int32, rules: Rules, number: wp.uint32, last: wp.vec2i
):
    """Try one operation at a vertex: afterwards it is done, or nothing has changed."""
    begin(work, b)
    margin = allowance(rules.temperature, scrambled(number))
    propose(work, b, v, number, margin + GEOMETRY_CAN_GIVE, last)
    if not has_failed(work, b) and not is_core_sound(work, b):
        fail(work, b)
    if not has_failed(work, b):
        before = value_before(work, b, rules.price)
        if work.tally[b, OPENED] == 1:
            begin_opened(work, b, work.tally[b, SPARE_VERTEX])
        if before[0] + margin < 0.0:
            fail(work, b)
        else:
            try_places(scene, work, b, before, margin)
    if has_failed(work, b):
        undo(work, b)
    else:
        work.tally[b, CHANGES] = work.tally[b, CHANGES] + 1
        work.tally[b, SPARE_VERTEX] = work.tally[b, SPARE_VERTEX] + work.tally[b, OPENED]
        work.tally[b, SPARE_QUAD] = work.tally[b, SPARE_QUAD] + work.tally[b, OPENED]


@wp.func
def is_worse(after: wp.vec3, budget: wp.float32, least: wp.float32, turned: wp.float32) -> wp.bool:
    """Return whether a patch costs more than it may, has a worse quad than before, or a new fold."""
    worse = SHAPE_WEIGHT * after[0] > budget
    worse = worse or after[1] < wp.min(least, SHAPE_FLOOR)
    return worse or (after[2] > 0.0 and after[2] >= turned)


@wp.func
def try_vertex(
    scene: Scene, work: Work, b: wp.int32, v: wp.int32, rules: Rules, turn: wp.int32, last: wp.vec2i
):
    """Try operations at a vertex as long as it is there and irregular."""
    for n in range(rules.tries):
        if work.vertex_gone[v] == wp.uint8(0) and work.valence[v] != REGULAR:
            seed = scrambled(wp.uint32((rules.round * PASSES + turn) * rules.tries + n))
            attempt(scene, work, b, v, rules, scrambled(seed ^ wp.uint32(v)), last)


@wp.kernel
def sweep_kernel(
    # In:
    first: wp.int32,
    scene: Scene,
    rules: Rules,
    starts: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    spare_starts: wp.array(dtype=wp.int64),
    vertex_count: wp.int32,
    quad_count: wp.int32,
    # In/out:
    work_inout: Work,
):
    """Try operations at the irregular vertices of a block, in turn. One thread a block."""
    b = first + wp.tid()
    work_inout.tally[b, SPARE_VERTEX] = vertex_count + wp.int32(spare_starts[b])
    work_inout.tally[b, SPARE_QUAD] = quad_count + wp.int32(spare_starts[b])
    work_inout.tally[b, CHANGES] = 0
    last = wp.vec2i(vertex_count + wp.int32(spare_starts[b + 1]), quad_count + wp.int32(spare_starts[b + 1]))
    for turn in range(PASSES):
        for n in range(starts[b], starts[b + 1]):
            try_vertex(scene, work_inout, b, items[n], rules, turn, last)
