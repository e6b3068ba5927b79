"""Split quads into two triangles each, for formats that hold nothing else.

The diagonal is the one whose smallest angle is larger (MaxMin-angle criterion), a tie that from the first
corner: the same triangles that area and volume are measured by.
"""

from collections.abc import Iterator

import numpy as np

from dmc_cli.array_types import BoolArray, Float32Array, Float64Array, Int32Array
from dmc_cli.mesh_io.mesh_file import NO_CORNER, MeshFile
from dmc_cli.mesh_io.text import chunks_of

TIE = 1e-6
"""How much larger, in cosine, the smallest angle must be for the diagonal from the second corner."""


def triangle_count(mesh: MeshFile) -> int:
    """Return the number of triangles that the faces of a mesh become."""
    return 2 * mesh.quad_count + mesh.triangle_count


def triangle_chunks(mesh: MeshFile) -> Iterator[Int32Array]:
    """Yield the triangles of the faces in their order, chunks of (n, 3) int32."""
    for faces in chunks_of(mesh.faces):
        yield triangles_of(fans(mesh, faces))


def fans(mesh: MeshFile, faces: Int32Array) -> Int32Array:
    """Return the faces, (n, 4) int32, each from the corner on that its diagonal starts from."""
    if mesh.triangle_count == len(mesh.faces):
        return faces
    points = mesh.points.astype(np.float32, copy=False)
    turned = ~_splits_along_02(points[faces].astype(np.float64)) & (faces[:, 3] != NO_CORNER)
    turned_faces = faces.copy()
    turned_faces[turned] = np.roll(faces[turned], -1, axis=1)
    return turned_faces


def triangles_of(fans: Int32Array) -> Int32Array:
    """Return the triangles round the first corner of each face, (n, 3) int32."""
    pairs = fans[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    triangles: Int32Array = pairs[pairs[:, 2] != NO_CORNER]
    return triangles


def unit_normals(corners: Float32Array) -> Float32Array:
    """Return the unit normals of triangles, (n, 3) float32, zeros where one has no area.

    Args:
        corners: Their points, (n, 3, 3).
    """
    points = corners.astype(np.float64)
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    lengths = np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, None]
    found: Float64Array = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    return found.astype(np.float32)


def _splits_along_02(points: Float64Array) -> BoolArray:
    """Return which quads, (n, 4, 3), are split between their corners 0 and 2."""
    edges = np.roll(points, -1, axis=1) - points
    along_02, along_13 = (
        np.maximum(_largest_cosine(edges, first), _largest_cosine(edges, first + 2)) for first in (0, 1)
    )
    found: BoolArray = along_13 > along_02 - TIE
    return found


def _largest_cosine(edges: Float64Array, first: int) -> Float64Array:
    """Return the cosine of the smallest angle of the triangles that an edge and the next one bound.

    It is 1 where a side has no length.
    """
    before, after = edges[:, first], edges[:, (first + 1) % 4]
    sides = np.stack([before, after, -before - after])
    lengths = np.sqrt(np.einsum("sij,sij->si", sides, sides))
    products = -np.einsum("sij,sij->si", sides, np.roll(sides, -1, axis=0))
    found: Float64Array = np.divide(
        products,
        lengths * np.roll(lengths, -1, axis=0),
        out=np.ones_like(lengths),
        where=(lengths > 0).all(axis=0),
    ).max(axis=0)
    return found
