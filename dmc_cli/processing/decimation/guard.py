"""Measure how far the fine mesh and the coarse one are apart while quads are taken away.

Every vertex of the fine mesh is a tracked point, assigned to a quad near it. From the fine side, a point's
distance is that from its quad, as a surface of two triangles, whichever diagonal splits it. From the coarse
side, the distance of a sample of a quad is that from the tangent plane of the nearest of the points that the
patch has, as long as that point is beside it. Neither needs the field, so both hold for quads of any size.

Distances are in units of the frame that the mesh is changed in.
"""

import warp as wp

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

NOWHERE = wp.constant(1.0e30)
"""Square of the distance of a sample from which no tracked point is known."""


MOST_STEPS = wp.constant(12)
"""Steps from sample to sample along a side of a quad, at most."""


@wp.struct
class Guard:
    """The tracked points' places and normals, vec3 (G,), and what holds for the round.

    Attributes:
        place: Where each point is in the frame.
        normal: The surface's unit normal there, or 0.
        copies: (R, 6, points), the places and normals of the points that each region has listed.
        farthest: How far a point may be from its quad.
        highest: How far samples of a quad may be from the surface.
        reach: How far beside a sample the point may be that says what its height is.
        spacing: How far apart the samples of a quad are, `MOST_STEPS` a side at most; two steps at least.
        least_shape: Shapes below this must not become worse.
    """

    place: wp.array(dtype=wp.vec3)
    normal: wp.array(dtype=wp.vec3)
    copies: wp.array3d(dtype=wp.float32)
    farthest: wp.float32
    highest: wp.float32
    reach: wp.float32
    spacing: wp.float32
    least_shape: wp.float32


@wp.func
def squared_distance_from_segment(p: wp.vec3, a: wp.vec3, b: wp.vec3) -> wp.float32:
    """Return the square of a point's distance from a segment."""
    along = b - a
    size = wp.dot(along, along)
    t = float(0.0)
    if size > 0.0:
        t = wp.clamp(wp.dot(p - a, along) / size, 0.0, 1.0)
    return wp.length_sq(p - a - t * along)


@wp.func
def squared_distance_from_triangle(p: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3) -> wp.float32:
    """Return the square of a point's distance from a triangle."""
    normal = wp.cross(b - a, c - a)
    size = wp.dot(normal, normal)
    inside = size > 0.0
    inside = inside and wp.dot(wp.cross(b - a, p - a), normal) >= 0.0
    inside = inside and wp.dot(wp.cross(c - b, p - b), normal) >= 0.0
    inside = inside and wp.dot(wp.cross(a - c, p - c), normal) >= 0.0
    if inside:
        height = wp.dot(p - a, normal)
        return height * height / size
    return wp.min(
        wp.min(squared_distance_from_segment(p, a, b), squared_distance_from_segment(p, b, c)),
        squared_distance_from_segment(p, c, a),
    )


@wp.func
def distance_from_triangles(
    corners: wp.array(dtype=wp.int32), position: wp.array(dtype=wp.vec3), q: wp.int32, p: wp.vec3
) -> wp.float32:
    """Return a point's distance from a quad as two triangles, by the diagonal that makes it larger."""
    a = position[corners[4 * q]]
    b = position[corners[4 * q + 1]]
    c = position[corners[4 * q + 2]]
    d = position[corners[4 * q + 3]]
    one = wp.min(squared_distance_from_triangle(p, a, b, c), squared_distance_from_triangle(p, a, c, d))
    other = wp.min(squared_distance_from_triangle(p, a, b, d), squared_distance_from_triangle(p, b, c, d))
    return wp.sqrt(wp.max(one, other))
