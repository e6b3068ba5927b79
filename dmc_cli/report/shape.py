# Typed by Warp's own compiler.
# mypy: ignore-errors
"""The shape of one quad or triangle: areas, angles, and the measures of the paper and of Verdict.

Grosso & Zint 2021, section 5.3: equation 8 (mean ratio of a triangle), equation 9 (shape of a quad), and the
MaxMin-angle split of a quad into two triangles. Scaled Jacobian as in Verdict (Stimpson et al. 2007).
All arithmetic is in double precision; angles are in radians.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

TIE = wp.constant(wp.float64(1e-6))
"""How much larger, in cosine, the smallest angle must be for the split along corners 1 and 3: coordinates in
float32 blur the angles of a symmetric quad by a tenth of that, and a tie goes along corners 0 and 2."""

PI = wp.constant(wp.float64(3.141592653589793))

TWO = wp.constant(wp.float64(2.0))


@wp.struct
class FaceShape:
    """What is measured on one face.

    `quality` is equation 9 and `scaled_jacobian` Verdict's, both 1 on a square; `ratio` is equation 8,
    summed over the face's triangles; `warpage` is the largest angle between the normals at opposite
    corners. On a triangle `quality` and `scaled_jacobian` are 1 and `warpage` is 0.
    """

    quality: wp.float64
    scaled_jacobian: wp.float64
    ratio: wp.float64
    min_angle: wp.float64
    max_angle: wp.float64
    warpage: wp.float64
    area: wp.float64
    volume: wp.float64


@wp.func
def quotient(a: wp.float64, b: wp.float64) -> wp.float64:
    """Return a / b, or 0 where b is 0: a face without extent has the worst shape."""
    result = wp.float64(0.0)
    if b != wp.float64(0.0):
        result = a / b
    return result


@wp.func
def angle_between(a: wp.vec3d, b: wp.vec3d) -> wp.float64:
    """Return the angle between two vectors, 0 if one of them is 0."""
    return wp.atan2(wp.length(wp.cross(a, b)), wp.dot(a, b))


@wp.func
def largest_cosine(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.float64:
    """Return the cosine of a triangle's smallest angle, 1 if it has no area."""
    ab = b - a
    bc = c - b
    ca = a - c
    lengths = wp.vec3d(wp.length(ab), wp.length(bc), wp.length(ca))
    cosine = wp.float64(1.0)
    if lengths[0] * lengths[1] * lengths[2] > wp.float64(0.0):
        cosine = -wp.dot(ca, ab) / (lengths[2] * lengths[0])
        cosine = wp.max(cosine, -wp.dot(ab, bc) / (lengths[0] * lengths[1]))
        cosine = wp.max(cosine, -wp.dot(bc, ca) / (lengths[1] * lengths[2]))
    return cosine


@wp.func
def splits_along_02(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, d: wp.vec3d) -> wp.bool:
    """Return whether a quad's MaxMin-angle split runs between its corners 0 and 2; ties do."""
    along_02 = wp.max(largest_cosine(a, b, c), largest_cosine(a, c, d))
    along_13 = wp.max(largest_cosine(a, b, d), largest_cosine(b, c, d))
    return along_13 > along_02 - TIE


@wp.func
def triangle_ratio(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.float64:
    """Return the mean ratio of a triangle, 1 if equilateral: equation 8."""
    ab = b - a
    bc = c - b
    ca = a - c
    squares = wp.dot(ab, ab) + wp.dot(bc, bc) + wp.dot(ca, ca)
    return quotient(TWO * wp.sqrt(wp.float64(3.0)) * wp.length(wp.cross(ab, ca)), squares)


@wp.func
def add_triangle(shape: FaceShape, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> FaceShape:
    """Return `shape` with a triangle's area, mean ratio and signed volume to the origin added."""
    shape.area += wp.length(wp.cross(b - a, c - a)) / TWO
    shape.ratio += triangle_ratio(a, b, c)
    shape.volume += wp.dot(a, wp.cross(b, c)) / wp.float64(6.0)
    return shape


@wp.func
def add_corner(shape: FaceShape, before: wp.vec3d, after: wp.vec3d, normal: wp.vec3d) -> FaceShape:
    """Return `shape` with one corner's angle and quality added.

    `before` runs into the corner and `after` out of it; `normal` is the unit normal at the quad's centre. A
    corner that turns against it is a reflex one, over 180 degrees and with a negative Jacobian.
    """
    jacobian = wp.dot(normal, wp.cross(before, after))
    angle = angle_between(-before, after)
    if jacobian < wp.float64(0.0):
        angle = TWO * PI - angle
    shape.min_angle = wp.min(shape.min_angle, angle)
    shape.max_angle = wp.max(shape.max_angle, angle)
    squares = wp.dot(before, before) + wp.dot(after, after)
    shape.quality = wp.min(shape.quality, quotient(TWO * wp.length(wp.cross(before, after)), squares))
    lengths = wp.length(before) * wp.length(after)
    shape.scaled_jacobian = wp.min(shape.scaled_jacobian, quotient(jacobian, lengths))
    return shape


@wp.func
def blank_shape() -> FaceShape:
    """Return the shape that corners and triangles are added to."""
    shape = FaceShape()
    shape.quality = wp.float64(1.0)
    shape.scaled_jacobian = wp.float64(1.0)
    shape.min_angle = TWO * PI
    return shape


@wp.func
def quad_shape(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, d: wp.vec3d) -> FaceShape:
    """Measure a quad; the normal at its centre is that of its two middle lines."""
    ab = b - a
    bc = c - b
    cd = d - c
    da = a - d
    normal = wp.normalize(wp.cross(ab - cd, bc - da))
    shape = blank_shape()
    shape = add_corner(shape, da, ab, normal)
    shape = add_corner(shape, ab, bc, normal)
    shape = add_corner(shape, bc, cd, normal)
    shape = add_corner(shape, cd, da, normal)
    shape.warpage = wp.max(
        angle_between(wp.cross(da, ab), wp.cross(bc, cd)), angle_between(wp.cross(ab, bc), wp.cross(cd, da))
    )
    if splits_along_02(a, b, c, d):
        shape = add_triangle(shape, a, b, c)
        shape = add_triangle(shape, a, c, d)
    else:
        shape = add_triangle(shape, a, b, d)
        shape = add_triangle(shape, b, c, d)
    return shape


@wp.func
def triangle_shape(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> FaceShape:
    """Measure a triangle."""
    shape = blank_shape()
    angles = wp.vec3d(angle_between(b - a, c - a), angle_between(a - b, c - b), angle_between(a - c, b - c))
    shape.min_angle = wp.min(angles)
    shape.max_angle = wp.max(angles)
    return add_triangle(shape, a, b, c)
