"""Trace how the boundary of one label runs through a cell, and which crossed edges of a cell go together.

The *loops* of a label are the MC polygons of its mask, label or not, traced as those of any cell. The
*clusters* of a cell are its crossed edges joined through its faces; each loop lies within one of them. A
face whose four edges are crossed pairs them where two equal labels lie on a diagonal: they are connected
through the face; where both diagonals have two equal labels, the smaller label is. With four edges and no
such diagonal, or with a decision that was flipped to make shells manifold, all its edges go together.
"""

import warp as wp

from dmc_cli.bits import has_bit
from dmc_cli.contouring.stages.tracing import (
    EDGE_HIGH,
    EDGE_LOW,
    FACE_CORNERS,
    FACE_DIAGONALS,
    FACE_EDGE_BITS,
    FACE_EDGES,
    FACE_MASKS,
    NO_OWNERS,
    is_ambiguous,
    is_split,
    single_owner,
    trace_cell,
    with_owner,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

Codes = wp.types.vector(length=8, dtype=wp.int32)
"""The codes of a cell's corners."""

Joins = wp.types.vector(length=12, dtype=wp.uint32)
"""Edges that go together through a face, a bit each: two sets a face."""


@wp.func
def corner_codes(codes: wp.array3d(dtype=wp.uint16), node: wp.vec3i) -> Codes:
    """Return the codes of the corners of the cell with this lowest node."""
    i = node[0]
    j = node[1]
    k = node[2]
    return Codes(
        wp.int32(codes[k, j, i]),
        wp.int32(codes[k, j, i + 1]),
        wp.int32(codes[k, j + 1, i]),
        wp.int32(codes[k, j + 1, i + 1]),
        wp.int32(codes[k + 1, j, i]),
        wp.int32(codes[k + 1, j, i + 1]),
        wp.int32(codes[k + 1, j + 1, i]),
        wp.int32(codes[k + 1, j + 1, i + 1]),
    )


@wp.func
def case_of(c: Codes, code: wp.int32) -> wp.int32:
    """Return the case of a label: a bit for each corner that has it."""
    case = int(0)
    for corner in range(8):
        case |= wp.where(c[corner] == code, 1, 0) << corner
    return case


@wp.func
def is_first(c: Codes, corner: wp.int32) -> wp.bool:
    """Return whether no corner before has the same code."""
    first = bool(True)
    for other in range(corner):
        if c[other] == c[corner]:
            first = False
    return first


@wp.func
def crossed_edges_of(c: Codes) -> wp.uint32:
    """Return a bit for each edge whose ends have two labels."""
    crossed = wp.uint32(0)
    for edge in range(12):
        differs = c[EDGE_LOW[edge]] != c[EDGE_HIGH[edge]]
        crossed |= wp.where(differs, wp.uint32(1), wp.uint32(0)) << wp.uint32(edge)
    return crossed


@wp.func
def joined_faces(c: Codes, case: wp.int32, flips: wp.uint32) -> wp.uint32:
    """Return a bit for each ambiguous face of a label's mask through which its corners are connected.

    Bit 2f + d of the flips says that the decision for the label on diagonal d of face f is turned round;
    diagonal 0 is that of the face's first corner.
    """
    joined = wp.uint32(0)
    for face in range(6):
        if is_ambiguous(case, face):
            other = int(0)
            if (case & FACE_MASKS[face]) == FACE_DIAGONALS[face]:
                other = 1
            a = c[FACE_CORNERS[4 * face + other]]  # of the other diagonal
            b = c[FACE_CORNERS[4 * face + 3 - other]]
            own = c[FACE_CORNERS[4 * face + 1 - other]]
            join = a != b or own < a
            if join != has_bit(flips, 2 * face + 1 - other):
                joined |= wp.uint32(1) << wp.uint32(face)
    return joined


@wp.func
def loops_of(c: Codes, code: wp.int32, flips: wp.uint32) -> wp.uint64:
    """Return the loop of a label that each edge belongs to, as owners."""
    case = case_of(c, code)
    if not is_split(case):
        return single_owner(case)
    return trace_cell(case, joined_faces(c, case, flips))


@wp.func
def owner_count(owners: wp.uint64) -> wp.int32:
    """Count the owners, which are numbered from 0."""
    count = int(0)
    left = owners
    for _edge in range(12):
        owner = wp.int32(left & wp.uint64(15))
        if owner != 15:
            count = wp.max(count, owner + 1)
        left = left >> wp.uint64(4)
    return count


@wp.func
def face_joins(c: Codes, crossed: wp.uint32, flips: wp.uint32) -> Joins:
    """Return the sets of edges that go together through each face."""
    joins = Joins()
    for face in range(6):
        edges = crossed & wp.uint32(FACE_EDGE_BITS[face])
        joins[2 * face] = edges
        if wp.bit_count(edges) == 4 and ((flips >> wp.uint32(2 * face)) & wp.uint32(3)) == wp.uint32(0):
            f0 = c[FACE_CORNERS[4 * face]]
            f1 = c[FACE_CORNERS[4 * face + 1]]
            f2 = c[FACE_CORNERS[4 * face + 2]]
            f3 = c[FACE_CORNERS[4 * face + 3]]
            # sides 0 and 1 lie round f1, 2 and 3 round f2; 3 and 0 round f0, 1 and 2 round f3
            cut = wp.uint32(0)
            if f0 == f3 and (f1 != f2 or f0 < f1):
                cut = wp.uint32(1) << wp.uint32(FACE_EDGES[4 * face])
                cut |= wp.uint32(1) << wp.uint32(FACE_EDGES[4 * face + 1])
            elif f1 == f2:
                cut = wp.uint32(1) << wp.uint32(FACE_EDGES[4 * face])
                cut |= wp.uint32(1) << wp.uint32(FACE_EDGES[4 * face + 3])
            if cut != wp.uint32(0):
                joins[2 * face] = cut
                joins[2 * face + 1] = edges & ~cut
    return joins


@wp.func
def clusters_of(c: Codes, flips: wp.uint32) -> wp.uint64:
    """Return the cluster of each crossed edge of a cell as owners, in the order of their lowest edges."""
    left = crossed_edges_of(c)
    joins = face_joins(c, left, flips)
    owners = NO_OWNERS
    number = int(0)
    while left != wp.uint32(0):
        reached = left & (~left + wp.uint32(1))
        before = wp.uint32(0)
        while reached != before:
            before = reached
            for n in range(12):
                if (reached & joins[n]) != wp.uint32(0):
                    reached |= joins[n]
        for edge in range(12):
            if has_bit(reached, edge):
                owners = with_owner(owners, edge, number)
        left &= ~reached
        number += 1
    return owners
