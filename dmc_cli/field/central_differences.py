"""Compute slopes of the stored values in a cell: central differences at its corners, interpolated.

Of the nodes round a cell they take the four in each of twelve rows: of its own four rows, and the middle two
of the eight rows beside those. Sixteen cells at a time read each row once.
"""

import warp as wp

from dmc_cli.bits import LANES
from dmc_cli.field.field import Field
from dmc_cli.field.grid import Grid
from dmc_cli.field.sample_reader import DoubleLanes, IntLanes, RowLanes, rows_at
from dmc_cli.field.simd_cells import FloatLanes, PointLanes


@wp.func
def mixed(
    a: wp.float64, b: wp.float64, c: wp.float64, d: wp.float64, s: wp.float64, t: wp.float64
) -> wp.float64:
    """Interpolate between the corners low low, high low, low high, high high of a square, at (s, t)."""
    low = a + s * (b - a)
    high = c + s * (d - c)
    return low + t * (high - low)


@wp.func
def difference(
    before: wp.float64, at_0: wp.float64, at_1: wp.float64, after: wp.float64, t: wp.float64
) -> wp.float32:
    """Interpolate between the central differences at positions 0 and 1, t of the way."""
    low = at_1 - before
    high = after - at_0
    return wp.float32(wp.float64(0.5) * (low + t * (high - low)))


@wp.func
def mixed_x(
    a: RowLanes, b: RowLanes, c: RowLanes, d: RowLanes, n: wp.int32, s: FloatLanes, t: FloatLanes
) -> DoubleLanes:
    """Return `mixed` of the n-th values of four rows."""
    lanes = DoubleLanes()
    for lane in range(LANES):
        m = n * LANES + lane
        lanes[lane] = mixed(a[m], b[m], c[m], d[m], wp.float64(s[lane]), wp.float64(t[lane]))
    return lanes


@wp.func
def mixed_pairs(a: RowLanes, b: RowLanes, s: FloatLanes, t: FloatLanes) -> DoubleLanes:
    """Return `mixed` of the middle values of two rows."""
    lanes = DoubleLanes()
    for lane in range(LANES):
        m = LANES + lane
        n = 2 * LANES + lane
        lanes[lane] = mixed(a[m], a[n], b[m], b[n], wp.float64(s[lane]), wp.float64(t[lane]))
    return lanes


@wp.func
def difference_lanes(
    before: DoubleLanes, at_0: DoubleLanes, at_1: DoubleLanes, after: DoubleLanes, t: FloatLanes
) -> FloatLanes:
    """Return `difference` of the sixteen lanes."""
    lanes = FloatLanes()
    for lane in range(LANES):
        lanes[lane] = difference(before[lane], at_0[lane], at_1[lane], after[lane], wp.float64(t[lane]))
    return lanes


@wp.func
def slopes_in_lanes(
    field: Field, grid: Grid, node: wp.int64, offsets: IntLanes, u: FloatLanes, v: FloatLanes, w: FloatLanes
) -> PointLanes:
    """Return the slopes at (u, v, w) of the cells at `node` + `offsets`, which have neighbours all round."""
    y = wp.int64(grid.nx - 2 * grid.border)
    z = y * wp.int64(grid.ny - 2 * grid.border)
    at = node - wp.int64(1)
    row00 = rows_at(field.values, field.kind, at, offsets)
    row10 = rows_at(field.values, field.kind, at + y, offsets)
    row01 = rows_at(field.values, field.kind, at + z, offsets)
    row11 = rows_at(field.values, field.kind, at + y + z, offsets)
    along_x = difference_lanes(
        mixed_x(row00, row10, row01, row11, 0, v, w),
        mixed_x(row00, row10, row01, row11, 1, v, w),
        mixed_x(row00, row10, row01, row11, 2, v, w),
        mixed_x(row00, row10, row01, row11, 3, v, w),
        u,
    )
    before0 = rows_at(field.values, field.kind, at - y, offsets)
    before1 = rows_at(field.values, field.kind, at - y + z, offsets)
    after0 = rows_at(field.values, field.kind, at + y + y, offsets)
    after1 = rows_at(field.values, field.kind, at + y + y + z, offsets)
    along_y = difference_lanes(
        mixed_pairs(before0, before1, u, w),
        mixed_pairs(row00, row01, u, w),
        mixed_pairs(row10, row11, u, w),
        mixed_pairs(after0, after1, u, w),
        v,
    )
    below0 = rows_at(field.values, field.kind, at - z, offsets)
    below1 = rows_at(field.values, field.kind, at - z + y, offsets)
    above0 = rows_at(field.values, field.kind, at + z + z, offsets)
    above1 = rows_at(field.values, field.kind, at + z + z + y, offsets)
    along_z = difference_lanes(
        mixed_pairs(below0, below1, u, v),
        mixed_pairs(row00, row10, u, v),
        mixed_pairs(row01, row11, u, v),
        mixed_pairs(above0, above1, u, v),
        w,
    )
    slopes = PointLanes()
    for lane in range(LANES):
        slopes[lane] = along_x[lane]
        slopes[LANES + lane] = along_y[lane]
        slopes[2 * LANES + lane] = along_z[lane]
    return slopes
