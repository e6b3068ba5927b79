"""Classify nodes as inside or outside: the one pass over the stored values, a bit a node.

A node is inside if its physical value is at or above the isovalue: one bit a node, 32 nodes a word.
Everything about which cells and edges the surface crosses follows from these bits alone.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.bits import ALL_BITS, VECTOR_FLAGS, low_bits, previous_node
from dmc_cli.field import (
    DeviceVolume,
    Grid,
    GridShape,
    Plane,
    bits_at_least,
    compare_row,
    finite_bits,
    make_plane,
    node_of_volume,
    padding_range,
    row_place,
    stored_isovalue,
)
from dmc_cli.runtime import Device
from dmc_cli.settings import SurfaceSettings

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

WORD = 32
"""Nodes a word."""

NODES_A_CHUNK = 1 << 17
"""Nodes a chunk at least, as `ITEMS_A_CHUNK` of the device."""


@wp.struct
class Levels:
    """What the bits of a node depend on.

    A node has data if it is finite, and not at or above `padding` without being at or above
    `after_padding`. It is inside if it is at or above `cut`, or for a negative slope (`inverted` all ones)
    if it is not. `settles` is 1 where comparison bits are not yet inside bits though all nodes have data.

    All three are numbers of the stored type, which float64 holds; each has a mask, 0 where no number of the
    type is as high as what was asked for, else all ones.
    """

    cut: wp.float64
    cut_mask: wp.uint32
    inverted: wp.uint32
    settles: wp.int32
    checks_finite: wp.int32
    checks_padding: wp.int32
    padding: wp.float64
    padding_mask: wp.uint32
    after_padding: wp.float64
    after_padding_mask: wp.uint32
    outside: wp.uint32  # all ones where nodes that are not there count as inside: the object is the low side


@dataclass(frozen=True)
class InsideBits:
    """One bit a node.

    Attributes:
        inside: Whether the node is at or above the isovalue.
        data: Whether the node has data, uint32 [row, word]; None where all nodes count as data: no node is
            without, or the border is closed.
        no_data_count: Number of the volume's nodes without data.
    """

    inside: Plane
    data: Any | None
    no_data_count: int


def find_inside(volume: DeviceVolume, settings: SurfaceSettings, grid: GridShape) -> InsideBits:
    """Begin to find one bit a node: whether it is inside; it is there for the next launch.

    Args:
        volume: Stored values on the device.
        settings: Isovalue and side.
        grid: The grid over the volume.
    """
    device = volume.device
    levels = _levels(volume, settings)
    inside = make_plane(grid, device)
    inputs = [grid.struct(), volume.bytes, volume.kind, levels]
    missing = device.empty(grid.rows if levels.checks_finite or levels.checks_padding else 0, wp.int64)
    if volume.index is None:
        least = -(-NODES_A_CHUNK // grid.nx)
        device.begin(find_inside_kernel, grid.rows, inputs, [inside.rows, missing], least)
        no_data_count = count_missing(missing, device)
    else:  # only here: kernels that a run at one isovalue need not read
        from dmc_cli.contouring.stages.indexed_classification import find_inside_by_index

        no_data_count = find_inside_by_index(volume, levels, grid, inside, missing)
    if no_data_count == 0 or grid.border == 1:
        return InsideBits(inside, None, no_data_count)
    data = None if volume.index is None else volume.index.data
    if data is None:
        data = device.empty((grid.rows, grid.words), wp.uint32)
        device.launch(find_data_kernel, grid.rows, inputs, [data])
        if volume.index is not None:
            volume.index.data = data
    return InsideBits(inside, data, no_data_count)


def count_missing(missing: Any, device: Device) -> int:
    """Return the number of nodes without data from that of each row, once they are counted."""
    if missing.shape[0] == 0:
        return 0
    device.finish()
    return device.total(missing)


def _levels(volume: DeviceVolume, settings: SurfaceSettings) -> Any:
    """Return the thresholds between the kinds of nodes."""
    dtype = volume.dtype
    levels = Levels()
    isovalue = stored_isovalue(volume.volume, settings.settled_isovalue)
    negative = volume.volume.slope < 0
    cut = _above(dtype, isovalue) if negative else isovalue
    levels.cut, levels.cut_mask = _threshold(dtype, cut)
    levels.inverted = ALL_BITS if negative else 0
    levels.settles = int(negative or levels.cut_mask == 0)
    levels.outside = ALL_BITS if settings.inside == "below" else 0
    levels.checks_finite = int(dtype.kind == "f")
    low, high = padding_range(volume.volume)
    levels.checks_padding = int(low <= high)
    if levels.checks_padding:
        levels.padding, levels.padding_mask = _threshold(dtype, low)
        levels.after_padding, levels.after_padding_mask = _threshold(dtype, _above(dtype, high))
    return levels


def _above(dtype: np.dtype[Any], value: float) -> float:
    """Return the least value of the type above `value`."""
    if dtype.kind == "f":
        with np.errstate(over="ignore"):
            rounded = dtype.type(value)
            following = np.nextafter(rounded, dtype.type(math.inf))
        is_above = float(rounded) > value  # NumPy alone would round the value, too
        return float(rounded if is_above else following)
    return math.floor(value) + 1


def _threshold(dtype: np.dtype[Any], value: float) -> tuple[float, Any]:
    """Return the least number of the type at or above `value`, and its mask."""
    if dtype.kind == "f":
        with np.errstate(over="ignore"):
            rounded = dtype.type(value)
        return float(rounded) if float(rounded) >= value else _above(dtype, value), ALL_BITS
    bits = 8 * dtype.itemsize
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if dtype.kind == "i" else (0, (1 << bits) - 1)
    least = math.ceil(value)
    return min(max(least, low), high), ALL_BITS if least <= high else 0


@wp.func
def nodes_with_data(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, count: wp.int32, levels: Levels
) -> wp.uint32:
    """Return a bit for each of `count` nodes from `at` on: whether it has data."""
    bits = low_bits(count)
    if levels.checks_finite == 1:
        bits = finite_bits(values, kind, at, count)
    if levels.checks_padding == 1:
        padding = bits_at_least(values, kind, at, count, levels.padding) & levels.padding_mask
        after = bits_at_least(values, kind, at, count, levels.after_padding) & levels.after_padding_mask
        bits &= ~padding | after
    return bits


@wp.func
def counted(bits: wp.uint32, data: wp.uint32, levels: Levels) -> wp.uint32:
    """Return inside bits from comparison bits: nodes without data are outside the object."""
    return ((bits ^ levels.inverted) & data) | (levels.outside & ~data)


@wp.func
def fill_row(inside_out: wp.array2d(dtype=wp.uint32), grid: Grid, row: wp.int32, bits: wp.uint32) -> None:
    """Write a row of virtual nodes."""
    for w in range(grid.words):
        inside_out[row, w] = bits & low_bits(grid.nx - w * WORD)


@wp.func
def settle_row(
    inside_inout: wp.array2d(dtype=wp.uint32),
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    levels: Levels,
    row: wp.int32,
    start: wp.int64,
    nx: wp.int32,
    looks_for_data: wp.bool,
) -> wp.int32:
    """Turn a row's comparison bits into inside bits; return how many of its nodes are without data."""
    missing = int(0)
    for w in range((nx + WORD - 1) / WORD):
        count = wp.min(WORD, nx - WORD * w)
        data = low_bits(count)
        if looks_for_data:
            data = nodes_with_data(values, kind, start + wp.int64(WORD * w), count, levels)
            missing += count - wp.int32(wp.bit_count(data))
        inside_inout[row, w] = counted(inside_inout[row, w] & levels.cut_mask, data, levels)
    return missing


@wp.func
def add_border(
    inside_inout: wp.array2d(dtype=wp.uint32), grid: Grid, levels: Levels, row: wp.int32, done: wp.int32
) -> None:
    """Move a row's bits up by one, past the virtual node before the first; `done` words have been written."""
    for n in range(grid.words):
        w = grid.words - 1 - n
        bits = levels.outside  # the virtual node after the last one may have a word of its own
        if w < done:
            bits = inside_inout[row, w]
        before = levels.outside
        if w > 0:
            before = inside_inout[row, w - 1]
        inside_inout[row, w] = previous_node(bits, before) & low_bits(grid.nx - WORD * w)


@wp.func
def find_row(
    grid: Grid,
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    levels: Levels,
    row: wp.int32,
    inside_out: wp.array2d(dtype=wp.uint32),
) -> wp.int32:
    """Write the inside bits of a row of the grid; return how many of its nodes are without data."""
    place = row_place(grid, row)
    j = place[0]
    k = place[1]
    b = grid.border
    if b == 1 and (j == 0 or j == grid.ny - 1 or k == 0 or k == grid.nz - 1):
        fill_row(inside_out, grid, row, levels.outside)
        return 0
    nx = grid.nx - 2 * b
    start = node_of_volume(grid, 0, j - b, k - b)
    is_finite = compare_row(values, kind, start, nx, levels.cut, inside_out, row)
    looks_for_data = levels.checks_padding == 1 or not is_finite
    missing = int(0)
    if looks_for_data or b == 1 or levels.settles == 1:
        missing = settle_row(inside_out, values, kind, levels, row, start, nx, looks_for_data)
    if b == 1:
        add_border(inside_out, grid, levels, row, (nx + WORD - 1) / WORD)
    return missing


@wp.kernel
def find_inside_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    levels: Levels,
    # Out:
    inside_out: wp.array2d(dtype=wp.uint32),
    nodata_out: wp.array(dtype=wp.int64),
) -> None:
    """Find the inside bits and count the nodes without data if asked to. One thread a row of the grid."""
    row = first + wp.tid()
    missing = find_row(grid, values, kind, levels, row, inside_out)
    if nodata_out.shape[0] > 0:
        nodata_out[row] = wp.int64(missing)


@wp.kernel
def find_data_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    levels: Levels,
    # Out:
    data_out: wp.array2d(dtype=wp.uint32),
) -> None:
    """Find the bits of the nodes with data, for an open border. One thread a row."""
    row = first + wp.tid()
    start = wp.int64(row) * wp.int64(grid.nx)
    for w in range(grid.words):
        count = wp.min(WORD, grid.nx - WORD * w)
        data_out[row, w] = nodes_with_data(values, kind, start + wp.int64(WORD * w), count, levels)
