"""Measure how far the fine mesh and the coarse one are apart while quads are taken away.

Every vertex of the fine mesh is a tracked point, assigned to a quad near it. From the fine side, a point's
distance is that from its quad, as a surface of two triangles, whichever diagonal splits it. From the coarse
side, the distance of a sample of a quad is that from the tangent plane of the nearest of the points that the
patch has, as long as that point is beside it. Neither needs the field, so both hold for quads of any size.

Distances are in units of the frame that the mesh is changed in.
"""

import warp as wp

from dmc_cli.runtime import native

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
        has_field: Whether the surface is a field's; else it is the planes at the points.
    """

    place: wp.array(dtype=wp.vec3)
    normal: wp.array(dtype=wp.vec3)
    copies: wp.array3d(dtype=wp.float32)
    farthest: wp.float32
    highest: wp.float32
    reach: wp.float32
    spacing: wp.float32
    least_shape: wp.float32
    has_field: wp.bool


@wp.func_native(native(__file__, "distance_from_triangles"))
def distance_from_triangles(
    corners: wp.array(dtype=wp.int32), position: wp.array(dtype=wp.vec3), q: wp.int32, p: wp.vec3
) -> wp.float32:
    """Return a point's distance from a quad as two triangles, by the diagonal that makes it larger."""
    ...


@wp.func_native(native(__file__, "nearest_round"))
def nearest_round(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    q: wp.int32,
    p: wp.vec3,
) -> wp.int32:
    """Return the nearest to a point of a quad, those across its sides and the next ones round their ends."""
    ...


@wp.func_native(native(__file__, "assign_listed"))
def assign_listed(
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    face_gone: wp.array(dtype=wp.uint8),
    patch: wp.array2d(dtype=wp.int32),
    patched: wp.int32,
    place: wp.array(dtype=wp.vec3),
    nearest_quad: wp.array(dtype=wp.int32),
    listed: wp.array2d(dtype=wp.int32),
    b: wp.int32,
    count: wp.int32,
    farthest: wp.float32,
    new_nearest: wp.array2d(dtype=wp.int32),
) -> wp.bool:
    """Assign each listed point to its quad as long as it is near enough, else to the nearest of the patch.

    Return whether none is farther than `farthest` from all of them.
    """
    ...
