"""Vertex normals (section 3.1.2): central differences at the nodes, interpolated in the cell.

At the grid's border, and beside a node without data, the difference is one-sided with its own divisor.
"""

import numpy as np

from dmc_cli.settings import SurfaceSettings
from tests.oracle.cube import AXES, CORNERS
from tests.oracle.grid import Grid
from tests.oracle.trilinear import cell_indices


def derivative(grid: Grid, axis: int) -> np.ndarray:
    """The derivative of the distance along an axis at every node, [k, j, i]; 0 without a neighbour."""
    value = np.where(grid.data, grid.distance, np.nan)
    along = 2 - axis
    absent = np.full_like(np.take(value, [0], axis=along), np.nan)
    step = np.diff(value, axis=along)
    forward, backward = np.concatenate([step, absent], along), np.concatenate([absent, step], along)
    central = 0.5 * (forward + backward)
    one_sided = np.where(np.isnan(forward), backward, forward)
    return np.nan_to_num(np.where(np.isnan(central), one_sided, central), nan=0.0)


def vertex_normals(
    grid: Grid, cells: np.ndarray, local: np.ndarray, affine: np.ndarray, settings: SurfaceSettings
) -> np.ndarray:
    """Unit normals at `local` (n, 3) within linear cell indices (n,), in the space of `affine`."""
    i, j, k = cell_indices(grid, cells).T
    local = local.astype(np.float64)
    gradient = np.zeros((len(cells), 3))
    for axis in AXES:
        at_nodes = derivative(grid, axis)
        for a, b, c in CORNERS:
            weight = np.prod(np.where((a, b, c), local, 1.0 - local), axis=1)
            gradient[:, axis] += weight * at_nodes[k + c, j + b, i + a]
    outward = settings.orientation == "outward" and settings.inside == "above"
    normals = (-gradient if outward else gradient) @ np.linalg.inv(affine[:3, :3])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
