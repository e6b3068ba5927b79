"""Evaluate the trilinear interpolant in a cell (Grosso & Zint 2021, equation 2).

Conventions: `f` holds F at the cell's eight corners; local coordinates are (u, v, w) in [0, 1]. Along each
axis the interpolant is linear, so one step along an axis from any point finds its zero there exactly.
"""

from typing import Any

import warp as wp

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

CornerValues = wp.types.vector(length=8, dtype=wp.float32)
"""F at the corners of a cell, corner c at (c & 1, c >> 1 & 1, c >> 2)."""

CornerValues64 = wp.types.vector(length=8, dtype=wp.float64)
"""The same in double precision, where a deviation is measured."""


SMALL = wp.float64(1.0e-15)
LARGE = wp.float64(1.0e15)
"""Between these a cell's largest value leaves room in float32 for products and for small neighbours."""

LEAST_INVERTIBLE = wp.float64(2.0**-1000)
LIFT = wp.float64(2.0**100)
"""Numbers below have no finite inverse, or nearly none: they are lifted before."""

FLAT = wp.constant(2.0**-100)
UNFLATTENED = wp.constant(2.0**60)
"""A gradient whose square is less is made longer before it is squared, by a factor that costs no digit."""

LEAST_NEGATIVE = wp.float32(-1.0e-30)
"""What stands for a negative number too small for float32, so that no corner changes its side."""


@wp.func
def keep_side(scaled: wp.float64, f: wp.float64) -> wp.float32:
    """Return a scaled f in single precision, below zero if f is, also where it becomes zero."""
    rounded = wp.float32(scaled)
    return wp.where(f < wp.float64(0.0), wp.min(rounded, LEAST_NEGATIVE), rounded)


@wp.func
def below_zero(f: wp.float64) -> wp.float32:
    """Return f in single precision, below zero if f is, also where f rounds to zero."""
    return keep_side(f, f)


@wp.func
def single_precision(f: CornerValues64) -> CornerValues:
    """Return corner values in single precision: harmless once the isovalue is subtracted.

    Only ratios count, so values that float32 could not hold are scaled by the largest; signs are kept. The
    largest is finite.
    """
    a = wp.max(wp.max(wp.abs(f[0]), wp.abs(f[1])), wp.max(wp.abs(f[2]), wp.abs(f[3])))
    b = wp.max(wp.max(wp.abs(f[4]), wp.abs(f[5])), wp.max(wp.abs(f[6]), wp.abs(f[7])))
    largest = wp.max(a, b)
    values = CornerValues(
        below_zero(f[0]),
        below_zero(f[1]),
        below_zero(f[2]),
        below_zero(f[3]),
        below_zero(f[4]),
        below_zero(f[5]),
        below_zero(f[6]),
        below_zero(f[7]),
    )
    if largest > wp.float64(0.0) and (largest <= SMALL or largest >= LARGE):
        lift = wp.where(largest < LEAST_INVERTIBLE, LIFT, wp.float64(1.0))
        scale = wp.float64(1.0) / (lift * largest)
        for c in range(8):
            values[c] = keep_side(scale * (lift * f[c]), f[c])
    return values


@wp.func
def fits_single(f: CornerValues) -> wp.bool:
    """Return whether corner values need no scaling in single precision."""
    a = wp.max(wp.max(wp.abs(f[0]), wp.abs(f[1])), wp.max(wp.abs(f[2]), wp.abs(f[3])))
    b = wp.max(wp.max(wp.abs(f[4]), wp.abs(f[5])), wp.max(wp.abs(f[6]), wp.abs(f[7])))
    largest = wp.max(a, b)
    return largest > wp.float32(SMALL) and largest < wp.float32(LARGE)


@wp.func
def trilinear_value(f: Any, u: Any, v: Any, w: Any) -> Any:
    """Return the trilinear interpolant at local coordinates (u, v, w)."""
    x00 = f[0] + u * (f[1] - f[0])
    x10 = f[2] + u * (f[3] - f[2])
    x01 = f[4] + u * (f[5] - f[4])
    x11 = f[6] + u * (f[7] - f[6])
    y0 = x00 + v * (x10 - x00)
    y1 = x01 + v * (x11 - x01)
    return y0 + w * (y1 - y0)


@wp.func
def trilinear_slope_u(f: Any, v: Any, w: Any) -> Any:
    """Return the interpolant's derivative along u, a cell being the unit of length."""
    a = (f[1] - f[0]) + v * ((f[3] - f[2]) - (f[1] - f[0]))
    b = (f[5] - f[4]) + v * ((f[7] - f[6]) - (f[5] - f[4]))
    return a + w * (b - a)


@wp.func
def trilinear_slope_v(f: Any, u: Any, w: Any) -> Any:
    """Return the interpolant's derivative along v."""
    a = (f[2] - f[0]) + u * ((f[3] - f[1]) - (f[2] - f[0]))
    b = (f[6] - f[4]) + u * ((f[7] - f[5]) - (f[6] - f[4]))
    return a + w * (b - a)


@wp.func
def trilinear_slope_w(f: Any, u: Any, v: Any) -> Any:
    """Return the interpolant's derivative along w."""
    a = (f[4] - f[0]) + u * ((f[5] - f[1]) - (f[4] - f[0]))
    b = (f[6] - f[2]) + u * ((f[7] - f[3]) - (f[6] - f[2]))
    return a + v * (b - a)


@wp.func
def trilinear_gradient(f: CornerValues, p: wp.vec3) -> wp.vec3:
    """Return the gradient at local coordinates p, a cell being the unit of length."""
    return wp.vec3(
        trilinear_slope_u(f, p[1], p[2]), trilinear_slope_v(f, p[0], p[2]), trilinear_slope_w(f, p[0], p[1])
    )


@wp.func
def newton_step(value: wp.float32, gradient: wp.vec3) -> wp.vec3:
    """Return value g / |g|^2, which Newton's step to zero subtracts; a zero vector if gradient g is zero."""
    scale = wp.where(wp.dot(gradient, gradient) < FLAT, UNFLATTENED, 1.0)
    longer = scale * gradient
    square = wp.dot(longer, longer)
    step = wp.vec3(0.0, 0.0, 0.0)
    if square > 0.0:
        step = (scale * value / square) * longer
    return step


NOWHERE = wp.constant(wp.vec3(-1.0, -1.0, -1.0))
"""A point outside every cell: no solution."""


@wp.func
def is_in_cell(p: wp.vec3) -> wp.bool:
    """Return whether local coordinates lie in the cell; a NaN does not."""
    in_x = p[0] >= 0.0 and p[0] <= 1.0
    in_y = p[1] >= 0.0 and p[1] <= 1.0
    return in_x and in_y and p[2] >= 0.0 and p[2] <= 1.0


@wp.func
def solve_along(f: CornerValues, p: wp.vec3, axis: wp.int32) -> wp.vec3:
    """Return the point of the surface on the line through p along an axis, or NOWHERE."""
    slope = trilinear_gradient(f, p)[axis]
    solution = NOWHERE
    if slope != 0.0:
        solution = p
        solution[axis] = p[axis] - trilinear_value(f, p[0], p[1], p[2]) / slope
    return solution
