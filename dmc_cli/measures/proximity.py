"""Prove that every point of a mesh is within a bound of another mesh, or find where it may not be.

Samples say how far some points are; this says it of all. A triangle is proven if its corners are within the
bound of one and the same triangle of the other mesh: the distance from a convex set is a convex function, so
no point between them is further. It is proven, too, if its centre is nearer than the bound by as much as the
corners are from the centre, since distances from two points differ by no more than what is between these.
What is neither is split into four and asked again, until it is smaller than the slack: then it counts as
beyond. So what is proven is true, and what is as much as the slack within the bound is proven.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import BoolArray, Float64Array, Int32Array
from dmc_cli.measures.nearest import INFINITE, ONE, NearestFaces, triangle_distance
from dmc_cli.measures.split_faces import double_point, face_points, split_faces
from dmc_cli.mesh import Mesh
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

SLACK_SHARE = 1.0 / 16.0
"""Size of the smallest pieces, against the bound: nothing that is nearer by as much is taken for beyond."""

BATCH = 1 << 16
"""Pieces that are judged together: what is split waits until its parts are done."""

PROVEN, SPLIT, BEYOND = wp.constant(0), wp.constant(1), wp.constant(2)

QUARTERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""Corners of the four parts of a triangle, among its three corners and the midpoints of 01, 12 and 20."""


@dataclass(frozen=True)
class Proximity:
    """What is known of the distances from a mesh to another.

    Attributes:
        beyond: bool (F,), the faces of the mesh of which not every point is proven to be within the bound.
        near_beyond: int32, faces of the other mesh, each once, that are nearest to what is not proven.
        samples: Points that were measured.
    """

    beyond: BoolArray
    near_beyond: Int32Array
    samples: int


def prove_proximity(mesh: Mesh, other: NearestFaces, bound: float) -> Proximity:
    """Find the faces of a mesh that may reach further from another one than a bound.

    Quads of both are split by the MaxMin-angle criterion.

    Args:
        mesh: The mesh, on the device of the other one, which has a face.
        other: What distances are taken from.
        bound: In the unit of the coordinates of both.
    """
    beyond, near, samples = np.zeros(mesh.face_count, bool), [np.empty(0, np.int32)], 0
    for triangles in _triangles(mesh):
        waiting = [triangles]
        while waiting:
            pieces, owners = waiting.pop()
            samples += len(pieces)
            verdicts, nearest = _judge(pieces, other, bound)
            is_beyond, is_split = verdicts == BEYOND, verdicts == SPLIT
            beyond[owners[is_beyond]] = True
            near.append(np.unique(nearest[is_beyond]))
            waiting += _batches(_quartered(pieces[is_split]), np.repeat(owners[is_split], 4))
    return Proximity(beyond, np.unique(np.concatenate(near)), samples)


def _triangles(mesh: Mesh) -> Iterator[tuple[Float64Array, Int32Array]]:
    """Yield the triangles of faces, (N, 3, 3), and the numbers of the faces, a batch at a time."""
    turns = split_faces(mesh)
    for start in range(0, mesh.face_count, BATCH // 2):
        count = min(BATCH // 2, mesh.face_count - start)
        triangles = mesh.device.empty((2 * count, 3), wp.vec3d)
        mesh.device.launch(
            list_triangles_kernel, count, [mesh.positions, mesh.corners, turns, start], [triangles]
        )
        yield triangles.numpy(), np.repeat(np.arange(start, start + count, dtype=np.int32), 2)


def _batches(pieces: Float64Array, owners: Int32Array) -> list[tuple[Float64Array, Int32Array]]:
    """Return pieces and the faces that they are of in batches."""
    starts = range(0, len(pieces), BATCH)
    return [(pieces[start : start + BATCH], owners[start : start + BATCH]) for start in starts]


def _judge(pieces: Float64Array, other: NearestFaces, bound: float) -> tuple[Any, Int32Array]:
    """Return the verdict on each piece, and the face of the other mesh that is nearest to its centre."""
    device: Device = other.mesh.device
    corners = wp.array(pieces, dtype=wp.vec3d, device=device.name)
    distances, nearest = other.find(wp.array(pieces.mean(axis=1), dtype=wp.vec3d, device=device.name))
    verdicts = device.empty(len(pieces), wp.uint8)
    inputs = [other.mesh.positions, other.mesh.corners, other.turns, corners, distances, nearest]
    device.launch(judge_pieces_kernel, len(pieces), [*inputs, bound, SLACK_SHARE * bound], [verdicts])
    return verdicts.numpy(), nearest.numpy()


def _quartered(pieces: Float64Array) -> Float64Array:
    """Return the four parts of each triangle, (4N, 3, 3)."""
    middles = 0.5 * (pieces + np.roll(pieces, -1, axis=1))
    points = np.concatenate([pieces, middles], axis=1)
    return points[:, QUARTERS].reshape(-1, 3, 3)


@wp.kernel
def list_triangles_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    turns: wp.array[wp.uint8],
    start: wp.int32,
    # Out:
    triangles_out: wp.array2d[wp.vec3d],
) -> None:
    """Write the two triangles of a face. One thread per face."""
    n = first + wp.tid()
    face = face_points(points, corners, turns, start + n)
    for half in range(2):
        triangles_out[2 * n + half, 0] = double_point(face[0])
        triangles_out[2 * n + half, 1] = double_point(face[1 + half])
        triangles_out[2 * n + half, 2] = double_point(face[2 + half])


@wp.kernel
def judge_pieces_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    turns: wp.array[wp.uint8],
    pieces: wp.array2d[wp.vec3d],
    distances: wp.array[wp.float64],
    nearest: wp.array[wp.int32],
    bound: wp.float64,
    slack: wp.float64,
    # Out:
    verdicts_out: wp.array[wp.uint8],
) -> None:
    """Judge a piece of a triangle, given the face that is nearest to its centre. One thread per piece."""
    n = first + wp.tid()
    third = ONE / wp.float64(3.0)
    centre = third * (pieces[n, 0] + pieces[n, 1] + pieces[n, 2])
    size = wp.float64(0.0)
    for c in range(3):
        size = wp.max(size, wp.length(pieces[n, c] - centre))
    verdict = int(SPLIT)
    if distances[n] > bound:
        verdict = BEYOND
    elif distances[n] + size <= bound:
        verdict = PROVEN
    else:
        face = face_points(points, corners, turns, nearest[n])
        furthest = wp.vec2d()
        for c in range(3):
            for half in range(2):
                distance = triangle_distance(
                    pieces[n, c],
                    double_point(face[0]),
                    double_point(face[1 + half]),
                    double_point(face[2 + half]),
                    INFINITE,
                )
                furthest[half] = wp.max(furthest[half], distance)
        if wp.min(furthest[0], furthest[1]) <= bound * bound:
            verdict = PROVEN
        if verdict == SPLIT and size <= slack:
            verdict = BEYOND
    verdicts_out[n] = wp.uint8(verdict)
