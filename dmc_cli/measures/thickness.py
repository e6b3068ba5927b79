"""Measure the wall thickness of a mesh at its vertices, by rays that go inward.

From each vertex a ray goes against the vertex's normal, the sum of the normals of its faces by area, to the
first face that it leaves the solid through (Yezzi & Prince 2003 name this way of measuring, among others). A
face that the vertex is a corner of counts for nothing. Faces look outward; where a closed mesh looks inward,
rays go the other way.

Quads are split by the MaxMin-angle criterion; all is in double precision. A walk through the tree of boxes
looks no further than a reach, which begins with what the vertex before has found and grows until there is a
hit.
"""

import math
from dataclasses import dataclass

import numpy as np
import warp as wp

from dmc_cli.array_types import Float64Array
from dmc_cli.bits import bit_index
from dmc_cli.errors import SettingsError
from dmc_cli.measures.quality import measure_quality
from dmc_cli.measures.split_faces import double_point, face_points, split_faces
from dmc_cli.mesh import (
    CHILDREN,
    Levels,
    Masks,
    Mesh,
    area_vectors,
    boxes_on_ray,
    build_tree,
    child_count,
    require_mesh,
    vertex_normals,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

RUN = wp.constant(32)
"""Vertices that one thread measures, one after the other."""

ZERO = wp.constant(wp.float64(0.0))
INFINITE = wp.constant(wp.float64(math.inf))

GUESS = wp.constant(wp.float64(1.5))
GROWTH = wp.constant(wp.float64(4.0))
"""How much farther than the vertex before the first reach goes, and than the reach before every other one."""

SLACK = wp.constant(wp.float64(1e-9))
"""Share of a triangle that a ray may pass beside it: rays along shared sides hit one of both."""

SMALLEST = wp.constant(wp.float64(1e-12))
"""A part of a direction that is smaller counts as that large where boxes are looked at."""


@dataclass(frozen=True, kw_only=True)
class Thickness:
    """Wall thickness of a mesh, in the unit of its coordinates; None where no ray has met a wall.

    Attributes:
        vertices: Vertices whose ray has met one.
        min: Least thickness.
        percentile_5: What 5 % of the area, shared out to vertices, do not exceed.
        median: What half of it does not exceed.
        max: Largest.
        limit: The wall that was asked for, or None.
        percent_below: Share of the area that is thinner than that.
    """

    vertices: int
    min: float | None
    percentile_5: float | None
    median: float | None
    max: float | None
    limit: float | None = None
    percent_below: float | None = None


def measure_thickness(mesh: Mesh, limit: float | None = None) -> Thickness:
    """Measure the wall thickness.

    Args:
        mesh: The mesh; faces look outward, or all inward if it is closed.
        limit: A wall, in the unit of the coordinates: how much of the area is thinner is told.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
        SettingsError: The limit is no positive number.
    """
    if limit is not None and not 0 < limit < math.inf:
        raise SettingsError(f"the wall's limit is {limit}; expected a positive length")
    values = list_thickness(mesh)
    has_wall = np.isfinite(values)
    if not has_wall.any():
        return Thickness(vertices=0, min=None, percentile_5=None, median=None, max=None, limit=limit)
    found, shares = values[has_wall], _area_shares(mesh)[has_wall]
    order = np.argsort(found, kind="stable")
    sums = np.cumsum(shares[order])
    total = float(sums[-1])

    def not_exceeded_by(share: float) -> float:
        return float(found[order[min(int(np.searchsorted(sums, share * total)), len(order) - 1)]])

    below = None if limit is None else 100.0 * float(shares[found < limit].sum()) / total
    return Thickness(
        vertices=len(found),
        min=float(found[order[0]]),
        percentile_5=not_exceeded_by(0.05),
        median=not_exceeded_by(0.5),
        max=float(found[order[-1]]),
        limit=limit,
        percent_below=below,
    )


def list_thickness(mesh: Mesh) -> Float64Array:
    """Return the wall thickness at each vertex, (V,) float64; NaN where a ray meets no wall.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    count = require_mesh(mesh).vertex_count
    if not mesh.face_count:
        return np.full(count, np.nan)
    device, tree = mesh.device, build_tree(mesh)
    sense = -1.0 if measure_quality(mesh).signed_volume < 0 else 1.0
    points = mesh.positions.numpy()
    inwards = -sense * vertex_normals(points, mesh.faces.numpy())
    directions = wp.array(inwards, dtype=wp.vec3d, device=device.name)
    extent = float(np.linalg.norm(points.max(axis=0).astype(float) - points.min(axis=0)))
    found = device.empty(count, wp.float64)
    inputs = [mesh.positions, mesh.corners, split_faces(mesh), tree.order, tree.lows, tree.highs, tree.starts]
    inputs += [tree.top, directions, sense, 2.0 * extent]
    device.launch(find_walls_kernel, -(-count // int(RUN)), inputs, [found], 4, 256)
    values: Float64Array = found.numpy().copy()
    values[~np.isfinite(values)] = np.nan
    return values


def _area_shares(mesh: Mesh) -> Float64Array:
    """Return the area that each vertex has of its faces, shared out evenly, (V,)."""
    corners = mesh.faces.numpy()
    areas = np.linalg.norm(area_vectors(mesh.positions.numpy(), corners), axis=1)
    shares = areas / np.where(corners[:, 3] < 0, 3.0, 4.0)
    has_corner = corners >= 0
    weights = np.broadcast_to(shares[:, None], corners.shape)[has_corner]
    return np.asarray(
        np.bincount(corners[has_corner], weights=weights, minlength=mesh.vertex_count), np.float64
    )


@wp.func
def bounded_inverse(part: wp.float64) -> wp.float64:
    """Return the inverse of a part of a direction, never an infinite one."""
    size = wp.max(wp.abs(part), SMALLEST)
    return wp.where(part < ZERO, wp.float64(-1.0), wp.float64(1.0)) / size


@wp.func
def wall_distance(
    p: wp.vec3d,
    along: wp.vec3d,
    a: wp.vec3d,
    b: wp.vec3d,
    c: wp.vec3d,
    sense: wp.float64,
    least: wp.float64,
) -> wp.float64:
    """Return the lesser of `least` and how far along a ray it leaves a solid through a triangle.

    Triangles look out of the solid where `sense` is 1, into it where it is -1. By Moller & Trumbore 1997.
    """
    ab = b - a
    ac = c - a
    across = wp.cross(ac, along)  # type: ignore[arg-type]
    steepness = wp.dot(across, ab)
    distance = least
    if sense * steepness > ZERO:  # the ray goes out
        offset = p - a
        u = wp.dot(offset, across) / steepness
        turned = wp.cross(offset, ab)
        v = -wp.dot(along, turned) / steepness
        t = -wp.dot(ac, turned) / steepness
        if u >= -SLACK and v >= -SLACK and u + v <= wp.float64(1.0) + SLACK and t > ZERO and t < least:
            distance = t
    return distance


@wp.func
def wall_of_face(
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    turns: wp.array[wp.uint8],
    f: wp.int32,
    vertex: wp.int32,
    p: wp.vec3d,
    along: wp.vec3d,
    sense: wp.float64,
    least: wp.float64,
) -> wp.float64:
    """Return the lesser of `least` and how far along a vertex's ray it leaves a solid through a face.

    A face that the vertex is a corner of counts for nothing.
    """
    is_own = corners[4 * f] == vertex or corners[4 * f + 1] == vertex
    if is_own or corners[4 * f + 2] == vertex or corners[4 * f + 3] == vertex:
        return least
    face = face_points(points, corners, turns, f)
    a = double_point(face[0])
    c = double_point(face[2])
    distance = wall_distance(p, along, a, double_point(face[1]), c, sense, least)
    if corners[4 * f + 3] >= 0:
        distance = wall_distance(p, along, a, c, double_point(face[3]), sense, distance)
    return distance


@wp.kernel
def find_walls_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    turns: wp.array[wp.uint8],
    order: wp.array[wp.int32],
    lows: wp.array[wp.vec3f],
    highs: wp.array[wp.vec3f],
    levels: Levels,
    top: wp.int32,
    directions: wp.array[wp.vec3d],
    sense: wp.float64,
    farthest: wp.float64,
    # Out:
    distances_out: wp.array[wp.float64],
) -> None:
    """Find how far the ray of each of a run of vertices goes, infinitely where nothing ends it.

    One thread per run.
    """
    run = first + wp.tid()
    guess = farthest
    for vertex in range(RUN * run, wp.min(RUN * (run + 1), directions.shape[0])):
        along = directions[vertex]
        p = double_point(points[vertex])
        inverse = wp.vec3d(bounded_inverse(along[0]), bounded_inverse(along[1]), bounded_inverse(along[2]))
        found = INFINITE
        reach = wp.min(GUESS * guess, farthest)
        is_open = bool(wp.length_sq(along) > ZERO)
        while is_open:
            least = reach
            lefts = Masks()
            bases = Levels()
            level = int(top)
            lefts[top] = wp.uint32(1)
            while level <= top:
                left = lefts[level]
                if left == wp.uint32(0):
                    level += 1
                else:
                    n = bases[level] + bit_index(left)
                    lefts[level] = left & (left - wp.uint32(1))
                    if level > 0:
                        level -= 1
                        start = CHILDREN * n
                        bases[level] = start
                        size = child_count(levels, level, n)
                        lefts[level] = boxes_on_ray(
                            lows, highs, levels[level] + start, size, p, inverse, least
                        )
                    else:
                        distance = wall_of_face(
                            points, corners, turns, order[n], vertex, p, along, sense, least
                        )
                        if distance < least:
                            least = distance
                            found = distance
            is_open = found == INFINITE and reach < farthest
            reach = wp.min(GROWTH * reach, farthest)
        if found < INFINITE:
            guess = found
        distances_out[vertex] = found
