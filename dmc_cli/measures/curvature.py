"""Measure the curvature of a mesh at its vertices: mean and Gaussian.

The discrete operators of Meyer et al. 2003 (*Discrete differential-geometry operators for triangulated
2-manifolds*): the mean curvature normal from the cotangents of the angles opposite to each edge, the Gaussian
curvature from the angle that is missing to a full turn, both over the mixed area of the vertex. Quads are
split by the MaxMin-angle criterion. Vertices on a boundary, of several fans, of no face and without an area
have no curvature. It is positive where the surface bends away from its normal: 1/r and 1/r^2 on a sphere.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import Float64Array
from dmc_cli.measures.split_faces import QuadPoints, double_point, face_points, split_faces
from dmc_cli.measures.verdict import UNDEFINED
from dmc_cli.mesh import Mesh, connect, next_outgoing_of_any
from dmc_cli.runtime import ITEMS_A_CHUNK

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

ZERO = wp.constant(wp.float64(0.0))
HALF = wp.constant(wp.float64(0.5))
QUARTER = wp.constant(wp.float64(0.25))
EIGHTH = wp.constant(wp.float64(0.125))
FOUR = wp.constant(wp.float64(4.0))
FULL_TURN = wp.constant(wp.float64(6.283185307179586))


@wp.struct
class Bend:
    """What is summed round a vertex: edges by their cotangents, normals by area, mixed area, angles."""

    edges: wp.vec3d
    normals: wp.vec3d
    area: wp.float64
    angle: wp.float64


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Curvature over the vertices that have one; None without any.

    Attributes:
        mean: Mean over the area.
        rms: Root of the mean square over the area.
        min: Least.
        percentile_5: What 5 % of the vertices do not exceed.
        percentile_95: What 95 % of them do not exceed.
        max: Largest.
    """

    mean: float | None
    rms: float | None
    min: float | None
    percentile_5: float | None
    percentile_95: float | None
    max: float | None


@dataclass(frozen=True, kw_only=True)
class Curvature:
    """Curvature of a mesh, in reciprocals of the unit of its coordinates.

    Attributes:
        vertices: Vertices that have a curvature.
        mean: Mean curvature, half the sum of the principal ones.
        gaussian: Gaussian curvature, their product.
        total_gaussian: Its integral: 2 pi times the Euler characteristic on a closed mesh.
    """

    vertices: int
    mean: Spread
    gaussian: Spread
    total_gaussian: float


@wp.func
def add_corner(bend: Bend, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> Bend:
    """Return `bend` with the corner at `a` of the triangle a b c added, nothing if it has no area."""
    ab = b - a
    ac = c - a
    bc = c - b
    normal = wp.cross(ab, ac)
    twice_area = wp.length(normal)
    if twice_area > ZERO:
        cosine_a = wp.dot(ab, ac)
        cosine_b = -wp.dot(ab, bc)
        cosine_c = wp.dot(ac, bc)
        bend.edges -= (cosine_c / twice_area) * ab + (cosine_b / twice_area) * ac
        bend.normals += normal
        bend.angle += wp.atan2(twice_area, cosine_a)
        if cosine_a < ZERO:
            bend.area += QUARTER * twice_area
        elif cosine_b < ZERO or cosine_c < ZERO:
            bend.area += EIGHTH * twice_area
        else:
            squares = wp.length_sq(ab) * cosine_c + wp.length_sq(ac) * cosine_b
            bend.area += EIGHTH * squares / twice_area
    return bend


@wp.func
def add_face(bend: Bend, face: QuadPoints, corner: wp.int32, is_triangle: wp.bool) -> Bend:
    """Return `bend` with the triangles at a face's corner added; corners count from the diagonal's start."""
    here = double_point(face[corner])
    if is_triangle:
        b = double_point(face[(corner + 1) % 3])
        return add_corner(bend, here, b, double_point(face[(corner + 2) % 3]))
    following = double_point(face[(corner + 1) & 3])
    opposite = double_point(face[(corner + 2) & 3])
    before = double_point(face[(corner + 3) & 3])
    if (corner & 1) == 1:
        return add_corner(bend, here, following, before)
    return add_corner(add_corner(bend, here, following, opposite), here, opposite, before)


@wp.kernel
def measure_curvature_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    turns: wp.array[wp.uint8],
    twin: wp.array[wp.int32],
    vertex_halfedge: wp.array[wp.int32],
    valence: wp.array[wp.int32],
    # Out:
    curvatures_out: wp.array[wp.vec3d],
) -> None:
    """Find mean and Gaussian curvature and the mixed area of a vertex, NaN where it has none.

    One thread per vertex.
    """
    v = first + wp.tid()
    bend = Bend()
    start = vertex_halfedge[v]
    h = int(start)
    size = int(0)
    while h >= 0 and size < valence[v]:
        f = h >> 2
        corner = ((h & 3) - wp.int32(turns[f])) & 3
        bend = add_face(bend, face_points(points, corners, turns, f), corner, corners[4 * f + 3] < 0)
        size += 1
        h = next_outgoing_of_any(corners, twin, h)
        if h == start:
            break
    if start >= 0 and h == start and size == valence[v] and bend.area > ZERO:
        mean = wp.length(bend.edges) / (FOUR * bend.area)
        if wp.dot(bend.edges, bend.normals) < ZERO:
            mean = -mean
        curvatures_out[v] = wp.vec3d(mean, (FULL_TURN - bend.angle) / bend.area, bend.area)
    else:
        curvatures_out[v] = wp.vec3d(UNDEFINED, UNDEFINED, UNDEFINED)


def list_curvature(mesh: Mesh) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return mean curvature, Gaussian curvature and mixed area of each vertex, (V,), NaN where it has none.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    mesh = connect(mesh)
    halfedges, device = mesh.require_halfedges(), mesh.device
    found = device.empty(mesh.vertex_count, wp.vec3d)
    inputs = [mesh.positions, mesh.corners, split_faces(mesh)]
    inputs += [halfedges.twin, halfedges.vertex_halfedge, halfedges.valence]
    device.launch(measure_curvature_kernel, mesh.vertex_count, inputs, [found], ITEMS_A_CHUNK)
    mean, gaussian, area = found.numpy().reshape(-1, 3).T
    return mean, gaussian, area


def measure_curvature(mesh: Mesh) -> Curvature:
    """Measure the curvature of a mesh.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    mean, gaussian, area = list_curvature(mesh)
    is_known = ~np.isnan(area)
    weights = area[is_known]
    return Curvature(
        vertices=int(is_known.sum()),
        mean=_spread(mean[is_known], weights),
        gaussian=_spread(gaussian[is_known], weights),
        total_gaussian=float((gaussian[is_known] * weights).sum()),
    )


def _spread(values: Any, weights: Any) -> Spread:
    """Return what is told of a curvature by vertex."""
    if not len(values):
        return Spread(mean=None, rms=None, min=None, percentile_5=None, percentile_95=None, max=None)
    low, high = np.percentile(values, (5, 95))
    total = weights.sum()
    return Spread(
        mean=float((values * weights).sum() / total),
        rms=float(np.sqrt((np.square(values) * weights).sum() / total)),
        min=float(values.min()),
        percentile_5=float(low),
        percentile_95=float(high),
        max=float(values.max()),
    )
