"""Split quads into two triangles, by the MaxMin-angle criterion that area and volume are measured by.

A face is handed on as four points of which the first and third end the diagonal; a triangle has its third
corner twice, so that its second triangle has no area.
"""

from typing import Any

import warp as wp

from dmc_cli.measures.shape import chooses_02
from dmc_cli.mesh import Mesh
from dmc_cli.runtime import ITEMS_A_CHUNK

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

QuadPoints = wp.types.matrix(shape=(4, 3), dtype=wp.float32)
"""Corners of a face; the diagonal runs from the first to the third. A triangle has its third corner twice."""


@wp.func
def double_point(p: wp.vec3f) -> wp.vec3d:
    """Return a point in double precision."""
    return wp.vec3d(wp.float64(p[0]), wp.float64(p[1]), wp.float64(p[2]))


@wp.kernel
def split_faces_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    # Out:
    turns_out: wp.array[wp.uint8],
) -> None:
    """Find the corner that a face's diagonal starts from, 0 or 1. One thread per face."""
    f = first + wp.tid()
    turn = int(0)
    if corners[4 * f + 3] >= 0:
        a = double_point(points[corners[4 * f]])
        b = double_point(points[corners[4 * f + 1]])
        c = double_point(points[corners[4 * f + 2]])
        if not chooses_02(a, b, c, double_point(points[corners[4 * f + 3]])):
            turn = 1
    turns_out[f] = wp.uint8(turn)


@wp.func
def face_points(
    points: wp.array[wp.vec3f], corners: wp.array[wp.int32], turns: wp.array[wp.uint8], f: wp.int32
) -> QuadPoints:
    """Return the corners of a face, from that on which its diagonal starts from."""
    turn = wp.int32(turns[f])
    last = corners[4 * f + ((3 + turn) & 3)]
    if last < 0:
        last = corners[4 * f + 2]
    return wp.matrix_from_rows(
        points[corners[4 * f + turn]],
        points[corners[4 * f + 1 + turn]],
        points[corners[4 * f + ((2 + turn) & 3)]],
        points[last],
    )


def split_faces(mesh: Mesh) -> Any:
    """Return the corner that each face's diagonal starts from, uint8 (F,): 0, also of triangles, or 1."""
    turns = mesh.device.empty(mesh.face_count, wp.uint8)
    inputs = [mesh.positions, mesh.corners]
    mesh.device.launch(split_faces_kernel, mesh.face_count, inputs, [turns], ITEMS_A_CHUNK)
    return turns
