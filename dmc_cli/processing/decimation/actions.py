"""Say what a sweep tries: a collapse of a cheap quad, a rotation, or a step of a vertex."""

import warp as wp

from dmc_cli.mesh import REGULAR, next_outgoing, quad_corner
from dmc_cli.processing.decimation.costs import cost_of
from dmc_cli.processing.remeshing import ASCENT, TOUCHED, Work, goal_of, is_own, outgoing, rotation_cost

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

NOTHING, COLLAPSE, ROTATE = wp.constant(0), wp.constant(1), wp.constant(2)
GLIDE, FIT = wp.constant(3), wp.constant(4)
"""Kinds of operations; the last two move a vertex."""

SHORT_STEP = wp.constant(0.02)
"""Steps to a better shape that are not worth taking, against the mean length of the sides."""

MOST_REFUSALS = wp.constant(4)
"""Refusals that are remembered of a quad at most."""


@wp.struct
class Sweep:
    """What a sweep does, and what each region may take away and has, (R,), and why it refused, (R, REASONS).

    Attributes:
        quota: Quads that a region may take away.
        taken: Quads that it has taken away.
        refusals: How often it has refused a collapse, for each reason.
        refused: (Q,), how often each quad was refused.
        vain: (V,), rotations tried in vain at each vertex since quads near it last changed.
        still: (V,), 1 for vertices that cannot glide until one of their quads changes.
        weight: (Q,), what a collapse costs more where quads are large.
        threshold: What a collapse may cost.
        per_step: The factor of cost of a unit of irregularity.
        edge: The mean length of the sides.
        tries: Rotations that are tried at an irregular vertex.
        stride: Steps of vertices that are fitted, against the mean length of the sides; 0 to let them glide.
        most_vain: Rotations that may be tried in vain at a vertex until quads near it change.
        seed: A number of the sweep's own.
    """

    quota: wp.array(dtype=wp.int32)
    taken: wp.array(dtype=wp.int32)
    refusals: wp.array2d(dtype=wp.int32)
    refused: wp.array(dtype=wp.uint8)
    vain: wp.array(dtype=wp.uint8)
    still: wp.array(dtype=wp.uint8)
    weight: wp.array(dtype=wp.float32)
    threshold: wp.float32
    per_step: wp.float32
    edge: wp.float32
    tries: wp.int32
    stride: wp.float32
    most_vain: wp.int32
    seed: wp.int32


@wp.func
def note_refusal(sweep: Sweep, action: wp.vec3i, item: wp.int32) -> None:
    """Note that a collapse was refused at a quad, or that a vertex could not be rotated at or glide."""
    if action[0] == COLLAPSE:
        sweep.refused[item] = wp.uint8(wp.min(wp.int32(sweep.refused[item]) + 1, MOST_REFUSALS))
    elif action[0] == ROTATE:
        sweep.vain[item] = wp.uint8(wp.int32(sweep.vain[item]) + 1)
    elif action[0] == GLIDE:
        sweep.still[item] = wp.uint8(1)


@wp.func
def forget_refusals(work: Work, b: wp.int32, sweep: Sweep, kind: wp.int32) -> None:
    """Let vertices round those of an operation glide again, and be rotated at unless it was a step."""
    for n in range(work.tally[b, TOUCHED]):
        v = work.core[b, n]
        if work.mesh.vertex_gone[v] == wp.uint8(0):
            h = work.mesh.vertex_halfedge[v]
            for _n in range(work.mesh.valence[v]):
                for c in range(3):
                    w = quad_corner(work.mesh.corners, h, c)
                    if is_own(work, b, w):
                        sweep.still[w] = wp.uint8(0)
                        if kind < GLIDE:
                            sweep.vain[w] = wp.uint8(0)
                h = next_outgoing(work.mesh.twin, h)


@wp.func
def collapse_of(work: Work, b: wp.int32, sweep: Sweep, q: wp.int32, choice: wp.int32) -> wp.vec3i:
    """Return the collapse of one of a quad's diagonals if it may be tried, else nothing."""
    action = wp.vec3i(NOTHING, 0, 0)
    if work.mesh.face_gone[q] == wp.uint8(0) and sweep.taken[b] < sweep.quota[b]:
        h = 4 * q + choice
        cost = cost_of(
            work.mesh.corners,
            work.mesh.valence,
            work.mesh.position,
            sweep.refused,
            sweep.weight,
            sweep.per_step,
            h,
        )
        if cost <= sweep.threshold:
            action = wp.vec3i(COLLAPSE, h, 0)
    return action


@wp.func
def rotation_at(work: Work, b: wp.int32, v: wp.int32, number: wp.uint32) -> wp.vec3i:
    """Return the rotation near a vertex that a random number names, if a chain may begin with it."""
    action = wp.vec3i(NOTHING, 0, 0)
    if work.mesh.valence[v] != REGULAR:
        h = outgoing(work, v, wp.int32((number >> wp.uint32(4)) % wp.uint32(work.mesh.valence[v])))
        side = (h & ~3) | wp.int32(number & wp.uint32(3))
        forward = wp.int32((number >> wp.uint32(2)) & wp.uint32(1))
        if rotation_cost(work, b, side, forward == 1) <= ASCENT:
            action = wp.vec3i(ROTATE, side, forward)
    return action


@wp.func
def first_choice(work: Work, sweep: Sweep, polishes: wp.bool, item: wp.int32) -> wp.int32:
    """Return the first of the choices at a quad, or at a vertex: where none can be rotated, the step."""
    first = int(0)
    if polishes:  # an item is a vertex then; `and` would look at its valence whatever it is
        if work.mesh.valence[item] == REGULAR or wp.int32(sweep.vain[item]) >= sweep.most_vain:
            first = sweep.tries
    return first


@wp.func
def action_of(
    work: Work,
    b: wp.int32,
    sweep: Sweep,
    polishes: wp.bool,
    item: wp.int32,
    choice: wp.int32,
    seed: wp.uint32,
) -> wp.vec3i:
    """Return what is to be tried at a quad, or at a vertex: rotations, at last a step."""
    if not polishes:
        return collapse_of(work, b, sweep, item, choice)
    action = wp.vec3i(NOTHING, 0, 0)
    if choice < sweep.tries:
        if wp.int32(sweep.vain[item]) < sweep.most_vain:
            action = rotation_at(work, b, item, seed)
        return action
    if sweep.stride > 0.0:
        return wp.vec3i(FIT, item, 0)
    if sweep.still[item] == wp.uint8(0):
        if wp.length(goal_of(work, item) - work.mesh.position[item]) > SHORT_STEP * sweep.edge:
            action = wp.vec3i(GLIDE, item, 0)
    return action
