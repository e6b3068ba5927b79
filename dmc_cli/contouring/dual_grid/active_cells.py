"""Find the active cells from the inside bits, 32 at a time, and number those that get a vertex.

A cell is active if it exists and its corners are not all on one side. It gets a vertex if one of its crossed
edges carries a quad, which needs four cells round the edge: at an open border, and beside nodes without data,
an active cell may have none, and a vertex there would belong to no face. A vertex's number is the rank of
its cell's bit.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.bits import ALL_BITS, LANES, VECTOR_FLAGS, Words, low_bits, next_node
from dmc_cli.contouring.stages.cell_words import (
    CellBits,
    any_bit,
    count_surrounded,
    find_candidates,
)
from dmc_cli.contouring.stages.classification import InsideBits
from dmc_cli.contouring.stages.nodata_cells import count_crossed, existing_cells
from dmc_cli.contouring.stages.plain_quads import count_bits, quad_edges
from dmc_cli.field import (
    BITS_A_CHUNK,
    Grid,
    GridShape,
    before_line,
    block_count,
    make_plane,
    position_of,
    step_along,
    store_cells,
)
from dmc_cli.runtime import Device, mesh_size

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

VERTICES, QUADS, ACTIVE, CROSSED = (wp.constant(n) for n in range(4))
"""What is counted in each block of words, a row each of an array: cells with a vertex, quads, active cells,
and crossed edges between two nodes with data."""


@dataclass(frozen=True)
class ActiveCells:
    """The active cells of a grid that have a vertex, and what was counted on the way.

    Attributes:
        bits: The kernels' `CellBits`, in which all cells with a vertex are active and ordinary.
        cell: The cells' numbers in grid order, int64 (V,).
        starts: Cells before each block of words, int64, one item more than blocks.
        quad_starts: Quads before each block, likewise.
        quad_count: Number of quads.
        active_count: Number of active cells, those without a vertex counted in.
        crossed_edges: Number of grid edges between two nodes with data whose ends are on different sides.
    """

    bits: Any
    cell: Any
    starts: Any
    quad_starts: Any
    quad_count: int
    active_count: int
    crossed_edges: int

    @property
    def count(self) -> int:
        """Return the number of cells with a vertex."""
        return int(self.cell.shape[0])


@dataclass(frozen=True)
class FoundCells:
    """Active cells that are counted, but not yet listed.

    Attributes:
        bits: The kernels' `CellBits`, ranks not yet written.
        starts: Cells and quads before each block of words, with their totals.
        active_count: Number of active cells.
        crossed_edges: Number of crossed edges.
    """

    bits: Any
    starts: list[tuple[Any, int]]
    active_count: int
    crossed_edges: int

    def words_near(self, grid: GridShape, device: Device) -> int | None:
        """Return the words of the line between the first and the last block with vertices; None on a GPU."""
        starts, count = self.starts[int(VERTICES)]
        if not device.is_cpu:
            return None
        first, last = np.searchsorted(starts.numpy(), [1, count]).tolist()
        return LANES * (last - first + 1) if count else 0


def find_active(nodes: InsideBits, grid: GridShape, device: Device) -> FoundCells:
    """Find and count the active cells and the quads.

    Raises:
        DeviceError: More vertices or quads than 32-bit mesh indices can number.
    """
    blocks = block_count(grid)
    active = make_plane(grid, device)
    bits = CellBits()
    bits.inside, bits.inside_line = nodes.inside.rows, nodes.inside.line
    bits.active, bits.active_line = active.rows, active.line
    bits.ordinary, bits.ordinary_line = active.rows, active.line
    counts = device.empty((4, blocks), wp.int64)
    struct = grid.struct()
    inputs = [struct, nodes.inside.line]
    device.begin(find_active_kernel, blocks, inputs, [active.line, counts], BITS_A_CHUNK)
    if nodes.data is not None:
        existing = make_plane(grid, device)
        inputs = [struct, nodes.inside.rows, nodes.data]
        device.launch(drop_nodata_kernel, blocks, inputs, [existing.rows, counts], BITS_A_CHUNK)
        bits.active, bits.active_line = existing.rows, existing.line
        device.launch(drop_unused_kernel, blocks, [struct, bits], [active.line, counts], BITS_A_CHUNK)
        bits.active, bits.active_line = active.rows, active.line
    starts = device.starts_of_rows(counts)
    for kind in (VERTICES, QUADS):
        mesh_size(starts[int(kind)][1])
    return FoundCells(bits, starts[:2], starts[int(ACTIVE)][1], starts[int(CROSSED)][1])


def list_active(found: FoundCells, grid: GridShape, device: Device) -> ActiveCells:
    """Begin to number and list the cells; they are there for the next launch."""
    (starts, count), (quad_starts, quad_count) = found.starts
    bits, cell = found.bits, device.empty(count, wp.int64)
    bits.rank = device.empty(grid.rows * grid.words, wp.int32)
    bits.special_rank = device.empty(0, wp.int32)
    inputs = [grid.struct(), bits.active_line, starts]
    device.begin(list_active_kernel, block_count(grid), inputs, [bits.rank, cell], BITS_A_CHUNK)
    return ActiveCells(bits, cell, starts, quad_starts, quad_count, found.active_count, found.crossed_edges)


@wp.func
def touched_cells(
    x0: wp.uint32,
    x1: wp.uint32,
    x2: wp.uint32,
    x3: wp.uint32,
    y0: wp.uint32,
    y1: wp.uint32,
    y2: wp.uint32,
    y3: wp.uint32,
    z0: wp.uint32,
    z1: wp.uint32,
    z2: wp.uint32,
    z3: wp.uint32,
) -> wp.uint32:
    """Return a bit for each cell: whether any of its four edges along each axis is set."""
    return x0 | x1 | x2 | x3 | y0 | y1 | y2 | y3 | z0 | z1 | z2 | z3


@wp.kernel
def find_active_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    inside: wp.array(dtype=Words),
    # Out:
    active_out: wp.array(dtype=Words),
    counts_out: wp.array2d(dtype=wp.int64),
) -> None:
    """Find the active cells that get a vertex, as if every node had data. One thread per block of words.

    An edge has four cells if it is not in the grid's border: of a cell's edges along x those at j and k have
    if these are not 0, those at j + 1 and k + 1 if these are not the last.
    """
    block = first + wp.tid()
    n = before_line(grid) + block * LANES
    active = find_candidates(grid, inside, n)
    vertex_count = wp.int32(0)
    quad_count = wp.int32(0)
    active_count = wp.int32(0)
    crossed_count = wp.int32(0)
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
            i0 = ~wp.where(at[0] == 0, wp.uint32(1), wp.uint32(0))  # cells whose low or high face is inner
            i1 = low_bits(grid.nx - 2 - 32 * at[0])
            j0 = wp.where(at[1] > 0, ALL_BITS, wp.uint32(0))
            j1 = wp.where(at[1] < grid.ny - 2, ALL_BITS, wp.uint32(0))
            k0 = wp.where(at[2] > 0, ALL_BITS, wp.uint32(0))
            k1 = wp.where(at[2] < grid.nz - 2, ALL_BITS, wp.uint32(0))
            used = exists & touched_cells(
                (c0 ^ c1) & j0 & k0,
                (c2 ^ c3) & j1 & k0,
                (c4 ^ c5) & j0 & k1,
                (c6 ^ c7) & j1 & k1,
                (c0 ^ c2) & i0 & k0,
                (c1 ^ c3) & i1 & k0,
                (c4 ^ c6) & i0 & k1,
                (c5 ^ c7) & i1 & k1,
                (c0 ^ c4) & i0 & j0,
                (c1 ^ c5) & i1 & j0,
                (c2 ^ c6) & i0 & j1,
                (c3 ^ c7) & i1 & j1,
            )
            active[lane] = used
            vertex_count += wp.int32(wp.bit_count(used))
            active_count += wp.int32(wp.bit_count(exists))
            x = (c0 ^ c1) & along_x  # crossed edges
            y = (c0 ^ c2) & along_y
            z = (c0 ^ c4) & along_z
            crossed_count += wp.int32(wp.bit_count(x) + wp.bit_count(y) + wp.bit_count(z))
            quad_count += count_surrounded(x, y, z, along_x, along_y, along_z, at)
    active_out[n] = active
    counts_out[VERTICES, block] = wp.int64(vertex_count)
    counts_out[QUADS, block] = wp.int64(quad_count)
    counts_out[ACTIVE, block] = wp.int64(active_count)
    counts_out[CROSSED, block] = wp.int64(crossed_count)


@wp.func
def corners_differ(
    inside: wp.array2d(dtype=wp.uint32),
    row: wp.int32,
    row_y: wp.int32,
    row_z: wp.int32,
    w: wp.int32,
    words: wp.int32,
) -> wp.uint32:
    """Return a bit for each cell of a word: whether its corners differ; the row's last node has none."""
    row_yz = row_z + row_y - row
    some = inside[row, w] | inside[row_y, w] | inside[row_z, w] | inside[row_yz, w]
    every = inside[row, w] & inside[row_y, w] & inside[row_z, w] & inside[row_yz, w]
    some_after = wp.uint32(0)
    every_after = wp.uint32(0)
    if w + 1 < words:
        some_after = inside[row, w + 1] | inside[row_y, w + 1] | inside[row_z, w + 1] | inside[row_yz, w + 1]
        every_after = inside[row, w + 1] & inside[row_y, w + 1] & inside[row_z, w + 1] & inside[row_yz, w + 1]
    return (some | next_node(some, some_after)) & ~(every & next_node(every, every_after))


@wp.kernel
def drop_nodata_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    inside: wp.array2d(dtype=wp.uint32),
    data: wp.array2d(dtype=wp.uint32),
    # Out:
    existing_out: wp.array2d(dtype=wp.uint32),
    counts_out: wp.array2d(dtype=wp.int64),
) -> None:
    """Find the active cells whose corners all have data, and count them. One thread per block of words."""
    block = first + wp.tid()
    active_count = wp.int32(0)
    crossed_count = wp.int32(0)
    for n in range(block * LANES, wp.min((block + 1) * LANES, grid.ny * grid.nz * grid.words)):
        at = position_of(grid, n)
        w = at[0]
        row = n / grid.words
        row_y = wp.where(at[1] < grid.ny - 1, row + 1, row)
        row_z = wp.where(at[2] < grid.nz - 1, row + grid.ny, row)
        crossed_count += count_crossed(inside, data, grid, row, row_y, row_z, w)
        active = wp.uint32(0)
        if row_y != row and row_z != row:
            active = corners_differ(inside, row, row_y, row_z, w, grid.words)
            if active != wp.uint32(0):
                active &= existing_cells(data, grid, row, row_y, row_z, w)
        existing_out[row, w] = active
        active_count += wp.int32(wp.bit_count(active))
    counts_out[ACTIVE, block] = wp.int64(active_count)
    counts_out[CROSSED, block] = wp.int64(crossed_count)


@wp.func
def next_edges(edges: wp.uint32, following: wp.uint32) -> wp.uint32:
    """Return the bits of edges that go up from either end of a cell's edge along x."""
    return edges | next_node(edges, following)


@wp.func
def cells_of_edges(grid: Grid, bits: CellBits, n: wp.int32) -> Words:
    """Return a bit for each cell of a block: whether one of its twelve edges carries a quad."""
    e0 = quad_edges(grid, bits, n)
    e1 = quad_edges(grid, bits, n + grid.words)
    e2 = quad_edges(grid, bits, n + grid.layer)
    e3 = quad_edges(grid, bits, n + grid.layer + grid.words)
    f0 = quad_edges(grid, bits, n + 1)
    f1 = quad_edges(grid, bits, n + grid.words + 1)
    f2 = quad_edges(grid, bits, n + grid.layer + 1)
    used = Words()
    for lane in range(LANES):
        y = LANES + lane
        z = 2 * LANES + lane
        along = e0[lane] | e1[lane] | e2[lane] | e3[lane]
        along |= next_edges(e0[y] | e2[y] | e0[z] | e1[z], f0[y] | f2[y] | f0[z] | f1[z])
        used[lane] = along
    return used


@wp.kernel
def drop_unused_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    # Out:
    active_out: wp.array(dtype=Words),
    counts_out: wp.array2d(dtype=wp.int64),
) -> None:
    """Keep the active cells at an edge with a quad, and count them and the quads. One thread per block."""
    block = first + wp.tid()
    n = before_line(grid) + block * LANES
    used = bits.active_line[n]
    vertex_count = wp.int32(0)
    quad_count = wp.int32(0)
    if any_bit(used):
        quad_count = count_bits(quad_edges(grid, bits, n))
        touched = cells_of_edges(grid, bits, n)
        for lane in range(LANES):
            used[lane] &= touched[lane]
            vertex_count += wp.int32(wp.bit_count(used[lane]))
    active_out[n] = used
    counts_out[VERTICES, block] = wp.int64(vertex_count)
    counts_out[QUADS, block] = wp.int64(quad_count)


@wp.kernel
def list_active_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    active: wp.array(dtype=Words),
    starts: wp.array(dtype=wp.int64),
    # Out:
    rank_out: wp.array(dtype=wp.int32),
    cell_out: wp.array(dtype=wp.int64),
) -> None:
    """Count the cells before each word with any, and list them. One thread per block of words."""
    block = first + wp.tid()
    rank = wp.int32(starts[block])
    if rank == wp.int32(starts[block + 1]):
        return
    n = block * LANES
    words = active[before_line(grid) + n]
    store_cells(words, n, grid.words, grid.nx, rank, cell_out)
    for lane in range(LANES):
        if words[lane] != wp.uint32(0):
            rank_out[n + lane] = rank
            rank += wp.int32(wp.bit_count(words[lane]))
