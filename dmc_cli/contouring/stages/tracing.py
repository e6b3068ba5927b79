"""Trace the MC polygons of one cell from its face segments; no table of cases.

The surface crosses a cell face in segments that join its crossed edges. An ambiguous face (two diagonal
corners inside, two outside) has two, which cut off the inside corners or, if those are joined, the outside
ones. Following the segments from edge to edge closes the polygons (Grosso & Zint 2021, section 3.1.1). The
tables here are a cell's own geometry, computed from `grid`.

Conventions: a *case* has bit c set if corner c is inside; *owners* hold four bits per edge: which polygon,
or vertex, of the cell the edge belongs to.
"""

import warp as wp

from dmc_cli.bits import has_bit
from dmc_cli.field import CORNERS, EDGES

NO_OWNER = 15
"""Owner of an edge that belongs to no polygon, or to no vertex."""

NO_OWNERS = wp.uint64(0xFFFFFFFFFFFF)
"""Twelve times `NO_OWNER`."""


def _face_corners() -> list[int]:
    """Return the corners of each face, in the order low-low, high-low, low-high, high-high of its axes."""
    corners = []
    for axis in range(3):
        for side in range(2):
            corners += [c for c in range(8) if CORNERS[c][axis] == side]
    return corners


def _face_edges() -> list[int]:
    """Return the edges of each face f0 f1 f2 f3 (as `_face_corners`), in the order f0f1 f1f3 f2f3 f0f2."""
    corners = _face_corners()
    edges = []
    for face in range(6):
        f = corners[4 * face : 4 * face + 4]
        for a, b in ((0, 1), (1, 3), (2, 3), (0, 2)):
            edges.append(EDGES.index((f[a], f[b])))
    return edges


def _edge_places() -> list[int]:
    """Return the two places of each edge among `_face_edges`: place 4f + s is side s of face f."""
    edges = _face_edges()
    return [place for edge in range(12) for place in range(24) if edges[place] == edge]


def _bits(members: list[int]) -> int:
    """Return a number with a bit for each member."""
    return sum(1 << member for member in members)


Vec6 = wp.types.vector(length=6, dtype=wp.int32)

Vec12 = wp.types.vector(length=12, dtype=wp.int32)

Vec24 = wp.types.vector(length=24, dtype=wp.int32)

_CORNERS = _face_corners()

_EDGES = _face_edges()

FACE_MASKS = wp.constant(Vec6(*[_bits(_CORNERS[4 * face : 4 * face + 4]) for face in range(6)]))

FACE_DIAGONALS = wp.constant(Vec6(*[_bits(_CORNERS[4 * face : 4 * face + 4 : 3]) for face in range(6)]))
"""The corners of each face, and the diagonal f0 f3 of it, as cases."""

FACE_EDGE_BITS = wp.constant(Vec6(*[_bits(_EDGES[4 * face : 4 * face + 4]) for face in range(6)]))
"""The edges of each face, a bit each."""

FACE_CORNERS = wp.constant(Vec24(*_face_corners()))

FACE_EDGES = wp.constant(Vec24(*_face_edges()))

EDGE_PLACES = wp.constant(Vec24(*_edge_places()))

EDGE_LOW = wp.constant(Vec12(*[a for a, _ in EDGES]))

EDGE_HIGH = wp.constant(Vec12(*[b for _, b in EDGES]))


@wp.func
def is_crossed(case: wp.int32, edge: wp.int32) -> wp.bool:
    """Return whether an edge has one end inside."""
    return ((case >> EDGE_LOW[edge]) & 1) != ((case >> EDGE_HIGH[edge]) & 1)


@wp.func
def is_ambiguous(case: wp.int32, face: wp.int32) -> wp.bool:
    """Return whether a face has two diagonal corners inside and two outside."""
    corners = case & FACE_MASKS[face]
    return corners == FACE_DIAGONALS[face] or corners == (FACE_MASKS[face] ^ FACE_DIAGONALS[face])


@wp.func
def segment_partner(case: wp.int32, joined: wp.uint32, face: wp.int32, side: wp.int32) -> wp.int32:
    """Return the side (0 to 3) where the segment from a crossed side of a face ends.

    Sides in the order f0f1 f1f3 f2f3 f0f2 run round the face; f1 lies between sides 0 and 1, f3 between
    1 and 2, f2 between 2 and 3, f0 between 3 and 0. On an ambiguous face a segment cuts off one corner: an
    outside one if the inside corners are joined.
    """
    partner = side
    if is_ambiguous(case, face):
        first_inside = ((case >> FACE_CORNERS[4 * face]) & 1) == 1
        join = has_bit(joined, face)
        if first_inside == join:
            partner = side ^ 1  # cuts off f1 and f2
        else:
            partner = 3 - side  # cuts off f0 and f3
    else:
        for other in range(4):
            if other != side and is_crossed(case, FACE_EDGES[4 * face + other]):
                partner = other
    return partner


@wp.func
def owner_of(owners: wp.uint64, edge: wp.int32) -> wp.int32:
    """Return the owner of an edge."""
    return wp.int32((owners >> wp.uint64(4 * edge)) & wp.uint64(15))


@wp.func
def edges_owned(owners: wp.uint64, owner: wp.int32) -> wp.uint32:
    """Return a bit for each edge of an owner, without a branch for each."""
    edges = wp.uint32(0)
    for edge in range(12):
        is_one = wp.where(owner_of(owners, edge) == owner, wp.uint32(1), wp.uint32(0))
        edges |= is_one << wp.uint32(edge)
    return edges


@wp.func
def has_several(owners: wp.uint64) -> wp.bool:
    """Return whether a cell has several polygons: the bits of 0 and of `NO_OWNER` are alike."""
    return ((owners ^ (owners >> wp.uint64(1))) & wp.uint64(0x777777777777)) != wp.uint64(0)


@wp.func
def with_owner(owners: wp.uint64, edge: wp.int32, owner: wp.int32) -> wp.uint64:
    """Return owners with that of one edge replaced."""
    shift = wp.uint64(4 * edge)
    return (owners & ~(wp.uint64(15) << shift)) | (wp.uint64(owner) << shift)


@wp.func
def next_edge(case: wp.int32, joined: wp.uint32, previous: wp.int32, edge: wp.int32) -> wp.int32:
    """Return the edge that follows `edge` round its polygon; `previous` is the one before, or -1."""
    place = EDGE_PLACES[2 * edge]
    following = FACE_EDGES[place - place % 4 + segment_partner(case, joined, place / 4, place % 4)]
    if following == previous:
        place = EDGE_PLACES[2 * edge + 1]
        following = FACE_EDGES[place - place % 4 + segment_partner(case, joined, place / 4, place % 4)]
    return following


@wp.func
def is_split(case: wp.int32) -> wp.bool:
    """Return whether a cell may have several polygons: an ambiguous face, or two lone opposite corners.

    Which of them it has is as good as random, so all are looked at, without a branch.
    """
    outside = 255 - case
    split = int(0)
    for corner in range(4):
        pair = (1 << corner) | (128 >> corner)
        split |= wp.where(case == pair, 1, 0) | wp.where(outside == pair, 1, 0)
    for face in range(6):
        corners = case & FACE_MASKS[face]
        split |= wp.where(corners == FACE_DIAGONALS[face], 1, 0)
        split |= wp.where(corners == (FACE_MASKS[face] ^ FACE_DIAGONALS[face]), 1, 0)
    return split == 1


@wp.func
def single_owner(case: wp.int32) -> wp.uint64:
    """Return the owner of each edge of a cell that is not split: polygon 0 for all crossed edges."""
    owners = wp.uint64(NO_OWNERS)
    for edge in range(12):
        crossed = ((case >> EDGE_LOW[edge]) ^ (case >> EDGE_HIGH[edge])) & 1
        owners -= wp.uint64(NO_OWNER * crossed) << wp.uint64(4 * edge)
    return owners


@wp.func
def trace_cell(case: wp.int32, joined: wp.uint32) -> wp.uint64:
    """Return the owner of each edge: the number of its polygon, in the order of their lowest edges."""
    owners = NO_OWNERS
    polygon = int(0)
    for start in range(12):
        if is_crossed(case, start) and owner_of(owners, start) == NO_OWNER:
            previous = int(-1)
            edge = int(start)
            running = int(1)
            while running == 1:
                owners = with_owner(owners, edge, polygon)
                following = next_edge(case, joined, previous, edge)
                previous = edge
                edge = following
                if edge == start:
                    running = 0
            polygon += 1
    return owners
