"""Find the eigenvalues and eigenvectors of symmetric 3x3 matrices by Jacobi's rotations.

A fixed number of sweeps without a branch, so that matrices side by side are vectors. A closed formula would
need arc cosines, and loses small eigenvalues to cancellation; rotations do not. `symmetric_matrix.h` does it
in single precision, where three sweeps leave a hundred-thousandth of the trace at most beside the diagonal,
for sums of random normals, and less than a rounding nearly always; this module in double precision.
"""

import warp as wp

Eigen64 = wp.types.vector(length=15, dtype=wp.float64)
"""A matrix xx yy zz xy xz yz, and the columns of a rotation."""

Planes64 = wp.types.vector(length=9, dtype=wp.float64)
"""Sums over planes: n n^T as xx yy zz xy xz yz, and n (n . d) for their distances d along x, y, z."""

ZERO, ONE = wp.constant(wp.float64(0.0)), wp.constant(wp.float64(1.0))

SMALL = wp.constant(wp.float64(1.0e-40))
"""Entries beside the diagonal that count for nothing, the trace of a sum of unit normals being 3 at least; in
single precision 1e-12. Squares of smaller ones would be denormal numbers, which take a processor a hundred
cycles each.
"""

SWEEPS = 7
"""Sweeps of three rotations until doubles have converged, which is quadratic."""


@wp.func
def tangent(app: wp.float64, aqq: wp.float64, apq: wp.float64) -> wp.float64:
    """Return the tangent of the smaller angle of rotation that makes apq zero; 0 if it counts for nothing."""
    difference = aqq - app
    twice = wp.where(wp.abs(apq) > SMALL, apq + apq, ZERO)
    size = wp.abs(difference) + wp.sqrt(difference * difference + twice * twice)
    signed = wp.where(difference < ZERO, -twice, twice)
    return wp.where(size > ZERO, signed / size, ZERO)


@wp.func
def rotated(e: Eigen64, pq: wp.int32, rp: wp.int32, rq: wp.int32, p: wp.int32, q: wp.int32) -> Eigen64:
    """Return a state after the rotation in the plane of axes p and q; r is the third axis.

    `pq`, `rp` and `rq` are the places of the entries beside the diagonal.
    """
    s = e
    t = tangent(e[p], e[q], e[pq])
    cosine = ONE / wp.sqrt(ONE + t * t)
    sine = t * cosine
    s[p] = e[p] - t * e[pq]
    s[q] = e[q] + t * e[pq]
    s[pq] = ZERO
    s[rp] = cosine * e[rp] - sine * e[rq]
    s[rq] = cosine * e[rq] + sine * e[rp]
    for n in range(3):
        v = 6 + 3 * p + n
        w = 6 + 3 * q + n
        s[v] = cosine * e[v] - sine * e[w]
        s[w] = cosine * e[w] + sine * e[v]
    return s


@wp.func
def step_along(e: Eigen64, sums: Planes64, n: wp.int32, least: wp.float64) -> wp.float64:
    """Return how far the least point is along eigenvector n, 0 if its eigenvalue is `least` or less."""
    v = 6 + 3 * n
    along = e[v] * sums[6] + e[v + 1] * sums[7] + e[v + 2] * sums[8]
    return wp.where(e[n] > least, along / e[n], ZERO)


@wp.func
def least_point_64(sums: Planes64, cut: wp.float64) -> wp.vec3d:
    """Return the point of the least sum of squared distances from planes, nearest to where they are summed.

    Args:
        sums: The planes' normals and distances, summed.
        cut: Eigenvalues up to this share of the largest are dropped.
    """
    e = Eigen64()
    for n in range(6):
        e[n] = sums[n]
    for n in range(3):
        e[6 + 4 * n] = ONE
    for _sweep in range(SWEEPS):
        e = rotated(e, 3, 4, 5, 0, 1)
        e = rotated(e, 4, 3, 5, 0, 2)
        e = rotated(e, 5, 3, 4, 1, 2)
    least = cut * wp.max(e[0], wp.max(e[1], e[2]))
    a = step_along(e, sums, 0, least)
    b = step_along(e, sums, 1, least)
    c = step_along(e, sums, 2, least)
    return wp.vec3d(
        a * e[6] + b * e[9] + c * e[12], a * e[7] + b * e[10] + c * e[13], a * e[8] + b * e[11] + c * e[14]
    )
