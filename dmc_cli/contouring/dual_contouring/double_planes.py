"""Find a cell's crossings and sum the planes there in double precision, one cell at a time."""

import warp as wp

from dmc_cli.contouring.dual_contouring.symmetric_matrix import ONE, ZERO, Planes64, least_point_64
from dmc_cli.field import EDGES, CornerValues64

Vec12 = wp.types.vector(length=12, dtype=wp.int32)

EDGE_LOW = wp.constant(Vec12(*(low for low, _ in EDGES)))
EDGE_HIGH = wp.constant(Vec12(*(high for _, high in EDGES)))
"""The corners of each edge."""

FULL_CUT = wp.constant(wp.float64(1.0e-12))
"""Against matrices that are singular to the last digit, no more."""


@wp.func
def crossing_on(f: CornerValues64, edge: wp.int32) -> wp.float64:
    """Return where F crosses zero along an edge, from its lower corner on, or -1 where it does not."""
    a = f[EDGE_LOW[edge]]
    b = f[EDGE_HIGH[edge]]
    t = wp.float64(-1.0)
    if (a >= ZERO) != (b >= ZERO):
        t = a / (a - b)
    return t


@wp.func
def point_on(edge: wp.int32, t: wp.float64) -> wp.vec3d:
    """Return the point at t along an edge in local coordinates."""
    a = EDGE_LOW[edge]
    across = a ^ EDGE_HIGH[edge]
    return wp.vec3d(
        wp.float64(a & 1) + t * wp.float64(across & 1),
        wp.float64((a >> 1) & 1) + t * wp.float64((across >> 1) & 1),
        wp.float64(a >> 2) + t * wp.float64(across >> 2),
    )


@wp.func
def mean_of_crossings(f: CornerValues64) -> wp.vec3d:
    """Return the mean of a cell's crossings."""
    mean = wp.vec3d()
    count = wp.float64(0.0)
    for edge in range(12):
        t = crossing_on(f, edge)
        if t >= ZERO:
            mean += point_on(edge, t)
            count += ONE
    return mean / count


@wp.func
def with_plane(sums: Planes64, normal: wp.vec3d, offset: wp.vec3d) -> Planes64:
    """Return sums with one more plane, through `offset` from where they are summed."""
    distance = wp.dot(normal, offset)
    more = sums
    for k in range(3):
        more[k] += normal[k] * normal[k]
        more[6 + k] += normal[k] * distance
    more[3] += normal[0] * normal[1]
    more[4] += normal[0] * normal[2]
    more[5] += normal[1] * normal[2]
    return more


@wp.func
def in_full(sums: Planes64, mean: wp.vec3d) -> wp.vec4d:
    """Return the full solution, or the mean and 1 where it lies outside the cell."""
    p = mean + least_point_64(sums, FULL_CUT)
    is_outside = wp.min(p) < ZERO or wp.max(p) > ONE or not wp.isfinite(p)
    if is_outside:
        p = mean
    return wp.vec4d(p[0], p[1], p[2], wp.where(is_outside, ONE, ZERO))
