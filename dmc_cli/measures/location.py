"""Locate positions in a grid: their cells, and their coordinates there."""

import numpy as np

from dmc_cli.array_types import Float32Array, Float64Array, FloatArray, Int64Array
from dmc_cli.field import GridShape


def locate(
    points: FloatArray, affine: Float64Array, grid: GridShape, depths: Float64Array
) -> tuple[Int64Array, Float32Array, int]:
    """Return each point's cell, its place there, and how many points are outside the grid.

    Args:
        points: Positions, (V, 3) float64.
        affine: Shape (4, 4): the grid's node index, slices even, to the space of the points.
        grid: The grid.
        depths: As `slice_depths` returns them, on the host.

    Returns:
        Linear numbers of the cells' lowest nodes, (V,) int64; coordinates in the cells, (V, 3) float32,
        clamped to [0, 1]; the number of points outside.
    """
    at = (points - affine[:3, 3]) @ np.linalg.inv(affine[:3, :3]).T
    if depths.size:
        beyond = at[:, 2] - np.clip(at[:, 2], depths[0], depths[-1])
        at[:, 2] = np.interp(at[:, 2], depths, np.arange(len(depths))) + beyond
    lowest = np.clip(np.floor(at), 0, np.array((grid.nx, grid.ny, grid.nz)) - 2)
    local = at - lowest
    is_outside = ((local < 0) | (local > 1)).any(axis=1)
    i, j, k = lowest.astype(np.int64).T
    cells = i + grid.nx * (j + grid.ny * k)
    return cells, np.clip(local, 0, 1).astype(np.float32), int(np.count_nonzero(is_outside))
