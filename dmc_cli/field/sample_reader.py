"""Read stored values of any type: the few functions that touch the volume.

The values are an array of bytes and a tag that says which type they are. Each reader is one loop in C++ that
is compiled for every type, so that no other code depends on the type, and so that the compiler finds the
vector instructions that loops over Warp's arrays, whose strides it does not know, do not give: reading the
volume is twice to six times as fast.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import LANES
from dmc_cli.field.trilinear import CornerValues64
from dmc_cli.runtime import native

STORED_TYPES: dict[str, Any] = {
    "uint8": wp.uint8,
    "int8": wp.int8,
    "uint16": wp.uint16,
    "int16": wp.int16,
    "uint32": wp.uint32,
    "int32": wp.int32,
    "float32": wp.float32,
    "float64": wp.float64,
}
"""The value types that kernels read; the order is the tag `kind`."""

KINDS = {name: kind for kind, name in enumerate(STORED_TYPES)}

IntLanes = wp.types.vector(length=LANES, dtype=wp.int32)
DoubleLanes = wp.types.vector(length=LANES, dtype=wp.float64)

AxisOffsets = wp.types.vector(length=4, dtype=wp.int64)
"""How many nodes lie before each of four layers across an axis."""

CubeValues = wp.types.vector(length=64, dtype=wp.float64)
"""Values at the nodes round a cell, four along each axis, x fastest."""

PairLanes = wp.types.vector(length=2 * LANES, dtype=wp.float64)
"""Two values in a row for each lane: the first ones, then the second ones."""

RowLanes = wp.types.vector(length=4 * LANES, dtype=wp.float64)
"""Four values in a row for each lane: the first ones, then the second ones."""


@wp.func_native(native(__file__, "value_at"))
def value_at(values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64) -> wp.float64:
    """Return the stored value of node `at` of the volume, x fastest."""
    ...


@wp.func_native(native(__file__, "cell_at"))
def cell_at(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, row: wp.int64, layer: wp.int64
) -> CornerValues64:
    """Return the stored values of the cell at node `at`; a row and a layer have that many nodes."""
    ...


@wp.func_native(native(__file__, "cube_at"))
def cube_at(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, x: AxisOffsets, y: AxisOffsets, z: AxisOffsets
) -> CubeValues:
    """Return the stored values of the nodes, x fastest, in four layers across each axis."""
    ...


@wp.func_native(native(__file__, "read_rows", LENGTH=2, MOST=4))
def pairs_at(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, offsets: IntLanes
) -> PairLanes:
    """Return two values of a row from each of the nodes `offsets` after node `at` on.

    To take two floats from a word costs more than to read both.
    """
    ...


@wp.func_native(native(__file__, "read_rows", LENGTH=4, MOST=8))
def rows_at(values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, offsets: IntLanes) -> RowLanes:
    """Return four values of a row from each of the nodes `offsets` after node `at` on."""
    ...


@wp.func_native(native(__file__, "bits_at_least"))
def bits_at_least(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, count: wp.int32, threshold: wp.float64
) -> wp.uint32:
    """Return a bit for each of `count` nodes, 32 at most, from `at` on: whether it is at or above a number.

    The number is one of the values' type.
    """
    ...


@wp.func_native(native(__file__, "finite_bits"))
def finite_bits(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, count: wp.int32
) -> wp.uint32:
    """Return a bit for each of `count` nodes, 32 at most, from `at` on: whether it is finite."""
    ...


@wp.func_native(native(__file__, "compare_row"))
def compare_row(
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    at: wp.int64,
    count: wp.int32,
    threshold: wp.float64,
    out: wp.array2d(dtype=wp.uint32),
    row: wp.int32,
) -> wp.bool:
    """Write a bit for each of `count` nodes from `at` on to a row of words: is it at or above a number?

    Return whether all values are finite: times 0 all others are 0. This is the loop that reads every node.
    With clang's vectors a word takes a comparison or two, and memory sets the speed: asking for it a page
    ahead, which processors do not do by themselves, gives a third to a half more.
    """
    ...


@wp.func_native(native(__file__, "prefetch_cell"))
def prefetch_cell(
    values: wp.array2d(dtype=wp.uint8), kind: wp.int32, at: wp.int64, row: wp.int64, layer: wp.int64
) -> None:
    """Ask memory for the values of the cell at node `at`; a row and a layer have that many nodes."""
    ...
