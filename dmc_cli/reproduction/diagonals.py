"""Split quads by the MaxMin-angle criterion as the papers do, by vertices that are not rounded to float32.

On the grid's symmetric fields both diagonals are often as good but for rounding, which then decides the share
of irregular vertices in its second decimal. So positions are those of cells and local coordinates.
"""

import numpy as np

from dmc_cli.array_types import Float64Array, IntArray
from dmc_cli.mesh import Mesh, Placement

CHUNK = 1 << 19
"""Quads that are split at a time: temporaries of 100 MiB."""


def diagonal_ends(mesh: Mesh, placement: Placement) -> IntArray:
    """Return how many diagonals end at each vertex, int64 (V,); none of a mesh of triangles."""
    ends = np.zeros(mesh.vertex_count, np.int64)
    if mesh.triangle_count:
        return ends
    quads = mesh.faces.numpy()
    points = _grid_points(placement)
    for start in range(0, len(quads), CHUNK):
        some = quads[start : start + CHUNK]
        corners = points[some]
        first = np.minimum(least_angle(corners[:, [0, 1, 2]]), least_angle(corners[:, [0, 2, 3]]))
        second = np.minimum(least_angle(corners[:, [0, 1, 3]]), least_angle(corners[:, [1, 2, 3]]))
        is_second = second > first
        for a, b in ((0, 1), (2, 3)):
            ends += np.bincount(np.where(is_second, some[:, b], some[:, a]), minlength=len(ends))
    return ends


def least_angle(corners: Float64Array) -> Float64Array:
    """Return the least angle of triangles, (n, 3, 3), in radians."""
    angles = []
    for n in range(3):
        u, v = corners[:, n - 2] - corners[:, n], corners[:, n - 1] - corners[:, n]
        angles.append(np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), np.einsum("ij,ij->i", u, v)))
    least: Float64Array = np.minimum.reduce(angles)
    return least


def _grid_points(placement: Placement) -> Float64Array:
    """Return the vertices in node indices, float64 (V, 3)."""
    lowest = placement.frame.grid.lowest_nodes(placement.cell.numpy())
    points: Float64Array = np.stack(lowest, axis=1) + placement.local.numpy().astype(np.float64)
    return points
