"""Measure the shape of one quad or triangle: areas, angles, the measures of the paper and of Verdict.

Grosso & Zint 2021, section 5.3: equation 8 (mean ratio of a triangle), equation 9 (shape of a quad), and the
MaxMin-angle split of a quad into two triangles. Scaled Jacobian as in Verdict (Stimpson et al. 2007).

Conventions: double precision throughout. An angle is kept as its turn, a number from 0 to 4 that grows with
it and costs no arc tangent: 1 is a right angle, 2 a straight one. At a corner, `before` is the edge that
runs into it and `after` the one that runs out; they and their sum, the chord, bound a triangle.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

TIE = wp.constant(wp.float64(1e-6))
"""How much larger, in cosine, the smallest angle must be for the split along corners 1 and 3: coordinates in
float32 blur the angles of a symmetric quad by a tenth of that, and a tie goes along corners 0 and 2."""

ZERO = wp.constant(wp.float64(0.0))
ONE = wp.constant(wp.float64(1.0))
TWO = wp.constant(wp.float64(2.0))
FULL_TURN = wp.constant(wp.float64(4.0))
HALF_PI = wp.constant(wp.float64(1.5707963267948966))
EQUILATERAL = wp.constant(wp.float64(3.4641016151377544))
"""Sum of the squared sides over twice the area of an equilateral triangle: 2 sqrt(3)."""


@wp.struct
class FaceShape:
    """What is measured on one face.

    `quality` is equation 9 and `scaled_jacobian` Verdict's, both 1 on a square; `ratio` is equation 8,
    summed over the face's triangles; `min_turn` and `max_turn` are its least and largest angle; `warp_turn`
    is the largest angle between the normals at opposite corners. On a triangle `quality` and
    `scaled_jacobian` are 1 and `warp_turn` is 0.
    """

    quality: wp.float64
    scaled_jacobian: wp.float64
    ratio: wp.float64
    min_turn: wp.float64
    max_turn: wp.float64
    warp_turn: wp.float64
    area: wp.float64
    volume: wp.float64


@wp.func
def quotient(a: wp.float64, b: wp.float64) -> wp.float64:
    """Return a / b, or 0 where b is 0: a face without extent has the worst shape."""
    result = ZERO
    if b != ZERO:
        result = a / b
    return result


@wp.func
def turn_between(cosine: wp.float64, sine: wp.float64) -> wp.float64:
    """Return the turn of an angle up to 180 degrees from multiples of its cosine and sine, 0 from zeros."""
    turn = quotient(sine, wp.abs(cosine) + sine)
    if cosine < ZERO:
        turn = TWO - turn
    return turn


@wp.func
def turn_angle(turn: wp.float64) -> wp.float64:
    """Return the angle of a turn in radians, 0 to 2 pi."""
    angle = ZERO
    half = turn
    if turn > TWO:
        half = FULL_TURN - turn
    if half > ONE:
        angle = TWO * HALF_PI - wp.atan2(TWO - half, half - ONE)
    else:
        angle = wp.atan2(half, ONE - half)
    if turn > TWO:
        angle = FULL_TURN * HALF_PI - angle
    return angle


@wp.func
def largest_cosine(before: wp.vec3d, after: wp.vec3d, sides: wp.vec3d) -> wp.float64:
    """Return the cosine of the smallest angle of the triangle at a corner, 1 if a side is 0.

    `sides` are the lengths of `before`, `after` and the chord.
    """
    chord = before + after
    cosine = ONE
    if sides[0] * sides[1] * sides[2] > ZERO:
        cosine = -wp.dot(before, after) / (sides[0] * sides[1])
        cosine = wp.max(cosine, wp.dot(before, chord) / (sides[0] * sides[2]))
        cosine = wp.max(cosine, wp.dot(after, chord) / (sides[1] * sides[2]))
    return cosine


@wp.func
def splits_along_02(
    ab: wp.vec3d, bc: wp.vec3d, cd: wp.vec3d, da: wp.vec3d, sides: wp.vec4d, ac: wp.float64, bd: wp.float64
) -> wp.bool:
    """Return whether a quad's MaxMin-angle split runs between its corners 0 and 2; ties do.

    `sides` are the lengths of the edges, `ac` and `bd` those of the diagonals.
    """
    along_02 = wp.max(
        largest_cosine(ab, bc, wp.vec3d(sides[0], sides[1], ac)),
        largest_cosine(cd, da, wp.vec3d(sides[2], sides[3], ac)),
    )
    along_13 = wp.max(
        largest_cosine(bc, cd, wp.vec3d(sides[1], sides[2], bd)),
        largest_cosine(da, ab, wp.vec3d(sides[3], sides[0], bd)),
    )
    return along_13 > along_02 - TIE


@wp.func
def chooses_02(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, d: wp.vec3d) -> wp.bool:
    """Return whether the MaxMin-angle split of the quad a b c d runs from a to c."""
    ab = b - a
    bc = c - b
    cd = d - c
    da = a - d
    sides = wp.vec4d(wp.length(ab), wp.length(bc), wp.length(cd), wp.length(da))
    return splits_along_02(ab, bc, cd, da, sides, wp.length(c - a), wp.length(d - b))


@wp.func
def add_triangle(shape: FaceShape, before: wp.vec3d, after: wp.vec3d, apex: wp.vec3d) -> FaceShape:
    """Return `shape` with area, mean ratio and signed volume to the origin of a corner's triangle added.

    `apex` is the position of the corner.
    """
    normal = wp.cross(before, after)  # type: ignore[arg-type]  # a vec3d is a Vector
    chord = before + after
    twice_area = wp.length(normal)
    squares = wp.dot(before, before) + wp.dot(after, after) + wp.dot(chord, chord)
    shape.area += twice_area / TWO
    shape.ratio += EQUILATERAL * quotient(twice_area, squares)
    shape.volume += wp.dot(apex, normal) / wp.float64(6.0)
    return shape


@wp.func
def add_corner(
    shape: FaceShape, before: wp.vec3d, after: wp.vec3d, sides: wp.float64, cross: wp.vec3d, normal: wp.vec3d
) -> FaceShape:
    """Return `shape` with one corner's angle and quality added.

    `sides` is the product of both edges' lengths, `cross` their cross product, `normal` the unit normal at
    the quad's centre. A corner that turns against it is reflex: over 180 degrees, with a negative Jacobian.
    """
    sine = wp.length(cross)
    turn = turn_between(-wp.dot(before, after), sine)
    jacobian = wp.dot(normal, cross)
    if jacobian < ZERO:
        turn = FULL_TURN - turn
    shape.min_turn = wp.min(shape.min_turn, turn)
    shape.max_turn = wp.max(shape.max_turn, turn)
    squares = wp.dot(before, before) + wp.dot(after, after)
    shape.quality = wp.min(shape.quality, quotient(TWO * sine, squares))
    shape.scaled_jacobian = wp.min(shape.scaled_jacobian, quotient(jacobian, sides))
    return shape


@wp.func
def blank_shape() -> FaceShape:
    """Return the shape that corners and triangles are added to."""
    shape = FaceShape()
    shape.quality = ONE
    shape.scaled_jacobian = ONE
    shape.min_turn = FULL_TURN
    return shape


@wp.func
def quad_shape(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, d: wp.vec3d) -> FaceShape:
    """Measure a quad; the normal at its centre is that of its two middle lines."""
    ab = b - a
    bc = c - b
    cd = d - c
    da = a - d
    at_a = wp.cross(da, ab)
    at_b = wp.cross(ab, bc)
    at_c = wp.cross(bc, cd)
    at_d = wp.cross(cd, da)
    sides = wp.vec4d(wp.length(ab), wp.length(bc), wp.length(cd), wp.length(da))
    normal = wp.normalize(wp.cross(ab - cd, bc - da))
    shape = blank_shape()
    shape = add_corner(shape, da, ab, sides[3] * sides[0], at_a, normal)
    shape = add_corner(shape, ab, bc, sides[0] * sides[1], at_b, normal)
    shape = add_corner(shape, bc, cd, sides[1] * sides[2], at_c, normal)
    shape = add_corner(shape, cd, da, sides[2] * sides[3], at_d, normal)
    shape.warp_turn = wp.max(
        turn_between(wp.dot(at_a, at_c), wp.length(wp.cross(at_a, at_c))),
        turn_between(wp.dot(at_b, at_d), wp.length(wp.cross(at_b, at_d))),
    )
    if splits_along_02(ab, bc, cd, da, sides, wp.length(c - a), wp.length(d - b)):
        shape = add_triangle(shape, ab, bc, b)
        shape = add_triangle(shape, cd, da, d)
    else:
        shape = add_triangle(shape, bc, cd, c)
        shape = add_triangle(shape, da, ab, a)
    return shape


@wp.func
def triangle_shape(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> FaceShape:
    """Measure a triangle."""
    ab = b - a
    bc = c - b
    ca = a - c
    sine = wp.length(wp.cross(ab, bc))
    turns = wp.vec3d(
        turn_between(-wp.dot(ca, ab), sine),
        turn_between(-wp.dot(ab, bc), sine),
        turn_between(-wp.dot(bc, ca), sine),
    )
    shape = blank_shape()
    shape.min_turn = wp.min(turns)
    shape.max_turn = wp.max(turns)
    return add_triangle(shape, ab, bc, b)
