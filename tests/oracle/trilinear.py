"""The trilinear interpolant (equation 2 of the paper) in double precision, at local coordinates."""

import numpy as np

from tests.oracle.cube import CORNERS
from tests.oracle.grid import Grid


def cell_indices(grid: Grid, cells: np.ndarray) -> np.ndarray:
    """The indices i, j, k of linear cell indices, shape (n, 3)."""
    nz, ny, nx = grid.distance.shape
    return np.stack(np.unravel_index(cells, (nz, ny, nx))[::-1], axis=-1)


def distances_at(grid: Grid, cells: np.ndarray, local: np.ndarray) -> np.ndarray:
    """The interpolated distance to the isovalue at `local` (n, 3) within linear cell indices (n,)."""
    i, j, k = cell_indices(grid, cells).T
    local = local.astype(np.float64)
    total = np.zeros(len(cells))
    for a, b, c in CORNERS:
        weight = np.prod(np.where((a, b, c), local, 1.0 - local), axis=1)
        total += weight * grid.distance[k + c, j + b, i + a]
    return total
