"""Twins from the grid: no hash, no sort, no guess.

A mesh edge is dual to a segment in a cell face, and the segment joins two of the face's grid edges. The
twin of the halfedge on that side of the quad round one of them is the halfedge on that side of the quad
round the other; there is none if no quad goes round it. That is right also where four quads share two
vertices, where Grosso & Zint 2021 (section 3.2) pair by whatever order a hash table has.

Where all cells round an edge are ordinary, each of the four faces has exactly one other edge with a quad: the
parallel one, or one of the two across. Elsewhere the inside bits and the special cell's decision tell.

The kernel also finds the quads with a *defect*: a side without a twin, or with two vertices that more than
two quads join. Simplification leaves them and their neighbours alone. Crowded vertex pairs come from
ambiguous faces only: any two vertices are joined through at most one cell face.
"""

from typing import Any

import warp as wp

from dmc_cli.device import Device
from dmc_cli.mesh.quad_ranks import (
    EdgeRun,
    QuadWord,
    edges_after,
    edges_at,
    edges_before,
    quad_in,
    quad_round,
    side_halfedge,
    word_after,
    word_before,
)
from dmc_cli.surface import Surface
from dmc_cli.surface.cells import CellBits
from dmc_cli.surface.grid import Grid, bit_index, has_bit
from dmc_cli.surface.quads import surely_ordinary
from dmc_cli.surface.special_cells import SpecialCells, find_special

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def find_grid_twins(surface: Surface, words: Any, device: Device) -> tuple[Any, Any]:
    """Return the twins, int32 vec4 (Q,), -1 for none, and which quads have a defect, uint8 (Q,).

    Args:
        surface: The surface as it was extracted.
        words: As `rank_quads` returns them.
        device: Where to work.
    """
    grid = surface.grid
    count = surface.quads.shape[0]
    twins, defects = device.empty(count, wp.vec4i), device.empty(count, wp.uint8)
    inputs = [grid.struct(), surface.cells.bits, surface.polygons.special, int(surface.is_reversed)]
    inputs += [surface.quad_starts, words, surface.quads]
    device.launch(find_twins_kernel, grid.rows, inputs, [twins, defects])
    return twins, defects


@wp.struct
class SideRuns:
    """The other edges of the faces on one side of 32 edges: parallel to them, or across.

    A quad round an edge of `parallel` or `same` has its normal towards the same end of its edge as ours, one
    of `opposite` towards the other end, if the segment joins it to ours and the face is not ambiguous.
    """

    parallel: EdgeRun
    same: EdgeRun
    opposite: EdgeRun


@wp.struct
class Sides:
    """The four sides of the quads round 32 edges."""

    s0: SideRuns
    s1: SideRuns
    s2: SideRuns
    s3: SideRuns


@wp.func
def sides_of_x(words: wp.array2d(dtype=QuadWord), grid: Grid, row: wp.int32, w: wp.int32) -> Sides:
    """Return the sides of the quads round the x edges of a word."""
    here = words[row, w]
    here_after = word_after(words, row, w)
    below = words[row - 1, w]
    front = words[row - grid.ny, w]
    sides = Sides()
    sides.s0.parallel = edges_at(front, 0)
    sides.s0.same = edges_after(front, word_after(words, row - grid.ny, w), 2)
    sides.s0.opposite = edges_at(front, 2)
    sides.s1.parallel = edges_at(words[row + 1, w], 0)
    sides.s1.same = edges_at(here, 1)
    sides.s1.opposite = edges_after(here, here_after, 1)
    sides.s2.parallel = edges_at(words[row + grid.ny, w], 0)
    sides.s2.same = edges_at(here, 2)
    sides.s2.opposite = edges_after(here, here_after, 2)
    sides.s3.parallel = edges_at(below, 0)
    sides.s3.same = edges_after(below, word_after(words, row - 1, w), 1)
    sides.s3.opposite = edges_at(below, 1)
    return sides


@wp.func
def sides_of_y(words: wp.array2d(dtype=QuadWord), grid: Grid, row: wp.int32, w: wp.int32) -> Sides:
    """Return the sides of the quads round the y edges of a word."""
    here = words[row, w]
    here_before = word_before(words, row, w)
    above = words[row + 1, w]
    front = words[row - grid.ny, w]
    sides = Sides()
    sides.s0.parallel = edges_before(here, here_before, 1)
    sides.s0.same = edges_before(above, word_before(words, row + 1, w), 0)
    sides.s0.opposite = edges_before(here, here_before, 0)
    sides.s1.parallel = edges_at(words[row + grid.ny, w], 1)
    sides.s1.same = edges_at(here, 2)
    sides.s1.opposite = edges_at(above, 2)
    sides.s2.parallel = edges_after(here, word_after(words, row, w), 1)
    sides.s2.same = edges_at(here, 0)
    sides.s2.opposite = edges_at(above, 0)
    sides.s3.parallel = edges_at(front, 1)
    sides.s3.same = edges_at(words[row + 1 - grid.ny, w], 2)
    sides.s3.opposite = edges_at(front, 2)
    return sides


@wp.func
def sides_of_z(words: wp.array2d(dtype=QuadWord), grid: Grid, row: wp.int32, w: wp.int32) -> Sides:
    """Return the sides of the quads round the z edges of a word."""
    here = words[row, w]
    here_before = word_before(words, row, w)
    below = words[row - 1, w]
    back = words[row + grid.ny, w]
    sides = Sides()
    sides.s0.parallel = edges_at(below, 2)
    sides.s0.same = edges_at(words[row - 1 + grid.ny, w], 1)
    sides.s0.opposite = edges_at(below, 1)
    sides.s1.parallel = edges_after(here, word_after(words, row, w), 2)
    sides.s1.same = edges_at(here, 0)
    sides.s1.opposite = edges_at(back, 0)
    sides.s2.parallel = edges_at(words[row + 1, w], 2)
    sides.s2.same = edges_at(here, 1)
    sides.s2.opposite = edges_at(back, 1)
    sides.s3.parallel = edges_before(here, here_before, 2)
    sides.s3.same = edges_before(back, word_before(words, row + grid.ny, w), 0)
    sides.s3.opposite = edges_before(here, here_before, 0)
    return sides


@wp.func
def plain_twin(runs: SideRuns, b: wp.int32, side: wp.int32, forward: wp.bool) -> wp.int32:
    """Return the twin on a side of the quad round edge b, where all cells are ordinary."""
    parallel = has_bit(runs.parallel.bits, b)
    same = has_bit(runs.same.bits, b)
    run = EdgeRun()
    run.bits = wp.where(parallel, runs.parallel.bits, wp.where(same, runs.same.bits, runs.opposite.bits))
    run.first = wp.where(parallel, runs.parallel.first, wp.where(same, runs.same.first, runs.opposite.first))
    run.seam = wp.where(parallel, runs.parallel.seam, wp.where(same, runs.same.seam, runs.opposite.seam))
    run.seam_number = wp.where(
        parallel,
        runs.parallel.seam_number,
        wp.where(same, runs.same.seam_number, runs.opposite.seam_number),
    )
    other_side = wp.where(parallel, side ^ 2, wp.where(same, 3 - side, side ^ 1))
    other_forward = wp.where(parallel or same, forward, not forward)
    return side_halfedge(quad_in(run, b), other_side, other_forward)


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
def face_on_side(
    grid: Grid, bits: CellBits, special: SpecialCells, axis: wp.int32, node: wp.vec3i, side: wp.int32
) -> Face:
    """Return the face that a quad's side crosses; node is the lower one of the quad's edge."""
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
    if face.is_ambiguous:
        s = find_special(special, face.node[1] + grid.ny * face.node[2], face.node[0])
        face.cuts_f1 = face.f0 == has_bit(special.joined[s], 2 * face.axis)
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
    q = quad_round(words, node[1] + grid.ny * node[2], node[0], axis)
    h = int(-1)
    if q >= 0:
        h = side_halfedge(q, place ^ 1, inside == (is_reversed == 0))
    return h


@wp.func
def joins_same(quads: wp.array(dtype=wp.vec4i), h: wp.int32, other: wp.int32) -> wp.bool:
    """Return whether two halfedges join the same two vertices, either way."""
    a = quads[h // 4][h % 4]
    b = quads[h // 4][(h + 1) % 4]
    c = quads[other // 4][other % 4]
    d = quads[other // 4][(other + 1) % 4]
    return (a == c and b == d) or (a == d and b == c)


@wp.func
def is_crowded(
    grid: Grid,
    words: wp.array2d(dtype=QuadWord),
    quads: wp.array(dtype=wp.vec4i),
    is_reversed: wp.int32,
    face: Face,
    place: wp.int32,
) -> wp.bool:
    """Return whether more than two quads join the two vertices of the halfedge at a place of a face."""
    count = int(0)
    if face.is_ambiguous:
        h = halfedge_at(grid, words, is_reversed, face, place)
        for other_place in range(4):
            other = halfedge_at(grid, words, is_reversed, face, other_place)
            if other >= 0:
                if joins_same(quads, h, other):
                    count += 1
    return count > 2


@wp.kernel
def find_twins_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    is_reversed: wp.int32,
    starts: wp.array(dtype=wp.int64),
    words: wp.array2d(dtype=QuadWord),
    quads: wp.array(dtype=wp.vec4i),
    # Out:
    twins_out: wp.array(dtype=wp.vec4i),
    defects_out: wp.array(dtype=wp.uint8),
):
    """Find the twins of the halfedges of all quads. One thread a row of nodes."""
    row = first + wp.tid()
    q = wp.int32(starts[row])
    if starts[row] == starts[row + 1]:
        return
    j = row % grid.ny
    k = row // grid.ny
    for w in range(grid.words):
        word = words[row, w]
        if (word[0] | word[1] | word[2]) != wp.uint32(0):
            plain = surely_ordinary(grid, bits, row, j, k, w)
            towards = bits.inside[row, w]
            if is_reversed == 1:
                towards = ~towards
            for axis in range(3):
                left = word[axis]
                if left != wp.uint32(0):
                    sides = Sides()
                    if axis == 0:
                        sides = sides_of_x(words, grid, row, w)
                    elif axis == 1:
                        sides = sides_of_y(words, grid, row, w)
                    else:
                        sides = sides_of_z(words, grid, row, w)
                    while left != wp.uint32(0):
                        b = bit_index(left)
                        left &= left - wp.uint32(1)
                        forward = has_bit(towards, b)
                        t = wp.vec4i()
                        defect = wp.uint8(0)
                        if has_bit(plain, b):
                            t0 = plain_twin(sides.s0, b, 0, forward)
                            t1 = plain_twin(sides.s1, b, 1, forward)
                            t2 = plain_twin(sides.s2, b, 2, forward)
                            t3 = plain_twin(sides.s3, b, 3, forward)
                            t = wp.vec4i(t0, t1, t2, t3)
                        else:
                            node = wp.vec3i(32 * w + b, j, k)
                            for side in range(4):
                                face = face_on_side(grid, bits, special, axis, node, side)
                                other = joined_place(face, side ^ 1)
                                t[side] = halfedge_at(grid, words, is_reversed, face, other)
                                if t[side] < 0 or is_crowded(grid, words, quads, is_reversed, face, side ^ 1):
                                    defect = wp.uint8(1)
                        twins_out[q] = wp.where(forward, t, wp.vec4i(t[3], t[2], t[1], t[0]))
                        defects_out[q] = defect
                        q += 1
