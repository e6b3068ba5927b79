"""Take away the cells with nodes without data, a word at a time, where there are such nodes.

A cell with such a corner does not exist; one beside it lacks quads.
"""

import warp as wp

from dmc_cli.bits import ALL_BITS, next_node, previous_node
from dmc_cli.field import Grid


@wp.func
def load_word(bits: wp.array2d(dtype=wp.uint32), row: wp.int32, w: wp.int32, words: wp.int32) -> wp.uint32:
    """Return word `w` of a row, 0 off its ends."""
    word = wp.uint32(0)
    if w >= 0 and w < words:
        word = bits[row, w]
    return word


@wp.func
def eroded_along_x(
    data: wp.array2d(dtype=wp.uint32), row: wp.int32, w: wp.int32, words: wp.int32
) -> wp.uint32:
    """Return a bit for each cell: whether nodes i - 1 to i + 2 of the row all have data."""
    word = data[row, w]
    after = load_word(data, row, w + 1, words)
    before = load_word(data, row, w - 1, words)
    one = next_node(word, after)
    two = (word >> wp.uint32(2)) | (after << wp.uint32(30))
    return previous_node(word, before) & word & one & two


@wp.func
def both_nodes(data: wp.array2d(dtype=wp.uint32), row: wp.int32, w: wp.int32, words: wp.int32) -> wp.uint32:
    """Return a bit for each cell: whether nodes i and i + 1 of the row have data."""
    return data[row, w] & next_node(data[row, w], load_word(data, row, w + 1, words))


@wp.func
def has_whole_surroundings(
    data: wp.array2d(dtype=wp.uint32), grid: Grid, row: wp.int32, w: wp.int32
) -> wp.uint32:
    """Return a bit for each cell: whether the cells round it all exist; row (j, k) is not at the border."""
    bits = ALL_BITS
    for dk in range(4):
        for dj in range(4):
            bits &= eroded_along_x(data, row + (dj - 1) + (dk - 1) * grid.ny, w, grid.words)
    return bits


@wp.func
def existing_cells(
    data: wp.array2d(dtype=wp.uint32),
    grid: Grid,
    row: wp.int32,
    row_y: wp.int32,
    row_z: wp.int32,
    w: wp.int32,
) -> wp.uint32:
    """Return a bit for each cell of a word: whether its eight corners have data."""
    bits = both_nodes(data, row, w, grid.words) & both_nodes(data, row_y, w, grid.words)
    row_yz = row_z + row_y - row
    return bits & both_nodes(data, row_z, w, grid.words) & both_nodes(data, row_yz, w, grid.words)


@wp.func
def count_crossed(
    inside: wp.array2d(dtype=wp.uint32),
    data: wp.array2d(dtype=wp.uint32),
    grid: Grid,
    row: wp.int32,
    row_y: wp.int32,
    row_z: wp.int32,
    w: wp.int32,
) -> wp.int32:
    """Return how many edges from the nodes of a word are crossed and have data at both ends."""
    here = inside[row, w]
    along_x = (here ^ next_node(here, load_word(inside, row, w + 1, grid.words))) & both_nodes(
        data, row, w, grid.words
    )
    along_y = (here ^ inside[row_y, w]) & data[row, w] & data[row_y, w]
    along_z = (here ^ inside[row_z, w]) & data[row, w] & data[row_z, w]
    return wp.int32(wp.bit_count(along_x) + wp.bit_count(along_y) + wp.bit_count(along_z))
