"""Sum the planes that touch the surface at a cell's crossings, about their mean.

A plane is a crossing and its unit normal: the gradients at the ends of the edge, interpolated. What is summed
gives the point of the least sum of squared distances from the planes (Ju et al. 2002; equation 1 of Schmitz
et al. 2009), and the force that draws a particle there (their equation 2).
"""

import warp as wp

from dmc_cli.bits import LANES
from dmc_cli.contouring.dual_contouring.corner_gradients import CellLanes, CornerGradients
from dmc_cli.contouring.dual_contouring.symmetric_matrix import Planes
from dmc_cli.field import EDGES, CornerValues, FloatLanes

Vec12 = wp.types.vector(length=12, dtype=wp.int32)

EdgeLanes = wp.types.vector(length=12 * LANES, dtype=wp.float32)

PlaneLanes = wp.types.vector(length=9 * LANES, dtype=wp.float32)
"""`Planes` of sixteen cells: entry after entry."""

EDGE_LOW = wp.constant(Vec12(*(low for low, _ in EDGES)))
EDGE_HIGH = wp.constant(Vec12(*(high for _, high in EDGES)))
"""The corners of each edge."""

X, Y, Z = wp.constant(8 * LANES), wp.constant(16 * LANES), wp.constant(24 * LANES)
"""Where the derivatives along x, y and z begin in `CellLanes`."""

CANCELLED = wp.constant(1.0e-12)
"""A gradient's square, as a share of that at an end of its edge, that is nothing but the rounding of both."""

LEAST_SQUARE, LARGEST_SQUARE = wp.constant(2.0**-126), wp.constant(3.0e38)
"""Between these a square is a float32 number with all its digits."""


@wp.struct
class SummedPlanes:
    """The mean of a cell's crossings, the planes there, and whether a gradient left single precision (1)."""

    mean: wp.vec3
    sums: Planes
    out: wp.int32


@wp.struct
class SummedLanes:
    """The same of sixteen cells."""

    u: FloatLanes
    v: FloatLanes
    w: FloatLanes
    sums: PlaneLanes
    out: wp.int32


@wp.func
def crossing_at(a: wp.float32, b: wp.float32) -> wp.float32:
    """Return where F crosses zero between a (at 0) and b (at 1), or -1 where it does not."""
    is_crossed = (a >= 0.0) != (b >= 0.0)
    return wp.where(is_crossed, a / (a - b), -1.0)


@wp.func
def bit_as_float(c: wp.int32, axis: wp.int32) -> wp.float32:
    """Return the coordinate of corner c along an axis."""
    return wp.float32((c >> axis) & 1)


@wp.func
def is_out(square: wp.float32, t: wp.float32) -> wp.int32:
    """Return 1 if the square of a gradient is beyond float32, or at a crossing has not all its digits."""
    too_small = wp.where(t < 0.0, 0, wp.where(square < LEAST_SQUARE, 1, 0))
    return wp.where(square <= LARGEST_SQUARE, too_small, 1)


@wp.func
def weight_of(square: wp.float32, t: wp.float32, end: wp.float32) -> wp.float32:
    """Return what makes products of a gradient's parts those of a unit normal's; 0 where there is none.

    `end` is the square of the gradient at the edge's low end: where those at both ends cancel each other,
    what is left is a rounding and no direction.
    """
    weight = 1.0 / square
    return wp.where(t < 0.0, 0.0, wp.where(square > CANCELLED * end, weight, 0.0))


@wp.func
def sum_planes(f: CornerValues, g: CornerGradients) -> SummedPlanes:
    """Return the planes of one cell, summed."""
    count = float(0.0)
    u = float(0.0)
    v = float(0.0)
    w = float(0.0)
    for edge in range(12):
        a = EDGE_LOW[edge]
        b = EDGE_HIGH[edge]
        t = crossing_at(f[a], f[b])
        count += wp.where(t < 0.0, 0.0, 1.0)
        u += wp.where(t < 0.0, 0.0, bit_as_float(a, 0) + t * bit_as_float(a ^ b, 0))
        v += wp.where(t < 0.0, 0.0, bit_as_float(a, 1) + t * bit_as_float(a ^ b, 1))
        w += wp.where(t < 0.0, 0.0, bit_as_float(a, 2) + t * bit_as_float(a ^ b, 2))
    found = SummedPlanes()
    share = 1.0 / count
    found.mean = wp.vec3(u * share, v * share, w * share)
    for edge in range(12):
        a = EDGE_LOW[edge]
        b = EDGE_HIGH[edge]
        t = crossing_at(f[a], f[b])
        low_x = g[3 * a]
        low_y = g[3 * a + 1]
        low_z = g[3 * a + 2]
        x = low_x + t * (g[3 * b] - low_x)
        y = low_y + t * (g[3 * b + 1] - low_y)
        z = low_z + t * (g[3 * b + 2] - low_z)
        square = x * x + y * y + z * z
        found.out |= is_out(square, t)
        end = low_x * low_x + low_y * low_y + low_z * low_z
        weight = weight_of(square, t, end)
        du = bit_as_float(a, 0) + t * bit_as_float(a ^ b, 0) - found.mean[0]
        dv = bit_as_float(a, 1) + t * bit_as_float(a ^ b, 1) - found.mean[1]
        dw = bit_as_float(a, 2) + t * bit_as_float(a ^ b, 2) - found.mean[2]
        distance = x * du + y * dv + z * dw
        wx = weight * x
        wy = weight * y
        wz = weight * z
        found.sums[0] += wx * x
        found.sums[1] += wy * y
        found.sums[2] += wz * z
        found.sums[3] += wx * y
        found.sums[4] += wx * z
        found.sums[5] += wy * z
        found.sums[6] += wx * distance
        found.sums[7] += wy * distance
        found.sums[8] += wz * distance
    return found


@wp.func
def mean_lanes(crossings: EdgeLanes) -> SummedLanes:
    """Return the means of the crossings of sixteen cells; no planes yet."""
    count = FloatLanes()
    u = FloatLanes()
    v = FloatLanes()
    w = FloatLanes()
    for edge in range(12):
        a = EDGE_LOW[edge]
        across = a ^ EDGE_HIGH[edge]
        low_u = bit_as_float(a, 0)
        low_v = bit_as_float(a, 1)
        low_w = bit_as_float(a, 2)
        along_u = bit_as_float(across, 0)
        along_v = bit_as_float(across, 1)
        along_w = bit_as_float(across, 2)
        for lane in range(LANES):
            t = crossings[LANES * edge + lane]
            count[lane] += wp.where(t < 0.0, 0.0, 1.0)
            u[lane] += wp.where(t < 0.0, 0.0, low_u + t * along_u)
            v[lane] += wp.where(t < 0.0, 0.0, low_v + t * along_v)
            w[lane] += wp.where(t < 0.0, 0.0, low_w + t * along_w)
    for lane in range(LANES):
        share = 1.0 / count[lane]
        u[lane] = u[lane] * share
        v[lane] = v[lane] * share
        w[lane] = w[lane] * share
    found = SummedLanes()
    found.u = u
    found.v = v
    found.w = w
    return found


@wp.func
def crossing_lanes(cells: CellLanes) -> EdgeLanes:
    """Return where the edges of sixteen cells are crossed, edge after edge."""
    crossings = EdgeLanes()
    for edge in range(12):
        a = LANES * EDGE_LOW[edge]
        b = LANES * EDGE_HIGH[edge]
        for lane in range(LANES):
            crossings[LANES * edge + lane] = crossing_at(cells[a + lane], cells[b + lane])
    return crossings


@wp.func
def sum_plane_lanes(cells: CellLanes) -> SummedLanes:
    """Return the planes of sixteen cells, summed: what `sum_planes` does of one, in the same order."""
    crossings = crossing_lanes(cells)
    means = mean_lanes(crossings)
    u = means.u
    v = means.v
    w = means.w
    sums = PlaneLanes()
    out = int(0)
    for edge in range(12):
        a = EDGE_LOW[edge]
        b = EDGE_HIGH[edge]
        across = a ^ b
        low_u = bit_as_float(a, 0)
        low_v = bit_as_float(a, 1)
        low_w = bit_as_float(a, 2)
        along_u = bit_as_float(across, 0)
        along_v = bit_as_float(across, 1)
        along_w = bit_as_float(across, 2)
        a *= LANES
        b *= LANES
        for lane in range(LANES):
            t = crossings[LANES * edge + lane]
            low_x = cells[a + X + lane]
            low_y = cells[a + Y + lane]
            low_z = cells[a + Z + lane]
            x = low_x + t * (cells[b + X + lane] - low_x)
            y = low_y + t * (cells[b + Y + lane] - low_y)
            z = low_z + t * (cells[b + Z + lane] - low_z)
            square = x * x + y * y + z * z
            out |= is_out(square, t)
            end = low_x * low_x + low_y * low_y + low_z * low_z
            weight = weight_of(square, t, end)
            du = low_u + t * along_u - u[lane]
            dv = low_v + t * along_v - v[lane]
            dw = low_w + t * along_w - w[lane]
            distance = x * du + y * dv + z * dw
            wx = weight * x
            wy = weight * y
            wz = weight * z
            sums[lane] += wx * x
            sums[LANES + lane] += wy * y
            sums[2 * LANES + lane] += wz * z
            sums[3 * LANES + lane] += wx * y
            sums[4 * LANES + lane] += wx * z
            sums[5 * LANES + lane] += wy * z
            sums[6 * LANES + lane] += wx * distance
            sums[7 * LANES + lane] += wy * distance
            sums[8 * LANES + lane] += wz * distance
    means.sums = sums
    means.out = out
    return means
