"""Find faces near something: a tree of boxes over the faces of a mesh.

Faces are put in the order of a curve that fills space (Morton 1966), which keeps neighbours together. Boxes
of eight in a row are joined to one of the next level, and so on, so that the tree needs no pointers: child c
of box n of a level is box 8n + c of the level below. The order of boxes that a walk sees is always the same.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import FloatArray
from dmc_cli.mesh.mesh import Mesh, require_mesh
from dmc_cli.runtime import native, view

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

CHILDREN = wp.constant(8)
"""Boxes that are joined to one."""

LEVELS = 13
"""Most levels: as many as 2^31 faces have, with that of the faces, and the end."""

Levels = wp.types.vector(length=LEVELS, dtype=wp.int32)
Masks = wp.types.vector(length=LEVELS, dtype=wp.uint32)
"""A number, or children that are yet to be looked at, for each level."""

CELLS = 1024
"""Cells of the curve along the longest side: its numbers have 30 bits."""


@dataclass(frozen=True)
class BoxTree:
    """Boxes of faces, level by level.

    Attributes:
        order: int32 (F,), the faces along the curve.
        lows: vec3f (N,), the least coordinates of each box: those of the faces in this order, then of eight
            faces each, and so on up to a single one.
        highs: vec3f (N,), the largest.
        starts: Where each level begins in both; what follows the last level is the end.
        top: The level of the single box, 0 with one face and less.
    """

    order: Any
    lows: Any
    highs: Any
    starts: Any
    top: int

    def level_size(self, level: int) -> int:
        """Count the boxes of a level."""
        return int(self.starts[level + 1]) - int(self.starts[level])


def build_tree(mesh: Mesh) -> BoxTree:
    """Return the tree over the faces of a mesh.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    require_mesh(mesh)
    device, count = mesh.device, mesh.face_count
    order = _along_curve(mesh)
    sizes = [count]
    while sizes[-1] > 1:
        sizes.append(-(-sizes[-1] // int(CHILDREN)))
    starts = np.concatenate([[0], np.cumsum(sizes)])
    lows, highs = device.empty(int(starts[-1]), wp.vec3f), device.empty(int(starts[-1]), wp.vec3f)
    device.launch(bound_faces_kernel, count, [mesh.positions, mesh.corners, order], [lows, highs])
    for level in range(1, len(sizes)):
        inputs = [int(starts[level - 1]), int(starts[level])]
        device.launch(join_boxes_kernel, sizes[level], inputs, [lows, highs])
    padded = [*starts.tolist(), *[0] * (LEVELS - len(starts))]
    return BoxTree(order, lows, highs, Levels(*padded), len(sizes) - 1)


def curve_frame(points: FloatArray) -> tuple[Any, float]:
    """Return the least corner of the box round points, (N, 3), and how many cells of the curve a unit has."""
    low, high = points.min(axis=0).astype(np.float64), points.max(axis=0).astype(np.float64)
    extent = float((high - low).max())
    return wp.vec3d(*low.tolist()), (CELLS - 1) / extent if extent else 0.0


def _along_curve(mesh: Mesh) -> Any:
    """Return the faces in the order of the curve, int32 (F,)."""
    device, count = mesh.device, mesh.face_count
    if not count:
        return device.empty(0, wp.int32)
    inputs = [mesh.positions, mesh.corners, *curve_frame(mesh.positions.numpy())]
    keys, items = device.empty(2 * count, wp.int32), device.empty(2 * count, wp.int32)
    device.launch(number_faces_kernel, count, inputs, [keys, items])
    wp.utils.radix_sort_pairs(keys, items, count)
    return view(items, wp.int32, count)


@wp.func
def spread_bits(x: wp.int32) -> wp.int32:
    """Return ten bits with two zeros before each."""
    bits = (x | (x << 16)) & 0x030000FF
    bits = (bits | (bits << 8)) & 0x0300F00F
    bits = (bits | (bits << 4)) & 0x030C30C3
    return (bits | (bits << 2)) & 0x09249249


@wp.func
def curve_number(p: wp.vec3d, low: wp.vec3d, scale: wp.float64) -> wp.int32:
    """Return the number of a point along the curve; `low` is the least corner of the box round all."""
    at = (p - low) * scale
    i = spread_bits(wp.clamp(wp.int32(at[0]), 0, 1023))
    j = spread_bits(wp.clamp(wp.int32(at[1]), 0, 1023))
    k = spread_bits(wp.clamp(wp.int32(at[2]), 0, 1023))
    return i | (j << 1) | (k << 2)


@wp.kernel
def number_faces_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    low: wp.vec3d,
    scale: wp.float64,
    # Out:
    keys_out: wp.array[wp.int32],
    items_out: wp.array[wp.int32],
) -> None:
    """Give a face a number along the curve: that of the middle between two corners. One thread per face."""
    f = first + wp.tid()
    p = points[corners[4 * f]]
    q = points[corners[4 * f + 2]]
    first_corner = wp.vec3d(wp.float64(p[0]), wp.float64(p[1]), wp.float64(p[2]))
    third_corner = wp.vec3d(wp.float64(q[0]), wp.float64(q[1]), wp.float64(q[2]))
    keys_out[f] = curve_number(wp.float64(0.5) * (first_corner + third_corner), low, scale)
    items_out[f] = f


@wp.kernel
def bound_faces_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    order: wp.array[wp.int32],
    # Out:
    lows_out: wp.array[wp.vec3f],
    highs_out: wp.array[wp.vec3f],
) -> None:
    """Find the box of a face. One thread per place in the order."""
    n = first + wp.tid()
    f = order[n]
    low = points[corners[4 * f]]
    high = low
    for c in range(1, 4):
        v = corners[4 * f + c]
        if v >= 0:
            low = wp.min(low, points[v])
            high = wp.max(high, points[v])
    lows_out[n] = low
    highs_out[n] = high


@wp.kernel
def join_boxes_kernel(
    first: wp.int32,
    # In:
    below: wp.int32,
    here: wp.int32,
    # In/out:
    lows_inout: wp.array[wp.vec3f],
    highs_inout: wp.array[wp.vec3f],
) -> None:
    """Join the boxes of a level that begins at `below` to those of the next, which follows it.

    One thread per box of the next level.
    """
    n = first + wp.tid()
    start = below + CHILDREN * n
    low = lows_inout[start]
    high = highs_inout[start]
    for child in range(start + 1, wp.min(start + CHILDREN, here)):
        low = wp.min(low, lows_inout[child])
        high = wp.max(high, highs_inout[child])
    lows_inout[here + n] = low
    highs_inout[here + n] = high


@wp.func_native(native(__file__, "boxes_near"))
def boxes_near(
    lows: wp.array(dtype=wp.vec3),
    highs: wp.array(dtype=wp.vec3),
    start: wp.int32,
    count: wp.int32,
    p: wp.vec3d,
    reach: wp.float64,
) -> wp.uint32:
    """Return a bit for each of `count` boxes from `start` on: the square of its distance is below `reach`."""
    ...


@wp.func_native(native(__file__, "boxes_on_ray"))
def boxes_on_ray(
    lows: wp.array(dtype=wp.vec3),
    highs: wp.array(dtype=wp.vec3),
    start: wp.int32,
    count: wp.int32,
    p: wp.vec3d,
    inverse: wp.vec3d,
    reach: wp.float64,
) -> wp.uint32:
    """Return a bit for each of `count` boxes from `start` on: a ray meets it no farther than `reach`.

    The ray starts at `p`; `inverse` are the inverses of its direction's parts, none of them infinite. Boxes
    count as larger by a billionth of their size and place, for the rounding.
    """
    ...


@wp.func_native(native(__file__, "boxes_meeting"))
def boxes_meeting(
    lows: wp.array(dtype=wp.vec3),
    highs: wp.array(dtype=wp.vec3),
    start: wp.int32,
    count: wp.int32,
    box: wp.int32,
) -> wp.uint32:
    """Return a bit for each of `count` boxes, from `start` on: it has a point in common with box `box`."""
    ...


@wp.func
def child_count(levels: Levels, level: wp.int32, n: wp.int32) -> wp.int32:
    """Count the boxes of a level that are joined to box `n` of the next one."""
    return wp.min(CHILDREN, levels[level + 1] - levels[level] - CHILDREN * n)
