"""Look at the cells of a word at once: which are crossed, and which may have several polygons."""

import warp as wp

from dmc_cli.bits import LANES, Words, has_bit, next_node
from dmc_cli.field import Grid

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.struct
class CellBits:
    """The bits that later stages ask about cells and nodes, by row and as the line of words.

    `rank` [word of the line] counts the ordinary cells before a word that has one, in grid order;
    `special_rank` likewise the special cells.
    """

    inside: wp.array2d(dtype=wp.uint32)
    active: wp.array2d(dtype=wp.uint32)
    ordinary: wp.array2d(dtype=wp.uint32)
    inside_line: wp.array(dtype=Words)
    active_line: wp.array(dtype=Words)
    ordinary_line: wp.array(dtype=Words)
    rank: wp.array(dtype=wp.int32)
    special_rank: wp.array(dtype=wp.int32)


@wp.func
def find_candidates(grid: Grid, inside: wp.array(dtype=Words), n: wp.int32) -> Words:
    """Return a bit for each cell of a block: whether its corners differ; ends of rows are not looked at."""
    c0 = inside[n]
    c2 = inside[n + grid.words]
    c4 = inside[n + grid.layer]
    c6 = inside[n + grid.layer + grid.words]
    c0_after = inside[n + 1]
    c2_after = inside[n + grid.words + 1]
    c4_after = inside[n + grid.layer + 1]
    c6_after = inside[n + grid.layer + grid.words + 1]
    candidates = Words()
    for lane in range(LANES):
        some = c0[lane] | c2[lane] | c4[lane] | c6[lane]
        every = c0[lane] & c2[lane] & c4[lane] & c6[lane]
        some |= next_node(some, c0_after[lane] | c2_after[lane] | c4_after[lane] | c6_after[lane])
        every &= next_node(every, c0_after[lane] & c2_after[lane] & c4_after[lane] & c6_after[lane])
        candidates[lane] = some & ~every
    return candidates


@wp.func
def any_bit(words: Words) -> wp.bool:
    """Return whether any bit of a block is set."""
    some = wp.uint32(0)
    for lane in range(LANES):
        some |= words[lane]
    return some != wp.uint32(0)


@wp.func
def ambiguous_faces(a: wp.uint32, b: wp.uint32, c: wp.uint32, d: wp.uint32) -> wp.uint32:
    """Return a bit for each face with corners a b c d (a and d diagonal): whether it is ambiguous."""
    return (a ^ b) & (a ^ c) & ~(a ^ d)


@wp.func
def several_polygons(
    c0: wp.uint32,
    c1: wp.uint32,
    c2: wp.uint32,
    c3: wp.uint32,
    c4: wp.uint32,
    c5: wp.uint32,
    c6: wp.uint32,
    c7: wp.uint32,
) -> wp.uint32:
    """Return a bit for each cell: whether it may have several polygons; c0 to c7 are its corners' bits."""
    faces = ambiguous_faces(c0, c1, c2, c3) | ambiguous_faces(c4, c5, c6, c7)
    faces |= ambiguous_faces(c0, c1, c4, c5) | ambiguous_faces(c2, c3, c6, c7)
    faces |= ambiguous_faces(c0, c2, c4, c6) | ambiguous_faces(c1, c3, c5, c7)
    # without an ambiguous face only two lone opposite corners are left: where three neighbours of one are on
    # the other side, so are the three others, which share a face with two of them
    lone07 = ~(c0 ^ c7) & (c0 ^ c1) & (c0 ^ c2) & (c0 ^ c4)
    lone16 = ~(c1 ^ c6) & (c1 ^ c0) & (c1 ^ c3) & (c1 ^ c5)
    lone25 = ~(c2 ^ c5) & (c2 ^ c0) & (c2 ^ c3) & (c2 ^ c6)
    lone34 = ~(c3 ^ c4) & (c3 ^ c1) & (c3 ^ c2) & (c3 ^ c7)
    return faces | lone07 | lone16 | lone25 | lone34


@wp.func
def cell_case(grid: Grid, inside: wp.array2d(dtype=wp.uint32), row: wp.int32, i: wp.int32) -> wp.int32:
    """Return a cell's case: bit c is set if corner c is inside."""
    w = i // 32
    b = i % 32
    w1 = (i + 1) // 32
    b1 = (i + 1) % 32
    case = int(0)
    for r in range(4):
        corner_row = row + (r & 1) + (r >> 1) * grid.ny
        if has_bit(inside[corner_row, w], b):
            case |= 1 << (2 * r)
        if has_bit(inside[corner_row, w1], b1):
            case |= 2 << (2 * r)
    return case


@wp.func
def count_surrounded(
    x: wp.uint32,
    y: wp.uint32,
    z: wp.uint32,
    along_x: wp.uint32,
    along_y: wp.uint32,
    along_z: wp.uint32,
    at: wp.vec3i,
) -> wp.int32:
    """Return how many of the edges x, y, z from the nodes of a word have four cells round them.

    `along` are the nodes with an edge that way, `at` is the word's place.
    """
    inner_x = along_x & ~wp.where(at[0] == 0, wp.uint32(1), wp.uint32(0))  # cells on both sides
    inner_y = wp.where(at[1] > 0, along_y, wp.uint32(0))
    inner_z = wp.where(at[2] > 0, along_z, wp.uint32(0))
    count = wp.bit_count(x & inner_y & inner_z) + wp.bit_count(y & inner_x & inner_z)
    return wp.int32(count + wp.bit_count(z & inner_x & inner_y))
