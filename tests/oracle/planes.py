"""Place vertices of cells by the planes at their crossings, in double precision: all cells at once.

Planes have the normals that are given at the crossings, (V, 12, 3), NaN where an edge is not crossed. Points
are local coordinates.
"""

import numpy as np

from tests.oracle.cube import AXES, CORNERS, EDGES
from tests.oracle.dual import cell_crossings, corner_values
from tests.oracle.grid import Grid
from tests.oracle.normals import derivative

CUT = 0.01
FULL_CUT = 1e-12


def crossing_normals(grid: Grid, cells: np.ndarray) -> np.ndarray:
    """Unit normals at the crossings by central differences, interpolated along the edges, (V, 12, 3).

    Where the gradients at an edge's ends cancel to a rounding there is none: infinite.
    """
    points = cell_crossings(grid, cells)
    corners = np.stack([corner_values(derivative(grid, axis), cells) for axis in AXES], axis=-1)
    found = np.full(points.shape, np.nan)
    for edge, (a, b) in enumerate(EDGES):
        axis = int(np.flatnonzero(np.array(CORNERS[a]) != CORNERS[b])[0])
        t = points[:, edge, axis, None]
        unit = np.maximum(np.abs(corners[:, a]), np.abs(corners[:, b])).max(axis=1, keepdims=True)
        low, high = (corners[:, c] / np.where(unit > 0, unit, 1.0) for c in (a, b))
        gradient = low + t * (high - low)
        length = np.linalg.norm(gradient, axis=1, keepdims=True)
        with np.errstate(invalid="ignore", divide="ignore"):
            found[:, edge] = np.where(length == 0, 0.0, gradient / length)
        found[:, edge][(length[:, 0] < 1e-4) & (length[:, 0] > 0)] = np.inf
    return found


def planes(points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mean of the crossings (V, 3), the sums of n n^T (V, 3, 3) and of n (n . d) about it (V, 3)."""
    mean = np.nanmean(points, axis=1)
    n = np.nan_to_num(normals, nan=0.0)
    distance = np.nan_to_num(np.einsum("vek,vek->ve", n, points - mean[:, None]), nan=0.0)
    return mean, np.einsum("vej,vek->vjk", n, n), np.einsum("vek,ve->vk", n, distance)


def least_points(points: np.ndarray, normals: np.ndarray, cut: float) -> tuple[np.ndarray, np.ndarray]:
    """The points of the least error (V, 3), not drawn into the cells, and the eigenvalues (V, 3)."""
    mean, matrix, force = planes(points, normals)
    values, vectors = np.linalg.eigh(matrix)
    kept = values > cut * values[:, -1:]
    inverse = np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)
    along = np.einsum("vjk,vj->vk", vectors, force)
    return mean + np.einsum("vjk,vk->vj", vectors, inverse * along), values


def place_qef(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """The least error from the mean without small eigenvalues, drawn into the cells."""
    return np.clip(least_points(points, normals, CUT)[0], 0.0, 1.0)


def place_paper(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """The full solution, or where it lies outside the cell the mean of the crossings."""
    found, _ = least_points(points, normals, FULL_CUT)
    outside = ~((found >= 0) & (found <= 1)).all(axis=1)
    found[outside] = np.nanmean(points, axis=1)[outside]
    return found


def place_particle(points: np.ndarray, normals: np.ndarray, steps: int, size: float) -> np.ndarray:
    """So many steps from the mean along the sum of the vectors to the planes, kept in the cells."""
    mean, matrix, force = planes(points, normals)
    p = mean
    for _ in range(steps):
        to_planes = force - np.einsum("vjk,vk->vj", matrix, p - mean)
        p = np.clip(p + size * to_planes, 0.0, 1.0)
    return p
