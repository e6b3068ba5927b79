"""Decide exactly how points and triangles with float32 coordinates lie to each other.

A determinant in double precision tells its sign unless it is smaller than its rounding error may be; then it
is summed without any (Shewchuk 1997, *Adaptive precision floating-point arithmetic and fast robust geometric
predicates*). Products of three float32 numbers are sums of two doubles and never too large or too small for
them, so the answers hold for all coordinates. The header has the code: Warp has no lists.
"""

import warp as wp

from dmc_cli.measures.split_faces import QuadPoints
from dmc_cli.runtime import native

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.func_native(native(__file__, "plane_side"))
def plane_side(a: wp.vec3f, b: wp.vec3f, c: wp.vec3f, d: wp.vec3f) -> wp.int32:
    """Return 1 if `d` is below the plane of the triangle a b c, which runs anticlockwise seen from above it.

    -1 if it is above, 0 if it is in the plane.
    """
    ...


@wp.func_native(native(__file__, "line_side"))
def line_side(a: wp.vec3f, b: wp.vec3f, c: wp.vec3f, axis: wp.int32) -> wp.int32:
    """Return 1 if the triangle a b c runs anticlockwise seen from the far end of an axis, -1 or 0 if not."""
    ...


@wp.func_native(native(__file__, "triangles_meet"))
def triangles_meet(a: wp.vec3f, b: wp.vec3f, c: wp.vec3f, d: wp.vec3f, e: wp.vec3f, f: wp.vec3f) -> wp.bool:
    """Return whether triangles a b c and d e f have more in common than corners and sides that both have.

    A corner is the same where its position is. A triangle without an area has nothing in common with any.
    """
    ...


@wp.func_native(native(__file__, "are_apart"))
def are_apart(face: QuadPoints, other: QuadPoints) -> wp.bool:
    """Return whether a side of a face, seen along an axis, has it on one side and another face on the other.

    Both may have its ends: then they are all that both have in common. False does not mean that they meet.
    """
    ...
