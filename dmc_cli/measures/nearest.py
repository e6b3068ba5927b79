"""Measure how far points are from a mesh: the exact distance to the nearest of its triangles.

Quads are split by the MaxMin-angle criterion. Everything runs in double precision. A walk through the tree of
boxes looks at what may be nearer than the nearest so far. Points are taken along a curve that fills space, so
that this begins with the face that was nearest to the point before, and is a good guess.
"""

import math
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import Float64Array
from dmc_cli.bits import bit_index
from dmc_cli.measures.split_faces import double_point, face_points, split_faces
from dmc_cli.mesh import (
    CHILDREN,
    Levels,
    Masks,
    Mesh,
    boxes_near,
    build_tree,
    child_count,
    curve_frame,
    curve_number,
)
from dmc_cli.runtime import ITEMS_A_CHUNK, Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

RUN = wp.constant(32)
"""Points that one thread measures, one after the other."""

ZERO = wp.constant(wp.float64(0.0))
INFINITE = wp.constant(wp.float64(math.inf))
ONE = wp.constant(wp.float64(1.0))


@wp.func
def segment_distance(p: wp.vec3d, a: wp.vec3d, b: wp.vec3d) -> wp.float64:
    """Return the square of the distance of a point from a segment."""
    along = b - a
    length = wp.dot(along, along)
    share = ZERO
    if length > ZERO:
        share = wp.clamp(wp.dot(p - a, along) / length, ZERO, ONE)
    return wp.length_sq(p - a - share * along)


@wp.func
def triangle_distance(p: wp.vec3d, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, least: wp.float64) -> wp.float64:
    """Return the lesser of `least` and the square of the distance of a point from a triangle.

    The triangle may be a segment or a point. The nearest point is above it or on a side that the point is
    beyond.
    """
    normal = wp.cross(b - a, c - a)
    area = wp.dot(normal, normal)
    nearest = least
    if area > ZERO:
        height = wp.dot(normal, p - a)
        if height * height >= least * area:
            return least
        from_a = wp.dot(wp.cross(normal, b - a), p - a)
        from_b = wp.dot(wp.cross(normal, c - b), p - b)
        from_c = wp.dot(wp.cross(normal, a - c), p - c)
        if from_a >= ZERO and from_b >= ZERO and from_c >= ZERO:
            return height * height / area
        if from_a < ZERO:
            nearest = wp.min(nearest, segment_distance(p, a, b))
        if from_b < ZERO:
            nearest = wp.min(nearest, segment_distance(p, b, c))
        if from_c < ZERO:
            nearest = wp.min(nearest, segment_distance(p, c, a))
        return nearest
    nearest = wp.min(nearest, wp.min(segment_distance(p, a, b), segment_distance(p, b, c)))
    return wp.min(nearest, segment_distance(p, c, a))


@wp.func
def face_distance(
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    turns: wp.array[wp.uint8],
    f: wp.int32,
    p: wp.vec3d,
    least: wp.float64,
) -> wp.float64:
    """Return the lesser of `least` and the square of the distance of a point from a face."""
    face = face_points(points, corners, turns, f)
    a = double_point(face[0])
    c = double_point(face[2])
    nearest = triangle_distance(p, a, double_point(face[1]), c, least)
    if corners[4 * f + 3] >= 0:
        nearest = triangle_distance(p, a, c, double_point(face[3]), nearest)
    return nearest


@wp.func
def box_distance(low: wp.vec3f, high: wp.vec3f, p: wp.vec3d) -> wp.float64:
    """Return the square of the distance of a point from a box."""
    return wp.length_sq(wp.max(wp.max(double_point(low) - p, p - double_point(high)), wp.vec3d()))


@wp.func
def descend(
    lows: wp.array[wp.vec3f], highs: wp.array[wp.vec3f], levels: Levels, top: wp.int32, p: wp.vec3d
) -> wp.int32:
    """Return the place in the tree's order of the face that the nearest box at each level leads to."""
    n = int(0)
    level = int(top)
    while level > 0:
        level -= 1
        best = CHILDREN * n
        least = box_distance(lows[levels[level] + best], highs[levels[level] + best], p)
        size = levels[level + 1] - levels[level]
        for child in range(CHILDREN * n + 1, wp.min(CHILDREN * (n + 1), size)):
            distance = box_distance(lows[levels[level] + child], highs[levels[level] + child], p)
            if distance < least:
                least = distance
                best = child
        n = best
    return n


@wp.kernel
def nearest_kernel(
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
    queries: wp.array[wp.vec3d],
    places: wp.array[wp.int32],
    # Out:
    distances_out: wp.array[wp.float64],
    faces_out: wp.array[wp.int32],
) -> None:
    """Find the face that is nearest to each of a run of points, and its distance. One thread per run."""
    run = first + wp.tid()
    nearest = int(-1)
    for place in range(RUN * run, wp.min(RUN * (run + 1), queries.shape[0])):
        query = places[place]
        p = queries[query]
        if nearest < 0:
            nearest = order[descend(lows, highs, levels, top, p)]
        least = face_distance(points, corners, turns, nearest, p, INFINITE)
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
                    lefts[level] = boxes_near(lows, highs, levels[level] + start, size, p, least)
                else:
                    distance = face_distance(points, corners, turns, order[n], p, least)
                    if distance < least:
                        least = distance
                        nearest = order[n]
        distances_out[query] = wp.sqrt(least)
        faces_out[query] = nearest


@wp.kernel
def number_points_kernel(
    first: wp.int32,
    # In:
    queries: wp.array[wp.vec3d],
    low: wp.vec3d,
    scale: wp.float64,
    # Out:
    keys_out: wp.array[wp.int32],
    places_out: wp.array[wp.int32],
) -> None:
    """Find the number of a point along the curve. One thread per point."""
    query = first + wp.tid()
    keys_out[query] = curve_number(queries[query], low, scale)
    places_out[query] = query


class NearestFaces:
    """A mesh that distances are taken from: its tree of boxes, and how its quads are split."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh, self.tree = mesh, build_tree(mesh)
        self.turns = split_faces(mesh)

    def distances(self, queries: Any) -> Float64Array:
        """Return the distance of each point, vec3d (N,) on the mesh's device, from the mesh, (N,) float64.

        Infinite where the mesh has no face.
        """
        if not self.mesh.face_count or not queries.shape[0]:
            return np.full(queries.shape[0], np.inf)
        distances: Float64Array = self.find(queries)[0].numpy()
        return distances

    def find(self, queries: Any) -> tuple[Any, Any]:
        """Return the distance of each of some points, as `distances` does, and the face that is so near.

        Both are on the mesh's device, float64 and int32 (N,); the mesh has a face.
        """
        mesh, tree, count = self.mesh, self.tree, queries.shape[0]
        distances, faces = mesh.device.empty(count, wp.float64), mesh.device.empty(count, wp.int32)
        inputs = [mesh.positions, mesh.corners, self.turns, tree.order, tree.lows, tree.highs]
        inputs += [tree.starts, tree.top, queries, _along_curve(mesh.device, queries)]
        mesh.device.launch(nearest_kernel, -(-count // int(RUN)), inputs, [distances, faces], 4, 256)
        return distances, faces


def _along_curve(device: Device, queries: Any) -> Any:
    """Return the numbers of points in the order of the curve, int32, at least (N,)."""
    count = queries.shape[0]
    keys, places = device.empty(2 * count, wp.int32), device.empty(2 * count, wp.int32)
    inputs = [queries, *curve_frame(queries.numpy())]
    device.launch(number_points_kernel, count, inputs, [keys, places], ITEMS_A_CHUNK)
    wp.utils.radix_sort_pairs(keys, places, count)
    return places
