"""Change the mesh by the operations of remeshing: rotate an edge, collapse a quad, split a vertex.

Each takes a halfedge, touches the vertices whose rings it changes, and changes the connectivity through the
journal. Whether the mesh may stay like that is judged afterwards (`checks.py`). A doublet, two quads
with two sides in common, is removed by collapsing one of them on the diagonal from the vertex of valence 2.
"""

import warp as wp

from dmc_cli.mesh import next_in_quad, next_outgoing, opposite_in_quad, previous_in_quad, quad_corner
from dmc_cli.processing.remeshing.work import (
    CORNER,
    FACE_GONE,
    HAS_SPLIT,
    LONGEST_RING,
    SPARE_QUAD,
    SPARE_VERTEX,
    START,
    TWIN,
    VALENCE,
    VERTEX_GONE,
    Work,
    fail,
    has_failed,
    put,
    touch,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

DOUBLETS = 4
"""Doublets that may be removed after one operation; operations that leave more are of no use."""


@wp.func
def place_side(work: Work, b: wp.int32, h: wp.int32, v: wp.int32, t: wp.int32) -> None:
    """Make halfedge h start at v and be the twin of t."""
    put(work, b, CORNER, h, v)
    put(work, b, TWIN, h, t)
    put(work, b, TWIN, t, h)
    put(work, b, START, v, h)


@wp.func
def add_valence(work: Work, b: wp.int32, v: wp.int32, more: wp.int32) -> None:
    """Change the valence of a vertex."""
    put(work, b, VALENCE, v, work.mesh.valence[v] + more)


@wp.func
def rotate_edge(work: Work, b: wp.int32, h: wp.int32, forward: wp.bool) -> None:
    """Turn the edge between two quads by one vertex of the hexagon that they form, p0 to p5 in order.

    The edge joins p3 and p0; turned forward it joins p4 and p1, else p2 and p5. The quads' sides without
    the edge are, as halfedges, e01, e12, e23 of one and e34, e45, e50 of the other.
    """
    t = work.mesh.twin[h]
    p0 = quad_corner(work.mesh.corners, h, 1)
    p1 = quad_corner(work.mesh.corners, h, 2)
    p2 = quad_corner(work.mesh.corners, h, 3)
    p3 = quad_corner(work.mesh.corners, h, 0)
    p4 = quad_corner(work.mesh.corners, t, 2)
    p5 = quad_corner(work.mesh.corners, t, 3)
    touch(work, b, p0)
    touch(work, b, p1)
    touch(work, b, p2)
    touch(work, b, p3)
    touch(work, b, p4)
    touch(work, b, p5)
    if (h >> 2) == (t >> 2) or p0 == p4 or p3 == p1 or p0 == p2 or p3 == p5:
        fail(work, b)
    if p1 == p4 or p1 == p5 or p2 == p4 or p2 == p5 or p1 == p3 or p0 == p3:
        fail(work, b)
    if not has_failed(work, b):
        e01 = work.mesh.twin[next_in_quad(h)]
        e12 = work.mesh.twin[opposite_in_quad(h)]
        e23 = work.mesh.twin[previous_in_quad(h)]
        e34 = work.mesh.twin[next_in_quad(t)]
        e45 = work.mesh.twin[opposite_in_quad(t)]
        e50 = work.mesh.twin[previous_in_quad(t)]
        a1 = wp.where(forward, p1, p5)
        a2 = wp.where(forward, p2, p0)
        a3 = wp.where(forward, p3, p1)
        b1 = wp.where(forward, p4, p2)
        b2 = wp.where(forward, p5, p3)
        b3 = wp.where(forward, p0, p4)
        place_side(work, b, next_in_quad(h), a1, wp.where(forward, e12, e50))
        place_side(work, b, opposite_in_quad(h), a2, wp.where(forward, e23, e01))
        place_side(work, b, previous_in_quad(h), a3, wp.where(forward, e34, e12))
        place_side(work, b, next_in_quad(t), b1, wp.where(forward, e45, e23))
        place_side(work, b, opposite_in_quad(t), b2, wp.where(forward, e50, e34))
        place_side(work, b, previous_in_quad(t), b3, wp.where(forward, e01, e45))
        put(work, b, CORNER, h, b1)
        put(work, b, CORNER, t, a1)
        add_valence(work, b, a1, 1)
        add_valence(work, b, b1, 1)
        add_valence(work, b, p0, -1)
        add_valence(work, b, p3, -1)


@wp.func
def collapse_quad(work: Work, b: wp.int32, h: wp.int32) -> None:
    """Remove the quad of halfedge h: along its diagonal the vertex where h starts joins the one opposite."""
    gone = quad_corner(work.mesh.corners, h, 0)
    side = quad_corner(work.mesh.corners, h, 1)
    kept = quad_corner(work.mesh.corners, h, 2)
    other = quad_corner(work.mesh.corners, h, 3)
    touch(work, b, gone)
    touch(work, b, side)
    touch(work, b, kept)
    touch(work, b, other)
    if gone == kept or side == other or work.mesh.valence[side] < 3 or work.mesh.valence[other] < 3:
        fail(work, b)
    if not has_failed(work, b):
        t0 = work.mesh.twin[h]
        t1 = work.mesh.twin[next_in_quad(h)]
        t2 = work.mesh.twin[opposite_in_quad(h)]
        t3 = work.mesh.twin[previous_in_quad(h)]
        if (t0 >> 2) == (t1 >> 2) or (t2 >> 2) == (t3 >> 2):
            fail(work, b)
        g = h
        for _n in range(work.mesh.valence[gone]):
            if g != h:
                put(work, b, CORNER, g, kept)
            g = next_outgoing(work.mesh.twin, g)
        put(work, b, TWIN, t0, t1)
        put(work, b, TWIN, t1, t0)
        put(work, b, TWIN, t2, t3)
        put(work, b, TWIN, t3, t2)
        put(work, b, START, side, t0)
        put(work, b, START, kept, t1)
        put(work, b, START, other, t2)
        add_valence(work, b, kept, work.mesh.valence[gone] - 2)
        add_valence(work, b, side, -1)
        add_valence(work, b, other, -1)
        put(work, b, FACE_GONE, h >> 2, 1)
        put(work, b, VERTEX_GONE, gone, 1)


@wp.func
def split_vertex(
    work: Work, b: wp.int32, h: wp.int32, steps: wp.int32, last_vertex: wp.int32, last_quad: wp.int32
) -> None:
    """Split the vertex where h starts, along h and the halfedge `steps` onward, and put a quad between.

    The quads from h on go to the new vertex. Spare numbers run up to `last_vertex` and `last_quad`.
    """
    v = work.mesh.corners[h]
    size = work.mesh.valence[v]
    fresh = work.tally[b, SPARE_VERTEX]
    q = work.tally[b, SPARE_QUAD]
    if fresh >= last_vertex or q >= last_quad or steps < 2 or steps > size - 2 or size > LONGEST_RING:
        fail(work, b)
    if not has_failed(work, b):
        end = h
        for _n in range(steps):
            end = next_outgoing(work.mesh.twin, end)
        side = quad_corner(work.mesh.corners, h, 1)
        other = quad_corner(work.mesh.corners, end, 1)
        touch(work, b, v)
        touch(work, b, fresh)
        touch(work, b, side)
        touch(work, b, other)
        if not has_failed(work, b):
            before = work.mesh.twin[h]
            last = work.mesh.twin[end]
            g = h
            for _n in range(steps):
                put(work, b, CORNER, g, fresh)
                g = next_outgoing(work.mesh.twin, g)
            place_side(work, b, 4 * q, v, before)
            place_side(work, b, 4 * q + 1, side, h)
            place_side(work, b, 4 * q + 2, fresh, last)
            place_side(work, b, 4 * q + 3, other, end)
            put(work, b, VALENCE, fresh, steps + 1)
            put(work, b, VALENCE, v, size - steps + 1)
            add_valence(work, b, side, 1)
            add_valence(work, b, other, 1)
            put(work, b, FACE_GONE, q, 0)
            put(work, b, VERTEX_GONE, fresh, 0)
            work.tally[b, HAS_SPLIT] = 1


@wp.func
def doublet_of(work: Work, b: wp.int32, count: wp.int32) -> wp.int32:
    """Return the first touched vertex of valence 2, or -1."""
    found = int(-1)
    for n in range(count):
        v = work.core[b, n]
        if found < 0 and work.mesh.vertex_gone[v] == wp.uint8(0) and work.mesh.valence[v] == 2:
            found = v
    return found
