"""Follow the segments of a cell face from one quad to its neighbour, where bits alone do not tell.

A quad's side crosses a cell face in a segment, which ends at another edge of the face: the quad round that
one is the neighbour, if there is one. `quad_ranks.py` has the numbers of faces, edges and sides.
"""

import warp as wp

from dmc_cli.bits import has_bit, low_bits
from dmc_cli.contouring.stages.cell_words import CellBits
from dmc_cli.contouring.stages.quad_ranks import QuadWord, has_quad, quad_round, side_halfedge
from dmc_cli.field import Grid


@wp.func
def one_step(axis: wp.int32) -> wp.vec3i:
    """Return a step of one node along an axis."""
    return wp.vec3i(wp.where(axis == 0, 1, 0), wp.where(axis == 1, 1, 0), wp.where(axis == 2, 1, 0))


@wp.func
def is_inside(bits: CellBits, grid: Grid, node: wp.vec3i) -> wp.bool:
    """Return whether a node is inside."""
    return has_bit(bits.inside[node[1] + grid.ny * node[2], node[0] // 32], node[0] % 32)


@wp.struct
class Face:
    """A cell face: its axis, its lowest node, the sides of its four corners, and how they are joined.

    Its edges have places 0 to 3 round it: U0, V1, U1, V0; place s ^ 1 is side s of the quad round that edge.
    """

    axis: wp.int32
    node: wp.vec3i
    f0: wp.bool
    f1: wp.bool
    f2: wp.bool
    f3: wp.bool
    is_ambiguous: wp.bool
    cuts_f1: wp.bool


@wp.func
def undecided_face(grid: Grid, bits: CellBits, axis: wp.int32, node: wp.vec3i, side: wp.int32) -> Face:
    """Return the face that a quad's side crosses; node is the lower one of the quad's edge.

    How an ambiguous face is joined is not told.
    """
    b = (axis + 1) % 3
    c = (axis + 2) % 3
    face = Face()
    face.axis = wp.where(side % 2 == 0, b, c)
    face.node = node
    if side == 0:
        face.node = node - one_step(c)
    if side == 3:
        face.node = node - one_step(b)
    u = one_step((face.axis + 1) % 3)
    v = one_step((face.axis + 2) % 3)
    face.f0 = is_inside(bits, grid, face.node)
    face.f1 = is_inside(bits, grid, face.node + u)
    face.f2 = is_inside(bits, grid, face.node + v)
    face.f3 = is_inside(bits, grid, face.node + u + v)
    face.is_ambiguous = face.f0 == face.f3 and face.f1 == face.f2 and face.f0 != face.f1
    return face


@wp.func
def joined_place(face: Face, place: wp.int32) -> wp.int32:
    """Return the place where the segment from a place of a face ends."""
    other = int(0)
    if face.is_ambiguous:
        other = wp.where(face.cuts_f1, place ^ 1, 3 - place)
    else:
        if place != 0 and face.f0 != face.f1:
            other = 0
        if place != 1 and face.f1 != face.f3:
            other = 1
        if place != 2 and face.f2 != face.f3:
            other = 2
        if place != 3 and face.f0 != face.f2:
            other = 3
    return other


@wp.func
def halfedge_at(
    grid: Grid, words: wp.array2d(dtype=QuadWord), is_reversed: wp.int32, face: Face, place: wp.int32
) -> wp.int32:
    """Return the halfedge that crosses a face, of the quad round the edge at a place; -1 without a quad."""
    u = (face.axis + 1) % 3
    v = (face.axis + 2) % 3
    node = face.node
    inside = face.f0
    if place == 1:
        node = face.node + one_step(u)
        inside = face.f1
    if place == 2:
        node = face.node + one_step(v)
        inside = face.f2
    axis = wp.where(place % 2 == 0, u, v)
    row = node[1] + grid.ny * node[2]
    h = int(-1)
    if has_quad(words, row, node[0], axis):
        h = side_halfedge(quad_round(words, row, node[0], axis), place ^ 1, inside == (is_reversed == 0))
    return h


@wp.func
def inner_nodes(grid: Grid, has_nodata: wp.int32, row: wp.int32, w: wp.int32) -> wp.uint32:
    """Return the nodes of a word round which all crossed edges have quads: two steps from the grid's ends."""
    k = row / grid.ny
    j = row - k * grid.ny
    if has_nodata == 1 or j < 2 or k < 2 or j > grid.ny - 3 or k > grid.nz - 3:
        return wp.uint32(0)
    return low_bits(grid.nx - 2 - 32 * w) & ~low_bits(2 - 32 * w)
