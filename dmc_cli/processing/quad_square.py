"""Compare a quad with a square: device functions for stages that move vertices.

Shape is equation 9 of Grosso & Zint 2021, the least over the corners of the area of the parallelogram of
their edges over the mean square of their lengths: 1 for a square, here negative where a corner turns against
its quad. `measures/shape.py` measures the same for the report, in double precision and with angles.
"""

import warp as wp

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

COS_BELOW, COS_LIMIT, COS_ABOVE = wp.constant(0.8661127), wp.constant(0.8660254), wp.constant(0.8659381)
"""Cosines of the warp that a solver warns of, 30 degrees, and of a hundredth of a degree less and more."""

COS_SEVERE = wp.constant(0.5)
"""The same of 60 degrees, which remeshing takes for severe."""


@wp.func
def quad_area(corners: wp.array(dtype=wp.int32), position: wp.array(dtype=wp.vec3), q: wp.int32) -> wp.vec3:
    """Return a quad's normal, as long as twice its area."""
    a = position[corners[4 * q]]
    b = position[corners[4 * q + 1]]
    c = position[corners[4 * q + 2]]
    d = position[corners[4 * q + 3]]
    return wp.cross(c - a, d - b)


@wp.func
def corner_shape(before: wp.vec3, after: wp.vec3, normal: wp.vec3) -> wp.float32:
    """Return the shape at a corner between the edge into it and the edge out of it."""
    squares = wp.dot(before, before) + wp.dot(after, after)
    area = wp.dot(wp.cross(before, after), normal)
    size = wp.length(wp.cross(before, after))
    return wp.where(squares > 0.0, 2.0 * wp.where(area < 0.0, -size, size) / squares, 0.0)


@wp.func
def quad_shape(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3) -> wp.float32:
    """Return the least shape of a quad's corners."""
    ab = b - a
    bc = c - b
    cd = d - c
    da = a - d
    normal = wp.cross(ab - cd, bc - da)
    return wp.min(
        wp.min(corner_shape(da, ab, normal), corner_shape(ab, bc, normal)),
        wp.min(corner_shape(bc, cd, normal), corner_shape(cd, da, normal)),
    )


@wp.func
def nearest_square_corner(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3) -> wp.vec3:
    """Return the corner that belongs to a of the square nearest to a quad, by least squares in its plane."""
    half_ac = 0.5 * (a - c)
    half_bd = 0.5 * (b - d)
    normal = wp.normalize(wp.cross(half_ac, half_bd))
    return 0.25 * ((a + c) + (b + d)) + 0.5 * (half_ac + wp.cross(half_bd, normal))


@wp.func
def corner_cosine(n: wp.vec3, m: wp.vec3) -> wp.float32:
    """Return the cosine of the angle between two normals, 1 where one of them is none."""
    size = wp.length(n) * wp.length(m)
    return wp.where(size > 0.0, wp.dot(n, m) / size, 1.0)


@wp.func
def warp_cosine(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3) -> wp.float32:
    """Return the cosine of a quad's warp, the larger angle between normals at opposite corners."""
    ab = b - a
    bc = c - b
    cd = d - c
    da = a - d
    one = corner_cosine(wp.cross(da, ab), wp.cross(bc, cd))
    return wp.min(one, corner_cosine(wp.cross(ab, bc), wp.cross(cd, da)))


@wp.func
def passes_warp_limit(before: wp.float32, after: wp.float32) -> wp.bool:
    """Return whether a quad's warp, given by cosines, was below the limit and is not any more.

    The hundredth of a degree is for the rounding; a quad that stays as it is passes nothing.
    """
    return after < COS_BELOW and before > COS_ABOVE and after < before
