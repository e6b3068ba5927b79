"""Find the eigenvalues and eigenvectors of symmetric 3x3 matrices by Jacobi's rotations.

A fixed number of sweeps without a branch, so that a loop over matrices becomes vector instructions. A closed
formula would need arc cosines, and loses small eigenvalues to cancellation; rotations do not. Functions
serve single and double precision.
"""

from typing import Any

import warp as wp

Eigen = wp.types.vector(length=15, dtype=wp.float32)
"""A matrix xx yy zz xy xz yz, and the columns of a rotation."""

Eigen64 = wp.types.vector(length=15, dtype=wp.float64)
"""The same in double precision."""

Planes = wp.types.vector(length=9, dtype=wp.float32)
"""Sums over planes: n n^T as xx yy zz xy xz yz, and n (n . d) for their distances d along x, y, z."""

Planes64 = wp.types.vector(length=9, dtype=wp.float64)
"""The same in double precision."""

SMALL = wp.constant(1.0e-12)
SMALL_64 = wp.constant(wp.float64(1.0e-40))
"""Entries beside the diagonal that count for nothing, the trace of a sum of unit normals being 3 at least.

Squares of smaller ones would be denormal numbers, which take a processor a hundred cycles each.
"""

SWEEPS_64 = 7
"""Sweeps of three rotations until doubles have converged, which is quadratic.

In single precision three leave a hundred-thousandth of the trace at most beside the diagonal, for sums of
random normals, and less than a rounding nearly always.
"""


@wp.func
def tangent(app: Any, aqq: Any, apq: Any, least: Any, zero: Any) -> Any:
    """Return the tangent of the smaller angle of rotation that makes apq zero; 0 if it is `least` or less."""
    difference = aqq - app
    twice = wp.where(wp.abs(apq) > least, apq + apq, zero)
    size = wp.abs(difference) + wp.sqrt(difference * difference + twice * twice)
    signed = wp.where(difference < zero, -twice, twice)
    return wp.where(size > zero, signed / size, zero)


@wp.func
def rotated(
    e: Any,
    pq: wp.int32,
    rp: wp.int32,
    rq: wp.int32,
    p: wp.int32,
    q: wp.int32,
    least: Any,
    zero: Any,
    one: Any,
) -> Any:
    """Return a state after the rotation in the plane of axes p and q; r is the third axis.

    `pq`, `rp` and `rq` are the places of the entries beside the diagonal.
    """
    s = e
    t = tangent(e[p], e[q], e[pq], least, zero)
    cosine = one / wp.sqrt(one + t * t)
    sine = t * cosine
    s[p] = e[p] - t * e[pq]
    s[q] = e[q] + t * e[pq]
    s[pq] = zero
    s[rp] = cosine * e[rp] - sine * e[rq]
    s[rq] = cosine * e[rq] + sine * e[rp]
    v = 6 + 3 * p
    w = 6 + 3 * q
    s[v] = cosine * e[v] - sine * e[w]
    s[w] = cosine * e[w] + sine * e[v]
    s[v + 1] = cosine * e[v + 1] - sine * e[w + 1]
    s[w + 1] = cosine * e[w + 1] + sine * e[v + 1]
    s[v + 2] = cosine * e[v + 2] - sine * e[w + 2]
    s[w + 2] = cosine * e[w + 2] + sine * e[v + 2]
    return s


@wp.func
def swept(e: Any, least: Any, zero: Any, one: Any) -> Any:
    """Return a state after a sweep: a rotation in the plane of each two axes."""
    a = rotated(e, 3, 4, 5, 0, 1, least, zero, one)
    b = rotated(a, 4, 3, 5, 0, 2, least, zero, one)
    return rotated(b, 5, 3, 4, 1, 2, least, zero, one)


@wp.func
def step_along(e: Any, sums: Any, n: wp.int32, least: Any, zero: Any) -> Any:
    """Return how far the least point is along eigenvector n, 0 if its eigenvalue is `least` or less."""
    v = 6 + 3 * n
    along = e[v] * sums[6] + e[v + 1] * sums[7] + e[v + 2] * sums[8]
    return wp.where(e[n] > least, along / e[n], zero)


@wp.func
def solved(e: Any, sums: Any, cut: Any, zero: Any) -> Any:
    """Return how far the least point is along x, y and z, in the first three entries.

    Directions with an eigenvalue of at most `cut` times the largest count for nothing.
    """
    least = cut * wp.max(e[0], wp.max(e[1], e[2]))
    a = step_along(e, sums, 0, least, zero)
    b = step_along(e, sums, 1, least, zero)
    c = step_along(e, sums, 2, least, zero)
    result = e
    result[0] = a * e[6] + b * e[9] + c * e[12]
    result[1] = a * e[7] + b * e[10] + c * e[13]
    result[2] = a * e[8] + b * e[11] + c * e[14]
    return result


@wp.func
def least_point(sums: Planes, cut: wp.float32) -> wp.vec3:
    """Return the point of the least sum of squared distances from planes, nearest to where they are summed.

    Args:
        sums: The planes' normals and distances, summed.
        cut: Eigenvalues up to this share of the largest are dropped.
    """
    e = Eigen(
        sums[0], sums[1], sums[2], sums[3], sums[4], sums[5], 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    )
    a = swept(e, SMALL, 0.0, 1.0)
    b = swept(a, SMALL, 0.0, 1.0)
    c = swept(b, SMALL, 0.0, 1.0)
    found = solved(c, sums, cut, 0.0)
    return wp.vec3(found[0], found[1], found[2])


@wp.func
def least_point_64(sums: Planes64, cut: wp.float64) -> wp.vec3d:
    """Return what `least_point` does, in double precision."""
    zero = wp.float64(0.0)
    one = wp.float64(1.0)
    e = Eigen64()
    for n in range(6):
        e[n] = sums[n]
    for n in range(3):
        e[6 + 4 * n] = one
    for _sweep in range(SWEEPS_64):
        e = swept(e, SMALL_64, zero, one)
    found = solved(e, sums, cut, zero)
    return wp.vec3d(found[0], found[1], found[2])
