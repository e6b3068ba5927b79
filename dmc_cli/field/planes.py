"""Store one bit per node or cell of the grid, the words of all rows in one line.

Neighbours along y and z are at fixed distances in the line: `words` and `layer` of the grid. There is no test
for the ends of rows and layers: a cell beyond them does not exist and is never active, so no edge beside it
has a quad; beyond both ends of the line lie zeros.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.bits import LANES, Words
from dmc_cli.field.grid import Grid, GridShape, row_place
from dmc_cli.runtime import Device, view

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


BLOCKS_A_CHUNK = 16


BITS_A_CHUNK = 64
"""Blocks a chunk at least, and blocks of which only bits are looked at, as `ITEMS_A_CHUNK` of the device."""


@dataclass(frozen=True)
class Plane:
    """One bit per node, or per cell, seen in two ways.

    Attributes:
        rows: uint32 [row, word].
        line: `Words` [n]: words n - `padding` to n - `padding` + 15 of the line, which overlap from n to n.
    """

    rows: Any
    line: Any


def padding(grid: GridShape) -> int:
    """Return the words of zeros before the line, and after it: as far as neighbours are looked for."""
    return -(-(grid.layer + grid.words + 1) // LANES) * LANES


def block_count(grid: GridShape) -> int:
    """Return the blocks of the line; the last one may reach beyond its end."""
    return -(-grid.rows * grid.words // LANES)


def make_plane(grid: GridShape, device: Device) -> Plane:
    """Return a plane without values; the zeros round it are there."""
    count = grid.rows * grid.words
    ahead, behind = padding(grid), padding(grid) + 2 * LANES
    memory = device.empty(ahead + count + behind, wp.uint32)
    device.clear_around(memory, ahead, ahead + count)
    line = view(memory, Words, ahead + count + behind - LANES + 1, step=4)
    rows = view(memory, wp.uint32, (grid.rows, grid.words), skipped=4 * ahead)
    return Plane(rows, line)


@wp.func
def before_line(grid: Grid) -> wp.int32:
    """Return `padding`, for kernels."""
    return (grid.layer + grid.words + LANES) / LANES * LANES


@wp.func
def position_of(grid: Grid, n: wp.int32) -> wp.vec3i:
    """Return w, j and k of word n of the line."""
    row = n / grid.words
    place = row_place(grid, row)
    return wp.vec3i(n - row * grid.words, place[0], place[1])


@wp.func
def step_along(grid: Grid, start: wp.vec3i, lane: wp.int32) -> wp.vec3i:
    """Return w, j and k of the word `lane` words after another one."""
    w = start[0] + lane
    rows = quotient(w, grid.words)
    j = start[1] + rows
    layers = quotient(j, grid.ny)
    return wp.vec3i(w - rows * grid.words, j - layers * grid.ny, start[2] + layers)


@wp.func
def quotient(a: wp.int32, b: wp.int32) -> wp.int32:
    """Return a / b, where a is below b + `LANES`, without a division of integers, which has no vectors.

    Where the float counts, its numbers are small and half a unit clear of the next integer.
    """
    several = wp.int32((wp.float32(a) + 0.5) / wp.float32(b))
    one = wp.where(a >= b, 1, 0)
    return wp.where(b > LANES, one, several)
