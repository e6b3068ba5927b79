"""Mark the grid edges whose ends have two labels, and the cells that have such an edge, in words of bits.

A bit of an edge is stored at its lower node, one word of 32 nodes after the other, a line for each axis. The
grid has a layer of background round the volume, so that every crossed edge lies between four cells.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.bits import bit_index, low_bits
from dmc_cli.field import Grid, GridShape, row_place
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.struct
class CrossingWords:
    """Crossed edges and active cells of a label map, and their numbers."""

    x: wp.array(dtype=wp.uint32)
    y: wp.array(dtype=wp.uint32)
    z: wp.array(dtype=wp.uint32)
    active: wp.array(dtype=wp.uint32)
    quad_start: wp.array(dtype=wp.int64)  # quads before each word
    cell_start: wp.array(dtype=wp.int64)  # active cells before each word


@dataclass(frozen=True)
class Crossings:
    """Crossed edges and active cells, numbered.

    Attributes:
        words: The kernels' `CrossingWords`.
        quad_count: Crossed edges.
        cell_count: Active cells.
    """

    words: Any
    quad_count: int
    cell_count: int


def mark_crossings(codes: Any, grid: GridShape, device: Device) -> Crossings:
    """Mark and number the crossed edges and the active cells.

    Args:
        codes: Labels as numbers from 0, uint16 (nz, ny, nx), a layer of background counted in.
        grid: The grid of these nodes.
        device: Where to work.

    Raises:
        DeviceError: There are more than 32 bits can number.
    """
    words = CrossingWords()
    count = grid.layer * grid.nz
    for name in ("x", "y", "z", "active"):
        setattr(words, name, device.empty(count, wp.uint32))
    quads, cells = device.empty(count, wp.int64), device.empty(count, wp.int64)
    outputs = [words.x, words.y, words.z, quads]
    device.launch(mark_edges_kernel, count, [grid.struct(), codes], outputs)
    words.quad_start, quad_count = device.starts(quads)
    device.launch(mark_cells_kernel, count, [grid.struct(), words.x, words.y, words.z], [words.active, cells])
    words.cell_start, cell_count = device.starts(cells)
    return Crossings(words, quad_count, cell_count)


@wp.kernel
def mark_edges_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    codes: wp.array3d(dtype=wp.uint16),
    # Out:
    x_out: wp.array(dtype=wp.uint32),
    y_out: wp.array(dtype=wp.uint32),
    z_out: wp.array(dtype=wp.uint32),
    counts_out: wp.array(dtype=wp.int64),
) -> None:
    """Compare 32 nodes with their neighbours along +x, +y and +z. One thread per word."""
    n = first + wp.tid()
    row = n / grid.words
    place = row_place(grid, row)
    j = place[0]
    k = place[1]
    start = 32 * (n - row * grid.words)
    x = wp.uint32(0)
    y = wp.uint32(0)
    z = wp.uint32(0)
    if j < grid.ny - 1 and k < grid.nz - 1:  # the last row and layer are background
        for b in range(wp.min(32, grid.nx - 1 - start)):
            i = start + b
            code = codes[k, j, i]
            x |= wp.where(codes[k, j, i + 1] != code, wp.uint32(1), wp.uint32(0)) << wp.uint32(b)
            y |= wp.where(codes[k, j + 1, i] != code, wp.uint32(1), wp.uint32(0)) << wp.uint32(b)
            z |= wp.where(codes[k + 1, j, i] != code, wp.uint32(1), wp.uint32(0)) << wp.uint32(b)
    x_out[n] = x
    y_out[n] = y
    z_out[n] = z
    counts_out[n] = wp.int64(wp.bit_count(x) + wp.bit_count(y) + wp.bit_count(z))


@wp.kernel
def mark_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    x: wp.array(dtype=wp.uint32),
    y: wp.array(dtype=wp.uint32),
    z: wp.array(dtype=wp.uint32),
    # Out:
    active_out: wp.array(dtype=wp.uint32),
    counts_out: wp.array(dtype=wp.int64),
) -> None:
    """Find the cells whose corners have several labels. One thread per word.

    Where no edge along x is crossed, one along y in each layer and one along z tell.
    """
    n = first + wp.tid()
    place = row_place(grid, n / grid.words)
    active = wp.uint32(0)
    if place[0] < grid.ny - 1 and place[1] < grid.nz - 1:
        above = n + grid.layer
        active = x[n] | x[n + grid.words] | x[above] | x[above + grid.words] | y[n] | y[above] | z[n]
    active_out[n] = active
    counts_out[n] = wp.int64(wp.bit_count(active))


@wp.func
def active_index(words: CrossingWords, grid: Grid, node: wp.vec3i) -> wp.int32:
    """Return the number of the active cell with this lowest node."""
    n = (node[1] + grid.ny * node[2]) * grid.words + node[0] / 32
    before = wp.bit_count(words.active[n] & low_bits(node[0] & 31))
    return wp.int32(words.cell_start[n]) + wp.int32(before)


@wp.func
def quad_index(words: CrossingWords, grid: Grid, node: wp.vec3i, axis: wp.int32) -> wp.int32:
    """Return the number of the quad round the crossed edge from a node along an axis."""
    n = (node[1] + grid.ny * node[2]) * grid.words + node[0] / 32
    below = low_bits(node[0] & 31)
    q = wp.int32(words.quad_start[n])
    if axis == 0:
        return q + wp.int32(wp.bit_count(words.x[n] & below))
    q += wp.int32(wp.bit_count(words.x[n]))
    if axis == 1:
        return q + wp.int32(wp.bit_count(words.y[n] & below))
    return q + wp.int32(wp.bit_count(words.y[n])) + wp.int32(wp.bit_count(words.z[n] & below))


@wp.kernel
def list_active_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    words: CrossingWords,
    # Out:
    cells_out: wp.array(dtype=wp.int64),
) -> None:
    """List the active cells by the numbers of their lowest nodes. One thread per word."""
    n = first + wp.tid()
    row = n / grid.words
    start = wp.int64(row) * wp.int64(grid.nx) + wp.int64(32 * (n - row * grid.words))
    slot = wp.int32(words.cell_start[n])
    left = words.active[n]
    while left != wp.uint32(0):
        cells_out[slot] = start + wp.int64(bit_index(left))
        slot += 1
        left &= left - wp.uint32(1)
