"""Find the active cells from the inside bits alone, 32 at a time.

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

import numpy as np
import warp as wp

from dmc_cli.bits import ALL_BITS, LANES, VECTOR_FLAGS, Words, bit_index, low_bits, next_node
from dmc_cli.contouring.stages.cell_words import (
    CellBits,
    any_bit,
    count_surrounded,
    find_candidates,
    several_polygons,
)
from dmc_cli.contouring.stages.classification import InsideBits
from dmc_cli.contouring.stages.nodata_cells import (
    count_crossed,
    existing_cells,
    has_whole_surroundings,
)
from dmc_cli.field import (
    BITS_A_CHUNK,
    Grid,
    GridShape,
    before_line,
    block_count,
    make_plane,
    position_of,
    step_along,
)
from dmc_cli.runtime import Device, mesh_size

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


ORDINARY = wp.constant(0)
SPECIAL = wp.constant(1)
CROSSED = wp.constant(2)
QUADS = wp.constant(3)
"""What is counted in each block of words, a row each of an array: ordinary and special cells, crossed edges
between two nodes with data, and quads."""


@dataclass(frozen=True)
class Cells:
    """Active cells of a grid.

    Attributes:
        bits: The kernels' `CellBits`.
        ordinary_starts: Ordinary cells before each block of words, int64, one item more than blocks.
        special_starts: Special cells before each block, likewise.
        special_row: Row of each special cell, int32, in grid order.
        special_i: Index along x of each special cell, int32.
        ordinary_count: Number of ordinary cells: the first that many vertices are theirs.
        special_count: Number of special cells.
        crossed_edges: Number of grid edges between two nodes with data whose ends are on different sides.
        quad_starts: Quads before each block of words, likewise; None where nodes without data may take quads
            away.
        quad_count: Number of quads, before nodes without data take some away.
    """

    bits: Any
    ordinary_starts: Any
    special_starts: Any
    special_row: Any
    special_i: Any
    ordinary_count: int
    special_count: int
    crossed_edges: int
    quad_starts: Any | None
    quad_count: int


def find_cells(nodes: InsideBits, grid: GridShape, device: Device) -> Cells:
    """Find the active cells, number the ordinary ones in grid order, and list the special ones.

    The lists and ranks are there for the next launch.
    """
    blocks = block_count(grid)
    active, ordinary = make_plane(grid, device), make_plane(grid, device)
    bits = CellBits()
    bits.inside, bits.inside_line = nodes.inside.rows, nodes.inside.line
    bits.active, bits.active_line = active.rows, active.line
    bits.ordinary, bits.ordinary_line = ordinary.rows, ordinary.line
    counts = device.empty((4, blocks), wp.int64)
    struct = grid.struct()
    outputs = [active.line, ordinary.line, counts]
    device.begin(find_cells_kernel, blocks, [struct, nodes.inside.line], outputs, BITS_A_CHUNK)
    bits.rank, bits.special_rank = (device.empty(grid.rows * grid.words, wp.int32) for _ in range(2))
    if nodes.data is not None:
        inputs = [struct, nodes.inside.rows, nodes.data]
        outputs = [active.rows, ordinary.rows, counts]
        device.launch(drop_nodata_cells_kernel, blocks, inputs, outputs, BITS_A_CHUNK)
    starts = device.starts_of_rows(counts)
    ordinary_starts, ordinary_count = starts[ORDINARY]
    special_starts, special_count = starts[SPECIAL]
    quad_starts, quad_count = starts[QUADS]
    if nodes.data is None:
        mesh_size(quad_count)
    mesh_size(ordinary_count + special_count)
    special_row, special_i = (device.empty(special_count, wp.int32) for _ in range(2))
    inputs = [struct, active.line, ordinary.line, ordinary_starts, special_starts]
    outputs = [bits.rank, bits.special_rank, special_row, special_i]
    device.begin(number_cells_kernel, blocks, inputs, outputs, BITS_A_CHUNK)
    return Cells(
        bits=bits,
        ordinary_starts=ordinary_starts,
        special_starts=special_starts,
        special_row=special_row,
        special_i=special_i,
        ordinary_count=ordinary_count,
        special_count=special_count,
        crossed_edges=starts[CROSSED][1],
        quad_starts=quad_starts if nodes.data is None else None,
        quad_count=quad_count,
    )


def words_near_quads(cells: Cells, grid: GridShape, device: Device) -> int | None:
    """Return the words of the line from a layer and a row before the first quad to as far behind the last.

    None where nodes are without data, or the counts are not on the host. Memory beyond them is never touched.
    """
    if cells.quad_starts is None or not device.is_cpu:
        return None
    first, last = np.searchsorted(cells.quad_starts.numpy(), [1, cells.quad_count]).tolist()
    return LANES * (last - first + 1) + 2 * (grid.layer + grid.words) if cells.quad_count else 0


@wp.func
def border_cells(grid: Grid, w: wp.int32, j: wp.int32, k: wp.int32) -> wp.uint32:
    """Return a bit for each cell of a word: whether it touches an open border."""
    across = j == 0 or k == 0 or j == grid.ny - 2 or k == grid.nz - 2
    ends = wp.where(w == 0, wp.uint32(1), wp.uint32(0))
    ends |= low_bits(grid.nx - 1 - 32 * w) & ~low_bits(grid.nx - 2 - 32 * w)
    return wp.where(grid.border == 1, wp.uint32(0), wp.where(across, ALL_BITS, ends))


@wp.kernel
def find_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    inside: wp.array(dtype=Words),
    # Out:
    active_out: wp.array(dtype=Words),
    ordinary_out: wp.array(dtype=Words),
    counts_out: wp.array2d(dtype=wp.int64),
) -> None:
    """Find the active and the ordinary cells as if every node had data. One thread per block of words."""
    block = first + wp.tid()
    n = before_line(grid) + block * LANES
    active = find_candidates(grid, inside, n)
    ordinary = Words()
    ordinary_count = wp.int32(0)
    special_count = wp.int32(0)
    crossed_count = wp.int32(0)
    quad_count = wp.int32(0)
    if any_bit(active):  # on a scan hardly ever
        w0 = inside[n]
        w2 = inside[n + grid.words]
        w4 = inside[n + grid.layer]
        w6 = inside[n + grid.layer + grid.words]
        w0_after = inside[n + 1]
        w2_after = inside[n + grid.words + 1]
        w4_after = inside[n + grid.layer + 1]
        w6_after = inside[n + grid.layer + grid.words + 1]
        start = position_of(grid, block * LANES)
        for lane in range(LANES):
            at = step_along(grid, start, lane)
            along_x = low_bits(grid.nx - 1 - 32 * at[0])  # nodes with an edge that way
            along_y = wp.where(at[1] < grid.ny - 1, ALL_BITS, wp.uint32(0))
            along_z = wp.where(at[2] < grid.nz - 1, ALL_BITS, wp.uint32(0))
            c0 = w0[lane]
            c1 = next_node(c0, w0_after[lane])
            c2 = w2[lane]
            c3 = next_node(c2, w2_after[lane])
            c4 = w4[lane]
            c5 = next_node(c4, w4_after[lane])
            c6 = w6[lane]
            c7 = next_node(c6, w6_after[lane])
            exists = active[lane] & along_x & along_y & along_z
            special = several_polygons(c0, c1, c2, c3, c4, c5, c6, c7)
            special |= border_cells(grid, at[0], at[1], at[2])
            active[lane] = exists
            ordinary[lane] = exists & ~special
            ordinary_count += wp.int32(wp.bit_count(exists & ~special))
            special_count += wp.int32(wp.bit_count(exists & special))
            x = (c0 ^ c1) & along_x  # crossed edges
            y = (c0 ^ c2) & along_y
            z = (c0 ^ c4) & along_z
            crossed_count += wp.int32(wp.bit_count(x) + wp.bit_count(y) + wp.bit_count(z))
            quad_count += count_surrounded(x, y, z, along_x, along_y, along_z, at)
    active_out[n] = active
    ordinary_out[n] = ordinary
    counts_out[ORDINARY, block] = wp.int64(ordinary_count)
    counts_out[SPECIAL, block] = wp.int64(special_count)
    counts_out[CROSSED, block] = wp.int64(crossed_count)
    counts_out[QUADS, block] = wp.int64(quad_count)


@wp.kernel
def drop_nodata_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    inside: wp.array2d(dtype=wp.uint32),
    data: wp.array2d(dtype=wp.uint32),
    # In/out:
    active_inout: wp.array2d(dtype=wp.uint32),
    ordinary_inout: wp.array2d(dtype=wp.uint32),
    # Out:
    counts_out: wp.array2d(dtype=wp.int64),
) -> None:
    """Take back cells with a node without data and edges to one. One thread per block of words."""
    block = first + wp.tid()
    ordinary_count = wp.int32(0)
    special_count = wp.int32(0)
    crossed_count = wp.int32(0)
    for n in range(block * LANES, wp.min((block + 1) * LANES, grid.ny * grid.nz * grid.words)):
        at = position_of(grid, n)
        w = at[0]
        row = n / grid.words
        row_y = wp.where(at[1] < grid.ny - 1, row + 1, row)
        row_z = wp.where(at[2] < grid.nz - 1, row + grid.ny, row)
        crossed_count += count_crossed(inside, data, grid, row, row_y, row_z, w)
        active = active_inout[row, w]
        ordinary = ordinary_inout[row, w]
        if active != wp.uint32(0):
            active &= existing_cells(data, grid, row, row_y, row_z, w)
            ordinary &= active
            if at[1] > 0 and at[2] > 0 and at[1] < grid.ny - 2 and at[2] < grid.nz - 2:
                ordinary &= has_whole_surroundings(data, grid, row, w)
            active_inout[row, w] = active
            ordinary_inout[row, w] = ordinary
        ordinary_count += wp.int32(wp.bit_count(ordinary))
        special_count += wp.int32(wp.bit_count(active & ~ordinary))
    counts_out[ORDINARY, block] = wp.int64(ordinary_count)
    counts_out[SPECIAL, block] = wp.int64(special_count)
    counts_out[CROSSED, block] = wp.int64(crossed_count)


@wp.kernel
def number_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    active: wp.array(dtype=Words),
    ordinary: wp.array(dtype=Words),
    ordinary_starts: wp.array(dtype=wp.int64),
    special_starts: wp.array(dtype=wp.int64),
    # Out:
    rank_out: wp.array(dtype=wp.int32),
    special_rank_out: wp.array(dtype=wp.int32),
    special_row_out: wp.array(dtype=wp.int32),
    special_i_out: wp.array(dtype=wp.int32),
) -> None:
    """Count the ordinary and special cells before each word with any; list the special ones.

    One thread per block of words.
    """
    block = first + wp.tid()
    rank = wp.int32(ordinary_starts[block])
    slot = wp.int32(special_starts[block])
    if rank == wp.int32(ordinary_starts[block + 1]) and slot == wp.int32(special_starts[block + 1]):
        return
    n = block * LANES
    active_words = active[before_line(grid) + n]
    ordinary_words = ordinary[before_line(grid) + n]
    for lane in range(LANES):
        ordinary_word = ordinary_words[lane]
        if ordinary_word != wp.uint32(0):
            rank_out[n + lane] = rank
            rank += wp.int32(wp.bit_count(ordinary_word))
        remaining = active_words[lane] & ~ordinary_word
        if remaining != wp.uint32(0):
            special_rank_out[n + lane] = slot
            row = (n + lane) / grid.words
            start = 32 * (n + lane - row * grid.words)
            while remaining != wp.uint32(0):
                special_row_out[slot] = row
                special_i_out[slot] = start + bit_index(remaining)
                slot += 1
                remaining &= remaining - wp.uint32(1)
