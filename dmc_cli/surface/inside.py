"""Inside bits: the one pass over the stored values.

A node is inside if its physical value is at or above the isovalue: one bit a node, 32 nodes a word.
Everything about which cells and edges the surface crosses follows from these bits alone. The values are
read as vectors of 32, so that the compiler turns the comparison of a word into a few instructions.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.surface.field import (
    FIELD_ARRAYS,
    FLOAT32,
    INT8,
    INT16,
    INT32,
    UINT8,
    UINT16,
    UINT32,
    DeviceVolume,
    Field,
    stored_value,
)
from dmc_cli.surface.grid import ALL_BITS, Grid, GridShape, low_bits

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

WORD = 32
"""Nodes a word."""

LARGEST_FLOAT32 = wp.float32(np.finfo(np.float32).max)
LARGEST_FLOAT64 = wp.float64(np.finfo(np.float64).max)

U8x32 = wp.types.vector(length=WORD, dtype=wp.uint8)
I8x32 = wp.types.vector(length=WORD, dtype=wp.int8)
U16x32 = wp.types.vector(length=WORD, dtype=wp.uint16)
I16x32 = wp.types.vector(length=WORD, dtype=wp.int16)
U32x32 = wp.types.vector(length=WORD, dtype=wp.uint32)
I32x32 = wp.types.vector(length=WORD, dtype=wp.int32)
F32x32 = wp.types.vector(length=WORD, dtype=wp.float32)
F64x32 = wp.types.vector(length=WORD, dtype=wp.float64)

CHUNK_TYPES = (U8x32, I8x32, U16x32, I16x32, U32x32, I32x32, F32x32, F64x32)
"""A word's values, in the order of the tag `kind`."""


@wp.struct
class Chunks:
    """The stored values [row, chunk of 32 nodes]; one of the arrays is set, `kind` says which."""

    kind: wp.int32
    count: wp.int32  # whole chunks a row
    u8: wp.array2d(dtype=U8x32)
    i8: wp.array2d(dtype=I8x32)
    u16: wp.array2d(dtype=U16x32)
    i16: wp.array2d(dtype=I16x32)
    u32: wp.array2d(dtype=U32x32)
    i32: wp.array2d(dtype=I32x32)
    f32: wp.array2d(dtype=F32x32)
    f64: wp.array2d(dtype=F64x32)


@wp.struct
class Threshold:
    """A stored value to compare with: nodes at or above it. `mask` is 0 where no value of the type is."""

    as_int: wp.int64
    as_float: wp.float64
    mask: wp.uint32


@wp.struct
class Levels:
    """What the bits of a node depend on.

    A node has data if it is finite, and not at or above `padding` without being at or above
    `after_padding`. It is inside if it is at or above `cut`, or for a negative slope (`inverted` all ones)
    if it is not.
    """

    cut: Threshold
    inverted: wp.uint32
    checks_finite: wp.int32
    checks_padding: wp.int32
    padding: Threshold
    after_padding: Threshold
    outside: wp.uint32  # all ones where virtual and absent nodes count as inside: the object is the low side


@dataclass(frozen=True)
class InsideBits:
    """One bit a node.

    Attributes:
        inside: Whether the node is at or above the isovalue, uint32 [row, word].
        data: Whether the node has data, likewise; None where all nodes count as data: no node is without,
            or the border is closed.
        no_data_count: Number of the volume's nodes without data.
    """

    inside: Any
    data: Any | None
    no_data_count: int


def find_inside(volume: DeviceVolume, field: Any, grid: GridShape) -> InsideBits:
    """Return one bit a node: whether it is inside.

    Args:
        volume: Stored values on the device.
        field: The `Field` to cut at zero.
        grid: The grid over the volume.
    """
    device = volume.device
    chunks = _chunks(volume)
    levels = _levels(volume, field)
    inside = device.empty((grid.rows, grid.words), wp.uint32)
    absent = device.empty(grid.rows, wp.int64)
    inputs = [grid.struct(), chunks, field, levels]
    device.launch(find_inside_kernel, grid.rows, inputs, [inside, absent])
    no_data_count = device.total(absent) if levels.checks_finite or levels.checks_padding else 0
    if no_data_count == 0 or grid.border == 1:
        return InsideBits(inside, None, no_data_count)
    data = device.empty((grid.rows, grid.words), wp.uint32)
    device.launch(find_data_kernel, grid.rows, inputs, [data])
    return InsideBits(inside, data, no_data_count)


def _chunks(volume: DeviceVolume) -> Any:
    """Return the values seen as vectors of 32 nodes; a row's tail stays out."""
    rows, nx = volume.values.shape
    itemsize = wp.types.type_size_in_bytes(volume.values.dtype)
    chunks = Chunks()
    chunks.kind = volume.kind
    chunks.count = nx // WORD
    view = wp.array(
        ptr=volume.values.ptr,
        dtype=CHUNK_TYPES[chunks.kind],
        shape=(rows, chunks.count),
        strides=(nx * itemsize, WORD * itemsize),
        device=volume.device.name,
        copy=False,
    )
    setattr(chunks, FIELD_ARRAYS[chunks.kind], view)
    return chunks


def _levels(volume: DeviceVolume, field: Any) -> Any:
    """Return the thresholds between the kinds of nodes."""
    dtype = volume.dtype
    levels = Levels()
    negative = field.sign < 0
    levels.cut = _threshold(dtype, _above(dtype, field.isovalue) if negative else field.isovalue)
    levels.inverted = 0xFFFFFFFF if negative else 0
    levels.outside = 0xFFFFFFFF if field.outside > 0 else 0
    levels.checks_finite = int(dtype.kind == "f")
    levels.checks_padding = int(field.padding_low <= field.padding_high)
    levels.padding = _threshold(dtype, field.padding_low)
    levels.after_padding = _threshold(dtype, _above(dtype, field.padding_high))
    return levels


def _above(dtype: np.dtype[Any], value: float) -> float:
    """Return the least value of the type above `value`."""
    if dtype.kind == "f":
        return float(np.nextafter(dtype.type(value), dtype.type(math.inf)))
    return math.floor(value) + 1


def _threshold(dtype: np.dtype[Any], value: float) -> Any:
    """Return `value` as a threshold for stored values of the type."""
    threshold = Threshold()
    threshold.mask = 0xFFFFFFFF
    if dtype.kind == "f":
        threshold.as_float = value
        return threshold
    limits = np.iinfo(dtype)
    least = math.ceil(value)
    threshold.as_int = min(max(least, int(limits.min)), int(limits.max))
    if least > limits.max:
        threshold.mask = 0
    return threshold


@wp.func
def bits_at_least(values: Any, threshold: Any) -> wp.uint32:
    """Return a bit for each of 32 values: whether it is at or above the threshold."""
    bits = wp.uint32(0)
    for b in range(WORD):
        bits |= wp.where(values[b] >= threshold, wp.uint32(1), wp.uint32(0)) << wp.uint32(b)
    return bits


@wp.func
def finite_bits(values: Any, largest: Any) -> wp.uint32:
    """Return a bit for each of 32 floating-point values: whether it is finite."""
    bits = wp.uint32(0)
    for b in range(WORD):
        bits |= wp.where(wp.abs(values[b]) <= largest, wp.uint32(1), wp.uint32(0)) << wp.uint32(b)
    return bits


@wp.func
def chunk_at_least(chunks: Chunks, row: wp.int32, chunk: wp.int32, threshold: Threshold) -> wp.uint32:
    """Return a bit for each node of a chunk: whether its stored value is at or above the threshold."""
    bits = wp.uint32(0)
    if chunks.kind == INT16:
        bits = bits_at_least(chunks.i16[row, chunk], wp.int16(threshold.as_int))
    elif chunks.kind == UINT8:
        bits = bits_at_least(chunks.u8[row, chunk], wp.uint8(threshold.as_int))
    elif chunks.kind == FLOAT32:
        bits = bits_at_least(chunks.f32[row, chunk], wp.float32(threshold.as_float))
    elif chunks.kind == UINT16:
        bits = bits_at_least(chunks.u16[row, chunk], wp.uint16(threshold.as_int))
    elif chunks.kind == INT8:
        bits = bits_at_least(chunks.i8[row, chunk], wp.int8(threshold.as_int))
    elif chunks.kind == INT32:
        bits = bits_at_least(chunks.i32[row, chunk], wp.int32(threshold.as_int))
    elif chunks.kind == UINT32:
        bits = bits_at_least(chunks.u32[row, chunk], wp.uint32(threshold.as_int))
    else:
        bits = bits_at_least(chunks.f64[row, chunk], threshold.as_float)
    return bits & threshold.mask


@wp.func
def tail_at_least(
    field: Field, row: wp.int32, first: wp.int32, count: wp.int32, threshold: Threshold
) -> wp.uint32:
    """Return the same bits for the `count` nodes from `first` on, at the end of a row."""
    level = threshold.as_float
    if field.kind < FLOAT32:
        level = wp.float64(threshold.as_int)  # exact: stored integers have at most 32 bits
    bits = wp.uint32(0)
    for b in range(count):
        if stored_value(field, row, first + b) >= level:
            bits |= wp.uint32(1) << wp.uint32(b)
    return bits & threshold.mask


@wp.func
def tail_finite(field: Field, row: wp.int32, first: wp.int32, count: wp.int32) -> wp.uint32:
    """Return a bit for each of the `count` nodes from `first` on: whether its value is finite."""
    bits = wp.uint32(0)
    for b in range(count):
        if wp.isfinite(stored_value(field, row, first + b)):
            bits |= wp.uint32(1) << wp.uint32(b)
    return bits


@wp.func
def chunk_data(chunks: Chunks, row: wp.int32, chunk: wp.int32, levels: Levels) -> wp.uint32:
    """Return a bit for each node of a chunk: whether it has data."""
    bits = ALL_BITS
    if levels.checks_finite == 1:
        if chunks.kind == FLOAT32:
            bits = finite_bits(chunks.f32[row, chunk], LARGEST_FLOAT32)
        else:
            bits = finite_bits(chunks.f64[row, chunk], LARGEST_FLOAT64)
    if levels.checks_padding == 1:
        padding = chunk_at_least(chunks, row, chunk, levels.padding)
        bits &= ~padding | chunk_at_least(chunks, row, chunk, levels.after_padding)
    return bits


@wp.func
def tail_data(field: Field, row: wp.int32, first: wp.int32, count: wp.int32, levels: Levels) -> wp.uint32:
    """Return the same bits for the `count` nodes from `first` on, at the end of a row."""
    bits = low_bits(count)
    if levels.checks_finite == 1:
        bits &= tail_finite(field, row, first, count)
    if levels.checks_padding == 1:
        padding = tail_at_least(field, row, first, count, levels.padding)
        bits &= ~padding | tail_at_least(field, row, first, count, levels.after_padding)
    return bits


@wp.func
def counted(bits: wp.uint32, data: wp.uint32, levels: Levels) -> wp.uint32:
    """Return inside bits from comparison bits: nodes without data are outside the object."""
    return ((bits ^ levels.inverted) & data) | (levels.outside & ~data)


@wp.func
def fill_row(
    inside_out: wp.array2d(dtype=wp.uint32), grid: Grid, row: wp.int32, first: wp.int32, bits: wp.uint32
):
    """Write the words of a row from `first` on, as far as it has nodes."""
    for w in range(first, grid.words):
        inside_out[row, w] = bits & low_bits(grid.nx - w * WORD)


@wp.kernel
def find_inside_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    chunks: Chunks,
    field: Field,
    levels: Levels,
    # Out:
    inside_out: wp.array2d(dtype=wp.uint32),
    absent_out: wp.array(dtype=wp.int64),
):
    """Find the inside bits and count the nodes without data. One thread a row of the grid.

    Under a closed border the row's bits move up by one, past the virtual node before the first.
    """
    row = first + wp.tid()
    j = row % grid.ny
    k = row // grid.ny
    b = grid.border
    if b == 1 and (j == 0 or j == grid.ny - 1 or k == 0 or k == grid.nz - 1):
        fill_row(inside_out, grid, row, 0, levels.outside)
        absent_out[row] = wp.int64(0)
        return
    nx = grid.nx - 2 * b
    source = j - b + (grid.ny - 2 * b) * (k - b)
    up = wp.uint32(b)
    down = wp.uint32(31)  # what moves from one word to the next; nothing without a border
    carried = wp.where(b == 1, levels.outside, wp.uint32(0))
    absent = wp.int32(0)
    checks = levels.checks_finite + levels.checks_padding
    for w in range(chunks.count):
        bits = chunk_at_least(chunks, source, w, levels.cut)
        data = ALL_BITS
        if checks > 0:
            data = chunk_data(chunks, source, w, levels)
            absent += WORD - wp.int32(wp.bit_count(data))
        bits = counted(bits, data, levels)
        inside_out[row, w] = (bits << up) | ((carried >> down) & up)
        carried = bits
    done = chunks.count
    rest = nx - done * WORD
    if rest > 0:
        start = done * WORD
        data = tail_data(field, source, start, rest, levels)
        absent += rest - wp.int32(wp.bit_count(data))
        bits = counted(tail_at_least(field, source, start, rest, levels.cut), data, levels)
        inside_out[row, done] = ((bits << up) | ((carried >> down) & up)) & low_bits(grid.nx - start)
        carried = bits
        done += 1
    if done < grid.words:  # the virtual node after the last one, in a word of its own
        bits = (levels.outside << up) | ((carried >> down) & up)
        fill_row(inside_out, grid, row, done, bits)
    absent_out[row] = wp.int64(absent)


@wp.kernel
def find_data_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    chunks: Chunks,
    field: Field,
    levels: Levels,
    # Out:
    data_out: wp.array2d(dtype=wp.uint32),
):
    """Find the bits of the nodes with data, for an open border. One thread a row."""
    row = first + wp.tid()
    for w in range(chunks.count):
        data_out[row, w] = chunk_data(chunks, row, w, levels)
    rest = grid.nx - chunks.count * WORD
    if rest > 0:
        data_out[row, chunks.count] = tail_data(field, row, chunks.count * WORD, rest, levels)
