"""Active cells, found from the inside bits alone, 32 at a time.

A cell is active if it exists and its corners are not all on one side. An *ordinary* cell gives exactly
one vertex: its crossed edges form one MC polygon and each of them carries a quad. A *special* cell needs
a closer look (`polygons.py`); it is one of

    - a cell with an ambiguous face: two diagonal corners inside, two outside;
    - a cell whose only inside (or outside) corners are two opposite ones: always two polygons;
    - a cell at an open border, or beside a cell that does not exist, where edges have no quad.

Every other active cell has one polygon, since its inside corners are connected along edges, and so are
its outside corners (checked for all 256 cases in the tests).

Ordinary cells are numbered by rank: a count of the set bits before them, by word and within the word.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.device import Device
from dmc_cli.surface.grid import ALL_BITS, Grid, GridShape, low_bits, next_node, previous_node
from dmc_cli.surface.inside import InsideBits

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class CellBits:
    """The bits that later stages ask about cells and nodes, all uint32 [row, word].

    `rank` [row, word] counts the ordinary cells before the word, in grid order.
    """

    inside: wp.array2d(dtype=wp.uint32)
    active: wp.array2d(dtype=wp.uint32)
    ordinary: wp.array2d(dtype=wp.uint32)
    rank: wp.array2d(dtype=wp.int32)


@dataclass(frozen=True)
class Cells:
    """Active cells of a grid.

    Attributes:
        bits: The kernels' `CellBits`.
        special_starts: Special cells before each row, int64, one item more than rows.
        ordinary_count: Number of ordinary cells: the first that many vertices are theirs.
        special_count: Number of special cells.
        crossed_edges: Number of grid edges between two nodes with data whose ends are on different sides.
    """

    bits: Any
    special_starts: Any
    ordinary_count: int
    special_count: int
    crossed_edges: int


def find_cells(nodes: InsideBits, grid: GridShape, device: Device) -> Cells:
    """Find the active cells and number the ordinary ones in grid order."""
    bits = CellBits()
    bits.inside = nodes.inside
    bits.active = device.empty((grid.rows, grid.words), wp.uint32)
    bits.ordinary = device.empty((grid.rows, grid.words), wp.uint32)
    ordinary, special, crossed = (device.empty(grid.rows, wp.int64) for _ in range(3))
    struct = grid.struct()
    outputs = [bits.active, bits.ordinary, ordinary, special, crossed]
    device.launch(find_cells_kernel, grid.rows, [struct, nodes.inside], outputs)
    if nodes.data is not None:
        device.launch(drop_absent_cells_kernel, grid.rows, [struct, nodes.inside, nodes.data], outputs)
    ordinary_starts, ordinary_count = device.starts(ordinary)
    special_starts, special_count = device.starts(special)
    bits.rank = device.empty((grid.rows, grid.words), wp.int32)
    device.launch(rank_kernel, grid.rows, [grid.words, bits.ordinary, ordinary_starts], [bits.rank])
    return Cells(bits, special_starts, ordinary_count, special_count, device.total(crossed))


@wp.func
def load_word(bits: wp.array2d(dtype=wp.uint32), row: wp.int32, w: wp.int32, words: wp.int32) -> wp.uint32:
    """Return word `w` of a row, 0 off its ends."""
    word = wp.uint32(0)
    if w >= 0 and w < words:
        word = bits[row, w]
    return word


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
    # without an ambiguous face, two opposite corners on the same side and their six other neighbours
    # on the other side leave only the case of two lone opposite corners
    lone07 = ~(c0 ^ c7) & (c0 ^ c1) & (c0 ^ c2) & (c0 ^ c4) & (c0 ^ c3) & (c0 ^ c5) & (c0 ^ c6)
    lone16 = ~(c1 ^ c6) & (c1 ^ c0) & (c1 ^ c3) & (c1 ^ c5) & (c1 ^ c2) & (c1 ^ c4) & (c1 ^ c7)
    lone25 = ~(c2 ^ c5) & (c2 ^ c0) & (c2 ^ c3) & (c2 ^ c6) & (c2 ^ c1) & (c2 ^ c4) & (c2 ^ c7)
    lone34 = ~(c3 ^ c4) & (c3 ^ c1) & (c3 ^ c2) & (c3 ^ c7) & (c3 ^ c0) & (c3 ^ c5) & (c3 ^ c6)
    return faces | lone07 | lone16 | lone25 | lone34


@wp.func
def border_cells(grid: Grid, j: wp.int32, k: wp.int32, w: wp.int32) -> wp.uint32:
    """Return a bit for each cell of a word: whether it touches an open border."""
    bits = wp.uint32(0)
    if grid.border == 0:
        if j == 0 or k == 0 or j == grid.ny - 2 or k == grid.nz - 2:
            bits = ALL_BITS
        else:
            if w == 0:
                bits = wp.uint32(1)
            bits |= low_bits(grid.nx - 1 - 32 * w) & ~low_bits(grid.nx - 2 - 32 * w)
    return bits


@wp.kernel
def find_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    inside: wp.array2d(dtype=wp.uint32),
    # Out:
    active_out: wp.array2d(dtype=wp.uint32),
    ordinary_out: wp.array2d(dtype=wp.uint32),
    ordinary_count_out: wp.array(dtype=wp.int64),
    special_count_out: wp.array(dtype=wp.int64),
    crossed_count_out: wp.array(dtype=wp.int64),
):
    """Find the active and the ordinary cells as if every node had data. One thread a row of nodes."""
    row = first + wp.tid()
    j = row % grid.ny
    k = row // grid.ny
    has_y = j < grid.ny - 1
    has_z = k < grid.nz - 1
    row_y = wp.where(has_y, row + 1, row)
    row_z = wp.where(has_z, row + grid.ny, row)
    row_yz = wp.where(has_y, row_z + 1, row_z)
    has_cells = has_y and has_z

    ordinary_count = wp.int32(0)
    special_count = wp.int32(0)
    crossed_count = wp.int32(0)
    n00 = inside[row, 0]
    n10 = inside[row_y, 0]
    n01 = inside[row_z, 0]
    n11 = inside[row_yz, 0]
    for w in range(grid.words):
        c0 = n00
        c2 = n10
        c4 = n01
        c6 = n11
        after = wp.min(w + 1, grid.words - 1)  # after the last word comes nothing that a cell has
        n00 = inside[row, after]
        n10 = inside[row_y, after]
        n01 = inside[row_z, after]
        n11 = inside[row_yz, after]
        c1 = next_node(c0, n00)
        c3 = next_node(c2, n10)
        c5 = next_node(c4, n01)
        c7 = next_node(c6, n11)
        some = c0 | c1 | c2 | c3 | c4 | c5 | c6 | c7
        every = c0 & c1 & c2 & c3 & c4 & c5 & c6 & c7
        active = wp.uint32(0)
        ordinary = wp.uint32(0)
        if some != every:  # on a scan hardly ever
            cells = low_bits(grid.nx - 1 - 32 * w)
            crossed_count += wp.int32(
                wp.bit_count((c0 ^ c1) & cells) + wp.bit_count(c0 ^ c2) + wp.bit_count(c0 ^ c4)
            )
            if has_cells:
                active = (some & ~every) & cells
                special = several_polygons(c0, c1, c2, c3, c4, c5, c6, c7) | border_cells(grid, j, k, w)
                ordinary = active & ~special
                ordinary_count += wp.int32(wp.bit_count(ordinary))
                special_count += wp.int32(wp.bit_count(active & special))
        active_out[row, w] = active
        ordinary_out[row, w] = ordinary
    ordinary_count_out[row] = wp.int64(ordinary_count)
    special_count_out[row] = wp.int64(special_count)
    crossed_count_out[row] = wp.int64(crossed_count)


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


@wp.kernel
def drop_absent_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    inside: wp.array2d(dtype=wp.uint32),
    data: wp.array2d(dtype=wp.uint32),
    # In/out:
    active_inout: wp.array2d(dtype=wp.uint32),
    ordinary_inout: wp.array2d(dtype=wp.uint32),
    # Out:
    ordinary_count_out: wp.array(dtype=wp.int64),
    special_count_out: wp.array(dtype=wp.int64),
    crossed_count_out: wp.array(dtype=wp.int64),
):
    """Take back cells with a node without data and edges to one. One thread a row of nodes."""
    row = first + wp.tid()
    j = row % grid.ny
    k = row // grid.ny
    row_y = wp.where(j < grid.ny - 1, row + 1, row)
    row_z = wp.where(k < grid.nz - 1, row + grid.ny, row)
    row_yz = wp.where(j < grid.ny - 1, row_z + 1, row_z)
    at_border = j == 0 or k == 0 or j >= grid.ny - 2 or k >= grid.nz - 2
    ordinary_count = wp.int32(0)
    special_count = wp.int32(0)
    crossed_count = wp.int32(0)
    for w in range(grid.words):
        here = inside[row, w]
        d0 = data[row, w]
        d1 = next_node(d0, load_word(data, row, w + 1, grid.words))
        x_edges = (here ^ next_node(here, load_word(inside, row, w + 1, grid.words))) & d0 & d1
        y_edges = (here ^ inside[row_y, w]) & d0 & data[row_y, w]
        z_edges = (here ^ inside[row_z, w]) & d0 & data[row_z, w]
        crossed_count += wp.int32(wp.bit_count(x_edges) + wp.bit_count(y_edges) + wp.bit_count(z_edges))

        active = active_inout[row, w]
        ordinary = ordinary_inout[row, w]
        if active != wp.uint32(0):
            active &= d0 & d1 & both_nodes(data, row_y, w, grid.words)
            active &= both_nodes(data, row_z, w, grid.words) & both_nodes(data, row_yz, w, grid.words)
            ordinary &= active
            if not at_border:
                ordinary &= has_whole_surroundings(data, grid, row, w)
            active_inout[row, w] = active
            ordinary_inout[row, w] = ordinary
        ordinary_count += wp.int32(wp.bit_count(ordinary))
        special_count += wp.int32(wp.bit_count(active & ~ordinary))
    ordinary_count_out[row] = wp.int64(ordinary_count)
    special_count_out[row] = wp.int64(special_count)
    crossed_count_out[row] = wp.int64(crossed_count)


@wp.kernel
def rank_kernel(
    # In:
    first: wp.int32,
    words: wp.int32,
    ordinary: wp.array2d(dtype=wp.uint32),
    starts: wp.array(dtype=wp.int64),
    # Out:
    rank_out: wp.array2d(dtype=wp.int32),
):
    """Count the ordinary cells before each word. One thread a row."""
    row = first + wp.tid()
    count = wp.int32(starts[row])
    for w in range(words):
        rank_out[row, w] = count
        count += wp.int32(wp.bit_count(ordinary[row, w]))
