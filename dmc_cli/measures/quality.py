"""Measure the quality of a mesh: shape of its faces, angles, area, volume, bounds.

Definitions are in `shape.py`. Sums run in double precision over blocks of faces, then over the blocks in
their order: the same mesh gives the same figures, whatever the number of threads.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.measures.shape import blank_shape, chooses_02, quad_shape, triangle_shape, turn_angle
from dmc_cli.mesh import Mesh, require_mesh
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False})

BLOCK = wp.constant(256)
"""Faces, or points, that one thread sums over: many threads on a GPU, few partial sums."""

BINS = wp.constant(20)
"""Bins of the histogram of shape: 0 to 0.05, ..., 0.95 to 1."""

BINS_PER_UNIT = wp.constant(wp.float64(20.0))
"""`BINS` as the factor that it is: Warp does not convert a constant of another type."""

SUMS = wp.constant(4)
EXTREMES = wp.constant(5)


@dataclass(frozen=True, kw_only=True)
class Quality:
    """What the coordinates of a mesh say of it.

    Attributes:
        shape_mean: Mean of equation 9 over the quads; 1 on squares. None without quads, like the next four.
        shape_min: Least of equation 9.
        shape_histogram: Quads by equation 9, in 20 bins from 0 to 1.
        scaled_jacobian_min: Least of Verdict's scaled Jacobian; negative where a corner is reflex.
        warpage_max: Largest angle between the normals at opposite corners of a quad, degrees; 0 if planar.
            Verdict's warpage is the cube of its cosine.
        mean_ratio_mean: Mean of equation 8 over the triangles, quads split by the MaxMin-angle criterion.
            None without faces, like the next two.
        min_angle: Smallest angle at a corner, degrees.
        max_angle: Largest angle at a corner, degrees; over 180 at a reflex corner.
        area: Of all faces, quads split as above, in the unit of the coordinates squared.
        signed_volume: What the faces enclose, positive if they look outward; means nothing on an open mesh.
        bounds: Least and largest coordinates, ((x, y, z), (x, y, z)); None without points.
    """

    shape_mean: float | None
    shape_min: float | None
    shape_histogram: tuple[int, ...] | None
    scaled_jacobian_min: float | None
    warpage_max: float | None
    mean_ratio_mean: float | None
    min_angle: float | None
    max_angle: float | None
    area: float
    signed_volume: float
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]] | None


@wp.func
def point_at(points: wp.array[wp.vec3f], corner: wp.int32, origin: wp.vec3d) -> wp.vec3d:
    """Return a corner's position relative to `origin`, in double precision."""
    p = points[corner]
    return wp.vec3d(wp.float64(p[0]), wp.float64(p[1]), wp.float64(p[2])) - origin


@wp.kernel
def measure_faces_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    origin: wp.vec3d,
    # Out:
    sums_out: wp.array2d[wp.float64],
    extremes_out: wp.array2d[wp.float64],
    histogram_out: wp.array2d[wp.int32],
) -> None:
    """Sum the shapes of a block of faces. One thread per block.

    Sums: quality, ratio, area, volume. Extremes: least quality, scaled Jacobian and angle, largest angle and
    angle between normals, in radians.
    """
    block = first + wp.tid()
    total = blank_shape()
    total.quality = wp.float64(0.0)
    least_quality = wp.float64(1.0)
    for face in range(block * BLOCK, wp.min((block + 1) * BLOCK, corners.shape[0] / 4)):
        a = point_at(points, corners[4 * face], origin)
        b = point_at(points, corners[4 * face + 1], origin)
        c = point_at(points, corners[4 * face + 2], origin)
        shape = blank_shape()
        if corners[4 * face + 3] < 0:
            shape = triangle_shape(a, b, c)
        else:
            shape = quad_shape(a, b, c, point_at(points, corners[4 * face + 3], origin))
            total.quality += shape.quality
            bin = wp.clamp(wp.int32(shape.quality * BINS_PER_UNIT), 0, BINS - 1)
            histogram_out[block, bin] = histogram_out[block, bin] + 1
        least_quality = wp.min(least_quality, shape.quality)
        total.ratio += shape.ratio
        total.area += shape.area
        total.volume += shape.volume
        total.scaled_jacobian = wp.min(total.scaled_jacobian, shape.scaled_jacobian)
        total.min_turn = wp.min(total.min_turn, shape.min_turn)
        total.max_turn = wp.max(total.max_turn, shape.max_turn)
        total.warp_turn = wp.max(total.warp_turn, shape.warp_turn)
    sums_out[block, 0] = total.quality
    sums_out[block, 1] = total.ratio
    sums_out[block, 2] = total.area
    sums_out[block, 3] = total.volume
    extremes_out[block, 0] = least_quality
    extremes_out[block, 1] = total.scaled_jacobian
    extremes_out[block, 2] = turn_angle(total.min_turn)
    extremes_out[block, 3] = turn_angle(total.max_turn)
    extremes_out[block, 4] = turn_angle(total.warp_turn)


@wp.kernel
def bound_points_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    # Out:
    lows_out: wp.array[wp.vec3f],
    highs_out: wp.array[wp.vec3f],
) -> None:
    """Find the box round a block of points. One thread per block."""
    block = first + wp.tid()
    low = points[block * BLOCK]
    high = low
    for p in range(block * BLOCK + 1, wp.min((block + 1) * BLOCK, points.shape[0])):
        low = wp.min(low, points[p])
        high = wp.max(high, points[p])
    lows_out[block] = low
    highs_out[block] = high


@wp.kernel
def choose_diagonals_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    # Out:
    diagonals_out: wp.array[wp.uint8],
) -> None:
    """Choose the diagonal of the MaxMin-angle split: 0 joins corners 0 and 2, 1 joins 1 and 3.

    One thread per quad.
    """
    q = first + wp.tid()
    origin = wp.vec3d()
    a = point_at(points, corners[4 * q], origin)
    b = point_at(points, corners[4 * q + 1], origin)
    c = point_at(points, corners[4 * q + 2], origin)
    d = point_at(points, corners[4 * q + 3], origin)
    diagonal = int(1)
    if chooses_02(a, b, c, d):
        diagonal = 0
    diagonals_out[q] = wp.uint8(diagonal)


def choose_diagonals(mesh: Mesh) -> Any:
    """Return the diagonal that splits each quad of a mesh by the MaxMin-angle criterion, (Q,) uint8.

    0 joins corners 0 and 2, also on a tie; 1 joins corners 1 and 3.
    """
    diagonals = mesh.device.empty(mesh.face_count, wp.uint8)
    mesh.device.launch(choose_diagonals_kernel, mesh.face_count, [mesh.positions, mesh.corners], [diagonals])
    return diagonals


def measure_quality(mesh: Mesh) -> Quality:
    """Measure the shape of all faces, triangles and quads, in any unit of length.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    require_mesh(mesh)
    device, points = mesh.device, mesh.positions
    bounds = _bounds(device, points)
    origin = np.mean(bounds, axis=0) if bounds else np.zeros(3)
    corners = mesh.corners
    blocks = -(-mesh.face_count // int(BLOCK))
    sums = device.empty((blocks, int(SUMS)), wp.float64)
    extremes = device.empty((blocks, int(EXTREMES)), wp.float64)
    histogram = device.zeros((blocks, int(BINS)), wp.int32)
    device.launch(
        measure_faces_kernel,
        blocks,
        inputs=[points, corners, wp.vec3d(*origin.tolist())],
        outputs=[sums, extremes, histogram],
    )
    counts = histogram.numpy().sum(axis=0, dtype=np.int64)
    quads = int(counts.sum())
    totals = sums.numpy().sum(axis=0).tolist()
    lows = extremes.numpy().min(axis=0, initial=math.inf)
    highs = extremes.numpy().max(axis=0, initial=-math.inf)
    triangles = mesh.face_count + quads
    return Quality(
        shape_mean=totals[0] / quads if quads else None,
        shape_min=float(lows[0]) if quads else None,
        shape_histogram=tuple(counts.tolist()) if quads else None,
        scaled_jacobian_min=float(lows[1]) if quads else None,
        warpage_max=math.degrees(highs[4]) if quads else None,
        mean_ratio_mean=totals[1] / triangles if triangles else None,
        min_angle=math.degrees(lows[2]) if triangles else None,
        max_angle=math.degrees(highs[3]) if triangles else None,
        area=totals[2],
        signed_volume=totals[3],
        bounds=bounds,
    )


def _bounds(device: Device, points: Any) -> Any:
    """Return the box round all points, or None without points."""
    blocks = -(-points.shape[0] // int(BLOCK))
    lows = device.empty(blocks, wp.vec3f)
    highs = device.empty(blocks, wp.vec3f)
    device.launch(bound_points_kernel, blocks, inputs=[points], outputs=[lows, highs])
    if not blocks:
        return None
    return tuple(lows.numpy().min(axis=0).tolist()), tuple(highs.numpy().max(axis=0).tolist())
