"""Number the vertices on crossed edges and count the triangles, row by row.

A vertex on a grid edge has the edge's rank: rows in grid order; in a row first the edges along x, then along
y, then z, each by their lower node. So where a row begins and its counts tell the number of any edge: one
popcount away from its word, as a cell's number is. Edges run on from word to word of a row without a gap, so
that the edge at the next node needs no look at the next word.

Most triangles are counted without a look at the cells: a polygon of n edges has n - 2 triangles, so a word
has as many as its cells have crossed edges, less two a cell. Only cells that may have several polygons are
looked at; they are special, and rare.

Where nodes are without data, the cells that exist are marked first, a bit each, and edges without any have no
vertex; else all follows from the inside bits, and nothing else is stored.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.bits import (
    ALL_BITS,
    LANES,
    VECTOR_FLAGS,
    Words,
    low_bits,
    next_node,
    previous_node,
)
from dmc_cli.contouring.stages.classification import InsideBits
from dmc_cli.contouring.stages.nodata_cells import existing_cells
from dmc_cli.field import (
    BITS_A_CHUNK,
    Grid,
    GridShape,
    before_line,
    make_plane,
    row_place,
    step_along,
)
from dmc_cli.kept_property import kept_property
from dmc_cli.runtime import Device, mesh_size, native, view

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

COUNTS = 3
"""What is counted in each row and summed, one after the other: crossed edges, triangles, special cells."""


@wp.struct
class EdgeBits:
    """The bits of nodes and cells, as lines of words, and the numbers of crossed edges.

    Attributes:
        inside: Whether a node is inside.
        is_marked: 1 if cells are missing; else all exist, and `exists` is empty.
        exists: Whether a cell exists.
        starts: Vertices before each row, int64.
        along_x, along_y: Vertices of each row on edges along x and y.
    """

    inside: wp.array(dtype=Words)
    is_marked: wp.int32
    exists: wp.array(dtype=Words)
    starts: wp.array(dtype=wp.int64)
    along_x: wp.array(dtype=wp.int32)
    along_y: wp.array(dtype=wp.int32)


@dataclass(frozen=True)
class EdgeRanks:
    """Crossed edges and their numbers, and what the cells beside them have.

    Attributes:
        bits: The kernels' `EdgeBits`.
        rows: The inside bits, uint32 [row, word].
        triangle_starts: Triangles before each row, int64, of the cells that the tables of cases serve.
        special_starts: Special cells before each row, int64.
        vertex_count: Vertices on crossed edges.
        triangle_count: Triangles of all rows.
        special_count: Cells that may have several polygons.
        active: Crossed cells of each row, int32.
    """

    bits: Any
    rows: Any
    triangle_starts: Any
    special_starts: Any
    vertex_count: int
    triangle_count: int
    special_count: int
    active: Any

    @kept_property
    def active_cells(self) -> int:
        """Return how many cells are crossed; summed when it is asked for, beside launches that go on."""
        return int(self.active.numpy().sum(dtype=np.int64))


def rank_edges(nodes: InsideBits, grid: GridShape, case_triangles: Any, device: Device) -> EdgeRanks:
    """Give each crossed edge its number, and count the triangles.

    Args:
        nodes: Inside bits; they may be begun only.
        grid: The grid over the volume.
        case_triangles: Triangles of each case, uint8 (256,), 0 where other kernels make them.
        device: Where to work.

    Raises:
        DeviceError: More vertices or triangles than 32-bit mesh indices can number.
    """
    bits = EdgeBits()
    bits.inside = nodes.inside.line
    bits.is_marked = int(nodes.data is not None)
    bits.exists = _mark_cells(nodes.data, grid, device) if bits.is_marked else device.empty(0, Words)
    counts = device.empty((COUNTS, grid.rows), wp.int64)
    flat = view(counts, wp.int64, COUNTS * grid.rows)
    active = device.empty(grid.rows, wp.int32)
    bits.along_x, bits.along_y = device.empty(grid.rows, wp.int32), device.empty(grid.rows, wp.int32)
    bits.starts = device.empty(0, wp.int64)
    span = max(device.span, LANES // grid.words)
    inputs = [grid.struct(), bits, case_triangles, span]
    outputs = [flat, bits.along_x, bits.along_y, active]
    device.launch(count_rows_kernel, -(-grid.rows // span), inputs, outputs, BITS_A_CHUNK)
    (bits.starts, vertices), (triangle_starts, triangles), (special_starts, special) = device.starts_of_rows(
        counts
    )
    return EdgeRanks(
        bits=bits,
        rows=nodes.inside.rows,
        triangle_starts=triangle_starts,
        special_starts=special_starts,
        vertex_count=mesh_size(vertices),
        triangle_count=mesh_size(triangles),
        special_count=mesh_size(special),
        active=active,
    )


def _mark_cells(data: Any, grid: GridShape, device: Device) -> Any:
    """Return the line of bits of the cells that exist."""
    exists = make_plane(grid, device)
    inputs = [grid.struct(), data]
    device.launch(mark_cells_kernel, grid.rows, inputs, [exists.rows], BITS_A_CHUNK)
    return exists.line


@wp.kernel
def mark_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    data: wp.array2d(dtype=wp.uint32),
    # Out:
    exists_out: wp.array2d(dtype=wp.uint32),
) -> None:
    """Mark the cells whose corners all have data. One thread per row."""
    row = first + wp.tid()
    place = row_place(grid, row)
    is_inner = place[0] < grid.ny - 1 and place[1] < grid.nz - 1
    for w in range(grid.words):
        bits = wp.uint32(0)
        if is_inner:
            bits = existing_cells(data, grid, row, row + 1, row + grid.ny, w) & low_bits(grid.nx - 1 - 32 * w)
        exists_out[row, w] = bits


@wp.struct
class EdgeWords:
    """The edges along x, y and z from the nodes of a block that have a vertex, a bit each."""

    x: Words
    y: Words
    z: Words


@wp.func
def edge_words(grid: Grid, bits: EdgeBits, n: wp.int32, start: wp.vec3i, count: wp.int32) -> EdgeWords:
    """Find the edges with a vertex from the nodes of `count` words from n of the line, at `start`, on."""
    here = bits.inside[n]
    after = bits.inside[n + 1]
    along_y = bits.inside[n + grid.words]
    along_z = bits.inside[n + grid.layer]
    edges = EdgeWords()
    x = Words()
    y = Words()
    z = Words()
    for lane in range(LANES):
        at = step_along(grid, start, lane)
        nodes = wp.where(lane < count, ALL_BITS, wp.uint32(0))
        rows_y = wp.where(at[1] < grid.ny - 1, nodes, wp.uint32(0))
        rows_z = wp.where(at[2] < grid.nz - 1, nodes, wp.uint32(0))
        both = low_bits(grid.nx - 1 - 32 * at[0]) & nodes
        x[lane] = (here[lane] ^ next_node(here[lane], after[lane])) & both
        y[lane] = (here[lane] ^ along_y[lane]) & rows_y
        z[lane] = (here[lane] ^ along_z[lane]) & rows_z
    if bits.is_marked == 1:
        below = n - grid.words
        front = n - grid.layer
        round_z = bits.exists[n] | bits.exists[below]
        round_x = round_z | bits.exists[front] | bits.exists[front - grid.words]
        round_y = bits.exists[n] | bits.exists[front]
        before_y = bits.exists[n - 1] | bits.exists[front - 1]
        before_z = bits.exists[n - 1] | bits.exists[below - 1]
        for lane in range(LANES):
            x[lane] &= round_x[lane]
            y[lane] &= round_y[lane] | previous_node(round_y[lane], before_y[lane])
            z[lane] &= round_z[lane] | previous_node(round_z[lane], before_z[lane])
    edges.x = x
    edges.y = y
    edges.z = z
    return edges


@wp.func_native(native(__file__, "count_rows"))
def count_rows(
    inside: wp.array(dtype=Words),
    exists: wp.array(dtype=Words),
    is_marked: wp.int32,
    nodes: wp.vec3i,
    words: wp.int32,
    ahead: wp.int32,
    row: wp.int32,
    span: wp.int32,
    case_triangles: wp.array(dtype=wp.uint8),
    counts_out: wp.array(dtype=wp.int64),
    along_x_out: wp.array(dtype=wp.int32),
    along_y_out: wp.array(dtype=wp.int32),
    active_out: wp.array(dtype=wp.int32),
) -> None:
    """Count for `span` rows from `row` on; `ahead` words lie before the lines."""
    ...


@wp.kernel
def count_rows_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: EdgeBits,
    case_triangles: wp.array(dtype=wp.uint8),
    span: wp.int32,
    # Out:
    counts_out: wp.array(dtype=wp.int64),
    along_x_out: wp.array(dtype=wp.int32),
    along_y_out: wp.array(dtype=wp.int32),
    active_out: wp.array(dtype=wp.int32),
) -> None:
    """Count crossed edges, triangles, special and crossed cells. One thread per `span` rows of nodes."""
    count_rows(
        bits.inside,
        bits.exists,
        bits.is_marked,
        wp.vec3i(grid.nx, grid.ny, grid.nz),
        grid.words,
        before_line(grid),
        (first + wp.tid()) * span,
        span,
        case_triangles,
        counts_out,
        along_x_out,
        along_y_out,
        active_out,
    )
