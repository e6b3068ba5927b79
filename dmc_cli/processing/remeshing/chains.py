"""Follow an operation by rotations that lead to a gain, and tell beforehand what they cost.

A pair of a vertex of valence 3 and one of valence 5 glides along the mesh at no cost, one rotation a step,
and two pairs that meet annihilate. By single steps they meet as random walks do. So an operation that gains
nothing may be followed by rotations, each the cheapest near the vertices that the operation has touched and
never of an edge that was rotated before, until there is a gain (a search of variable depth, as S. Lin and
B. W. Kernighan's of 1973 for tours). The whole is then judged as one operation.
"""

import warp as wp

from dmc_cli.mesh import quad_corner
from dmc_cli.processing.remeshing.checks import irregularity_change
from dmc_cli.processing.remeshing.work import LINKED, TOUCHED, Work, is_own
from dmc_cli.runtime import native

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

DEPTH = wp.constant(10)
"""Rotations of a chain at most."""

ASCENT = 2
"""Cost that a chain may reach before it gains: as of a pair that comes beside one that glides."""

UNKNOWN, OFF_REGION = wp.constant(98), wp.constant(99)
"""Costs of a rotation that leaves a doublet, and of one off the region."""

HIGHEST_BIT = wp.constant(wp.uint32(0x80000000))
TIES = 1024
"""Random numbers that decide between rotations of the same cost."""


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


@wp.func_native(native(__file__, "scrambled"))
def scrambled(number: wp.uint32) -> wp.uint32:
    """Return a random number made from a number."""
    ...


@wp.func
def distance_change(valence: wp.int32, more: wp.int32) -> wp.int32:
    """Return what a change of a vertex's valence adds to the square of its distance from 4."""
    return (valence + more - 4) * (valence + more - 4) - (valence - 4) * (valence - 4)


@wp.func
def rotation_cost(work: Work, b: wp.int32, h: wp.int32, forward: wp.bool) -> wp.int32:
    """Return what rotating an edge adds to the irregularity, or `UNKNOWN` or `OFF_REGION`."""
    cost = int(OFF_REGION)
    if is_own(work, b, quad_corner(work.mesh.corners, h, 0)) and is_own(
        work, b, quad_corner(work.mesh.corners, h, 1)
    ):
        t = work.mesh.twin[h]
        u = work.mesh.valence[quad_corner(work.mesh.corners, h, 0)]
        w = work.mesh.valence[quad_corner(work.mesh.corners, h, 1)]
        cost = int(UNKNOWN)
        if u > 3 and w > 3:
            step = wp.where(forward, 2, 3)
            cost = distance_change(u, -1) + distance_change(w, -1)
            cost += distance_change(work.mesh.valence[quad_corner(work.mesh.corners, h, step)], 1)
            cost += distance_change(work.mesh.valence[quad_corner(work.mesh.corners, t, step)], 1)
    return cost


@wp.func
def collapse_cost(work: Work, h: wp.int32) -> wp.int32:
    """Return what collapsing a diagonal adds to the irregularity, 0 if a doublet comes of it."""
    u = work.mesh.valence[quad_corner(work.mesh.corners, h, 0)]
    w = work.mesh.valence[quad_corner(work.mesh.corners, h, 2)]
    s = work.mesh.valence[quad_corner(work.mesh.corners, h, 1)]
    t = work.mesh.valence[quad_corner(work.mesh.corners, h, 3)]
    cost = int(0)
    if s > 3 and t > 3:
        cost = distance_change(s, -1) + distance_change(t, -1)
        cost += (u + w - 6) * (u + w - 6) - (u - 4) * (u - 4) - (w - 4) * (w - 4)
    return cost


@wp.func
def link(work: Work, b: wp.int32, h: wp.int32) -> None:
    """Note that a chain rotates the edge of halfedge h."""
    work.chain[b, work.tally[b, LINKED]] = h
    work.tally[b, LINKED] = work.tally[b, LINKED] + 1


@wp.func_native(native(__file__, "cheapest_rotation", ASCENT=ASCENT, TIES=TIES))
def cheapest_rotation(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    valence: wp.array(dtype=wp.int32),
    vertex_region: wp.array(dtype=wp.int32),
    vertex_halfedge: wp.array(dtype=wp.int32),
    vertex_gone: wp.array(dtype=wp.uint8),
    core: wp.array2d(dtype=wp.int32),
    touched: wp.int32,
    chain: wp.array2d(dtype=wp.int32),
    linked: wp.int32,
    b: wp.int32,
    change: wp.int32,
    number: wp.uint32,
) -> wp.int32:
    """Return the cheapest rotation in the quads round touched irregular vertices, as `next_rotation` does.

    What rotations cost is `rotation_cost`'s: 4, less twice what the edge's ends have more quads than those of
    the edge that it becomes. `change` is what the chain has added to the irregularity so far.
    """
    ...


@wp.func
def next_rotation(work: Work, b: wp.int32, number: wp.uint32) -> wp.int32:
    """Return the cheapest rotation in the quads round touched irregular vertices that a chain may go on by.

    It is twice the halfedge, and one more for forward; -1 if there is none.
    """
    found = int(-1)
    if work.tally[b, LINKED] < DEPTH:
        found = cheapest_rotation(
            work.mesh.corners,
            work.mesh.twin,
            work.mesh.valence,
            work.vertex_region,
            work.mesh.vertex_halfedge,
            work.mesh.vertex_gone,
            work.core,
            work.tally[b, TOUCHED],
            work.chain,
            work.tally[b, LINKED],
            b,
            irregularity_change(work, b),
            number,
        )
    return found
