"""Find the normals of faces and vertices from the mesh alone."""

import numpy as np

from dmc_cli.array_types import Float64Array, FloatArray, Int32Array


def area_vectors(points: FloatArray, faces: Int32Array) -> Float64Array:
    """Return normals of faces, (F, 4) with -1 as a triangle's fourth corner; each is as long as its area."""
    p = np.asarray(points, np.float64)
    last = np.where(faces[:, 3] < 0, faces[:, 2], faces[:, 3])
    across = p[faces[:, 2]] - p[faces[:, 0]]
    return np.asarray(0.5 * np.cross(across, p[last] - p[faces[:, 1]]))


def vertex_normals(points: FloatArray, faces: Int32Array) -> Float64Array:
    """Return unit normals of vertices, the sums of their faces' by area, (V, 3); 0 where there is none."""
    areas, sums = area_vectors(points, faces), np.zeros((len(points), 3))
    for corner in range(4):
        which = faces[:, corner]
        has_corner = which >= 0
        for axis in range(3):
            sums[:, axis] += np.bincount(
                which[has_corner], weights=areas[has_corner, axis], minlength=len(points)
            )
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.asarray(sums / np.where(length > 0, length, 1.0))
