"""Classify nodes at several isovalues, reading again only what an isovalue crosses.

The first pass over the values keeps the ranges of bricks (`field/brick_ranges.py`) and which nodes have data;
later ones look at the ranges first. Where too many bricks are crossed they read everything, which is faster.
"""

import math
from typing import Any

import warp as wp

from dmc_cli.bits import VECTOR_FLAGS, low_bits
from dmc_cli.contouring.stages.classification import (
    NODES_A_CHUNK,
    WORD,
    Levels,
    add_border,
    count_missing,
    counted,
    fill_row,
    find_inside_kernel,
    find_row,
    nodes_with_data,
)
from dmc_cli.field import (
    DeviceVolume,
    Grid,
    GridShape,
    NodeSteps,
    Plane,
    bricks_begin,
    bricks_end,
    compare_bricks,
    make_brick_ranges,
    node_of_volume,
    widen_ranges,
)

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

INFINITE = wp.constant(wp.float64(math.inf))

MOST_CROSSED = 0.2
"""Share of bricks that are crossed beyond which all values are read at once."""


def find_inside_by_index(
    volume: DeviceVolume, levels: Any, grid: GridShape, inside: Plane, missing: Any
) -> int:
    """Begin to find the inside bits; return the number of nodes without data.

    Args:
        volume: Stored values with an index, which the first call makes.
        levels: The kernels' `Levels`.
        grid: The grid over the volume.
        inside: Where the bits go; they are there for the next launch.
        missing: Room for the number of nodes without data of each row of the grid, or for none.
    """
    device, index = volume.device, volume.index
    assert index is not None
    inputs = [grid.struct(), volume.bytes, volume.kind, levels]
    least = -(-NODES_A_CHUNK // grid.nx)  # rows of nodes a chunk
    if index.ranges is None:
        ranges = make_brick_ranges(volume.volume.shape, device)
        outputs = [inside.rows, missing, ranges.low, ranges.high]
        device.begin(find_inside_and_ranges_kernel, ranges.low.shape[0], inputs, outputs, -(-least // 64))
        index.ranges, index.no_data_count = ranges, count_missing(missing, device)
    elif index.ranges.crossed_share(levels.cut) > MOST_CROSSED:
        device.begin(find_inside_kernel, grid.rows, inputs, [inside.rows, missing], least)
    else:
        ranges = index.ranges
        inputs += [int(index.no_data_count > 0), ranges.low, ranges.high]
        device.begin(find_inside_by_ranges_kernel, ranges.low.shape[0], inputs, [inside.rows], 4)
    return index.no_data_count


@wp.func
def is_virtual(grid: Grid, j: wp.int32, k: wp.int32) -> wp.bool:
    """Return whether row (j, k) of the volume is one of the closed border's."""
    return j < 0 or k < 0 or j == grid.ny - 2 * grid.border or k == grid.nz - 2 * grid.border


@wp.func
def rows_of_bricks(begin: wp.int32, end: wp.int32, count: wp.int32, border: wp.int32) -> wp.vec2i:
    """Return where the rows of bricks begin and end along y or z, the border's beside them counted in."""
    return wp.vec2i(wp.where(begin == 0, -border, begin), wp.where(end == count, count + border, end))


@wp.kernel
def find_inside_and_ranges_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    levels: Levels,
    # Out:
    inside_out: wp.array2d(dtype=wp.uint32),
    nodata_out: wp.array(dtype=wp.int64),
    low_out: wp.array2d(dtype=wp.float64),
    high_out: wp.array2d(dtype=wp.float64),
) -> None:
    """Find the inside bits, the nodes without data and the ranges. One thread a row of bricks."""
    bricks = first + wp.tid()
    b = grid.border
    begin = bricks_begin(grid, bricks)
    ny = grid.ny - 2 * b
    nz = grid.nz - 2 * b
    rows = rows_of_bricks(begin[0], bricks_end(begin[0], ny), ny, b)
    layers = rows_of_bricks(begin[1], bricks_end(begin[1], nz), nz, b)
    for k in range(layers[0], layers[1]):
        for j in range(rows[0], rows[1]):
            row = (k + b) * grid.ny + j + b
            missing = find_row(grid, values, kind, levels, row, inside_out)
            if nodata_out.shape[0] > 0:
                nodata_out[row] = wp.int64(missing)
            if not is_virtual(grid, j, k):
                start = node_of_volume(grid, 0, j, k)
                is_first = j == begin[0] and k == begin[1]
                widen_ranges(values, kind, start, grid.nx - 2 * b, is_first, low_out, high_out, bricks)


@wp.func
def settle_by_ranges(
    inside_inout: wp.array2d(dtype=wp.uint32),
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    levels: Levels,
    low: wp.array2d(dtype=wp.float64),
    high: wp.array2d(dtype=wp.float64),
    bricks: wp.int32,
    row: wp.int32,
    start: wp.int64,
    nx: wp.int32,
) -> None:
    """Turn a row's comparison bits into inside bits, reading only where data may be missing."""
    for w in range((nx + WORD - 1) / WORD):
        count = wp.min(WORD, nx - WORD * w)
        least = low[bricks, w]
        greatest = high[bricks, w]
        may_lack = levels.checks_finite == 1 and least == -INFINITE and greatest == INFINITE
        if levels.checks_padding == 1:
            may_lack = may_lack or (greatest >= levels.padding and least < levels.after_padding)
        data = low_bits(count)
        if may_lack:
            data = nodes_with_data(values, kind, start + wp.int64(WORD * w), count, levels)
        inside_inout[row, w] = counted(inside_inout[row, w] & levels.cut_mask, data, levels)


@wp.kernel
def find_inside_by_ranges_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    levels: Levels,
    lacks_data: wp.int32,
    low: wp.array2d(dtype=wp.float64),
    high: wp.array2d(dtype=wp.float64),
    # Out:
    inside_out: wp.array2d(dtype=wp.uint32),
) -> None:
    """Find the inside bits, reading only nodes of bricks that are crossed. One thread a row of bricks."""
    bricks = first + wp.tid()
    b = grid.border
    begin = bricks_begin(grid, bricks)
    nx = grid.nx - 2 * b
    ny = grid.ny - 2 * b
    nz = grid.nz - 2 * b
    end = wp.vec2i(bricks_end(begin[0], ny), bricks_end(begin[1], nz))
    size = wp.vec3i(nx, end[0] - begin[0], end[1] - begin[1])
    step = NodeSteps(wp.int64(nx), wp.int64(nx) * wp.int64(ny))
    start = node_of_volume(grid, 0, begin[0], begin[1])
    row = (begin[1] + b) * grid.ny + begin[0] + b
    compare_bricks(values, kind, start, size, step, levels.cut, low, high, bricks, inside_out, row, grid.ny)
    if lacks_data == 0 and b == 0 and levels.settles == 0:
        return
    rows = rows_of_bricks(begin[0], end[0], ny, b)
    layers = rows_of_bricks(begin[1], end[1], nz, b)
    for k in range(layers[0], layers[1]):
        for j in range(rows[0], rows[1]):
            row = (k + b) * grid.ny + j + b
            if is_virtual(grid, j, k):
                fill_row(inside_out, grid, row, levels.outside)
            else:
                start = node_of_volume(grid, 0, j, k)
                settle_by_ranges(inside_out, values, kind, levels, low, high, bricks, row, start, nx)
                if b == 1:
                    add_border(inside_out, grid, levels, row, (nx + WORD - 1) / WORD)
