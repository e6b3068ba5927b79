"""The last of the further simplification: the worst quads get better shapes, one vertex after the other.

Smoothing moves all vertices towards the mean of what their quads want; the worst quad may lose there, and
stays as it is. Here each vertex of a bad quad tries steps of three lengths in eight directions of its tangent
plane, of a sliver also out of that plane, and takes those that make its worst quad better, as long as none of
its quads turns or folds, rises from the surface or leaves a guest behind.
"""

import warp as wp

from dmc_cli.mesh.glide import Scene
from dmc_cli.mesh.more_checks import (
    folded_sides,
    gather_patch,
    highest_of_patch,
    measure_patch,
    quad_area,
)
from dmc_cli.mesh.more_guests import lodge_guests
from dmc_cli.mesh.more_moves import keep_places, restore_places, settle_core
from dmc_cli.mesh.more_work import Work, begin, fail, has_failed, onward, quad_corner, touch
from dmc_cli.mesh.relax_checks import SLIVER

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

LEAST_GAIN = wp.constant(1.0e-4)
"""What a step must gain in shape."""

PASSES = 6
"""Times that a block goes through its vertices."""

DIRECTIONS, LENGTHS = 8, 3
"""Steps that are tried at a vertex: of 0.4 of the mean length of its sides, and a third of that twice."""


EIGHTH = wp.constant(0.70710678)
"""Half the root of 2: of a direction, and of it turned by a right angle, for one turned by half of that."""


@wp.func
def mean_side(work: Work, v: wp.int32) -> wp.float32:
    """Return the mean length of the sides at a vertex."""
    total = float(0.0)
    h = work.vertex_halfedge[v]
    size = work.valence[v]
    for _turn in range(size):
        total += wp.length(work.position[quad_corner(work, h, 1)] - work.position[v])
        h = onward(work, h)
    return total / float(size)


@wp.func
def upward(work: Work, v: wp.int32) -> wp.vec3:
    """Return the surface's normal at a vertex; where the field's gradient vanishes, that of its quads."""
    up = work.normal[v]
    if wp.length_sq(up) == 0.0:
        h = work.vertex_halfedge[v]
        for _turn in range(work.valence[v]):
            up += quad_area(work, h >> 2)
            h = onward(work, h)
    return wp.normalize(up)


@wp.func
def measure_ring(scene: Scene, work: Work, b: wp.int32) -> wp.vec4:
    """Return the least shape of the quads round it, and how many are turned, folded sides, largest height."""
    gather_patch(work, b)
    measures = measure_patch(work, b)
    return wp.vec4(measures[1], measures[2], float(folded_sides(work, b)), highest_of_patch(scene, work, b))


@wp.func
def is_better(after: wp.vec4, before: wp.vec4, limit: wp.float32) -> wp.bool:
    """Return whether a ring is better in shape and no worse otherwise; slivers may fold."""
    better = after[0] > before[0] + LEAST_GAIN and after[1] <= before[1]
    better = better and (after[2] <= before[2] or before[0] < SLIVER)
    return better and after[3] <= wp.max(before[3], limit)


@wp.func
def try_step(
    scene: Scene, work: Work, b: wp.int32, v: wp.int32, step: wp.vec3, before: wp.vec4, limit: wp.float32
) -> wp.vec4:
    """Move a vertex if that makes its quads better; return their measures."""
    found = before
    begin(work, b)
    touch(work, b, v)
    keep_places(work, b)
    work.position[v] = work.position[v] + step
    settle_core(scene, work, b)
    if not has_failed(work, b):
        found = measure_ring(scene, work, b)
        if not is_better(found, before, limit):
            fail(work, b)
    if not has_failed(work, b):
        lodge_guests(scene, work, b)
    if has_failed(work, b):
        restore_places(work, b)
        found = before
    return found


@wp.func
def try_steps(scene: Scene, work: Work, b: wp.int32, v: wp.int32, planes: wp.int32, limit: wp.float32):
    """Try steps of all lengths and directions in the tangent plane, or in three planes at right angles."""
    normal = upward(work, v)
    way = wp.where(wp.abs(normal[0]) < 0.6, wp.vec3(1.0, 0.0, 0.0), wp.vec3(0.0, 1.0, 0.0))
    way = wp.normalize(wp.cross(normal, way))
    longest = 0.4 * mean_side(work, v)
    length = longest
    before = measure_ring(scene, work, b)
    for n in range(planes * LENGTHS * DIRECTIONS):
        before = try_step(scene, work, b, v, length * way, before, limit)
        way = EIGHTH * (way + wp.cross(normal, way))
        if n % DIRECTIONS == DIRECTIONS - 1:
            length = length / 3.0
        if n % (LENGTHS * DIRECTIONS) == LENGTHS * DIRECTIONS - 1:
            length = longest
            along = wp.cross(normal, way)
            normal = way
            way = along


@wp.func
def mend_vertex(scene: Scene, work: Work, b: wp.int32, v: wp.int32, bad: wp.float32, limit: wp.float32):
    """Try steps at a vertex if one of its quads has a shape of `bad` at most."""
    begin(work, b)
    touch(work, b, v)
    gather_patch(work, b)
    least = measure_patch(work, b)[1]
    if least <= bad and not has_failed(work, b):
        try_steps(scene, work, b, v, wp.where(least < SLIVER, 3, 1), limit)


@wp.kernel
def mend_kernel(
    # In:
    first: wp.int32,
    scene: Scene,
    starts: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    bad: wp.float32,
    limit: wp.float32,
    # In/out:
    work_inout: Work,
):
    """Mend the quads round the vertices of a block, in turn. One thread a block."""
    b = first + wp.tid()
    for _turn in range(PASSES):
        for n in range(starts[b], starts[b + 1]):
            mend_vertex(scene, work_inout, b, items[n], bad, limit)
