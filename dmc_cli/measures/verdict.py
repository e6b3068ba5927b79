"""Measure one quad or triangle as Verdict does, and the ratio of a triangle's two radii.

Stimpson et al. 2007, *The Verdict geometric quality library*: aspect ratio, skew, taper, stretch; the others
are in `shape.py`. Equal to VTK's vtkCellQuality, but that a face without extent has the worst value: 0, or
infinity where 1 or 0 is the best. Radius ratio: twice the inscribed radius over the circumscribed one, 1 on
an equilateral triangle (Schmitz et al. 2009); Verdict's is its inverse.
"""

import math

import warp as wp

from dmc_cli.measures.shape import chooses_02, quad_shape, quotient, triangle_shape, turn_angle

wp.set_module_options({"enable_backward": False})

NUMBERS = 13
"""Numbers of a face, in the order of `NAMES`."""

NAMES = (
    *("shape", "scaled_jacobian", "aspect_ratio", "skew", "taper", "stretch", "warpage"),
    *(
        "min_angle",
        "max_angle",
        "mean_ratio",
        "mean_ratio_of_second",
        "radius_ratio",
        "radius_ratio_of_second",
    ),
)
"""What a `FaceNumbers` has: angles in degrees, the ratios of both triangles of a quad."""

FaceNumbers = wp.types.vector(length=NUMBERS, dtype=wp.float64)

ZERO = wp.constant(wp.float64(0.0))
HALF = wp.constant(wp.float64(0.5))
FOUR = wp.constant(wp.float64(4.0))
INFINITE = wp.constant(wp.float64(math.inf))
UNDEFINED = wp.constant(wp.float64(math.nan))
ROOT_2 = wp.constant(wp.float64(1.4142135623730951))
TWO_OVER_ROOT_3 = wp.constant(wp.float64(1.1547005383792517))
TWICE_ROOT_3 = wp.constant(wp.float64(3.4641016151377544))
DEGREES = wp.constant(wp.float64(57.29577951308232))


@wp.func
def excess(a: wp.float64, b: wp.float64) -> wp.float64:
    """Return a / b, or infinity where b is 0."""
    result = INFINITE
    if b != ZERO:
        result = a / b
    return result


@wp.func
def ratio_pair(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.vec2d:
    """Return the mean ratio (equation 8 of the paper of 2021) and the radius ratio of a triangle."""
    ab = wp.length(b - a)
    bc = wp.length(c - b)
    ca = wp.length(a - c)
    twice_area = wp.length(wp.cross(b - a, c - b))
    return wp.vec2d(
        TWICE_ROOT_3 * quotient(twice_area, ab * ab + bc * bc + ca * ca),
        FOUR * quotient(twice_area, (ab + bc + ca) * ab) * quotient(twice_area, bc * ca),
    )


@wp.func
def quad_numbers(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, d: wp.vec3d) -> FaceNumbers:
    """Measure a quad."""
    ab = b - a
    bc = c - b
    cd = d - c
    da = a - d
    sides = wp.vec4d(wp.length(ab), wp.length(bc), wp.length(cd), wp.length(da))
    along = ab - cd
    across = bc - da
    found = FaceNumbers()
    shape = quad_shape(a, b, c, d)
    found[0] = shape.quality
    found[1] = shape.scaled_jacobian
    perimeter = sides[0] + sides[1] + sides[2] + sides[3]
    found[2] = excess(HALF * wp.max(sides) * perimeter, wp.length(wp.cross(c - a, d - b)))
    found[3] = wp.abs(wp.dot(wp.normalize(along), wp.normalize(across)))
    found[4] = excess(wp.length(ab + cd), wp.min(wp.length(along), wp.length(across)))
    found[5] = ROOT_2 * quotient(wp.min(sides), wp.max(wp.length(c - a), wp.length(d - b)))
    found[6] = DEGREES * turn_angle(shape.warp_turn)
    found[7] = DEGREES * turn_angle(shape.min_turn)
    found[8] = DEGREES * turn_angle(shape.max_turn)
    if chooses_02(a, b, c, d):
        first = ratio_pair(a, b, c)
        second = ratio_pair(a, c, d)
    else:
        first = ratio_pair(b, c, d)
        second = ratio_pair(b, d, a)
    found[9] = first[0]
    found[10] = second[0]
    found[11] = first[1]
    found[12] = second[1]
    return found


@wp.func
def triangle_numbers(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> FaceNumbers:
    """Measure a triangle; what only a quad has is NaN."""
    found = FaceNumbers()
    for n in range(NUMBERS):
        found[n] = UNDEFINED
    sides = wp.vec3d(wp.length(b - a), wp.length(c - b), wp.length(a - c))
    twice_area = wp.length(wp.cross(b - a, c - b))
    shape = triangle_shape(a, b, c)
    longest = wp.max(sides)
    pair = wp.max(sides[0] * sides[1], wp.max(sides[1] * sides[2], sides[2] * sides[0]))
    found[1] = TWO_OVER_ROOT_3 * quotient(twice_area, pair)
    found[2] = excess(longest * (sides[0] + sides[1] + sides[2]), TWICE_ROOT_3 * twice_area)
    found[7] = DEGREES * turn_angle(shape.min_turn)
    found[8] = DEGREES * turn_angle(shape.max_turn)
    ratios = ratio_pair(a, b, c)
    found[9] = ratios[0]
    found[11] = ratios[1]
    return found
