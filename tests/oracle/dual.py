"""The dual of the grid: a vertex in each active cell that has a quad, a quad round each crossed edge."""

from dataclasses import dataclass

import numpy as np

from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume
from tests.oracle.cube import CORNERS, EDGES
from tests.oracle.grid import Grid, cut_grid
from tests.oracle.polygons import active_cells
from tests.oracle.quads import cells_round, crossed_grid_edges, edges_with_quad
from tests.oracle.surface import points_along_edge


@dataclass(frozen=True)
class OracleDual:
    """Vertices by the linear index of their cell, in grid order; quads as vertex numbers, (Q, 4)."""

    grid: Grid
    active_count: int
    crossed_edge_count: int
    cells: np.ndarray
    quads: np.ndarray


def extract_oracle_dual(volume: Volume, settings: SurfaceSettings) -> OracleDual:
    """Vertices and quads of a volume, one obvious step after the other."""
    grid = cut_grid(volume, settings)
    active = active_cells(grid)
    determinant = float(np.linalg.det(volume.affine[:3, :3]))
    inside = grid.inside
    quads = []
    for edge in edges_with_quad(grid, active):
        _, i, j, k = edge
        corners = [grid.linear_index(cell) for cell, _ in cells_round(edge)]
        if not points_along_edge(bool(inside[k, j, i]), settings, determinant=determinant):
            corners = corners[::-1]
        quads.append(corners)
    cells, numbers = np.unique(np.array(quads, np.int64).reshape(-1, 4), return_inverse=True)
    return OracleDual(grid, len(active), len(crossed_grid_edges(grid)), cells, numbers.reshape(-1, 4))


def corner_values(nodes: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """The values at the corners of cells by their linear indices, (V, 8); `nodes` is [k, j, i]."""
    k, j, i = np.unravel_index(cells, nodes.shape)
    return np.stack([nodes[k + c, j + b, i + a] for a, b, c in CORNERS], axis=-1)


def cell_crossings(grid: Grid, cells: np.ndarray) -> np.ndarray:
    """The local coordinates of cells' crossings, (V, 12, 3), NaN where an edge is not crossed."""
    f = corner_values(grid.distance, cells)
    found = np.full((len(cells), 12, 3), np.nan)
    for edge, (a, b) in enumerate(EDGES):
        crossed = (f[:, a] >= 0) != (f[:, b] >= 0)
        with np.errstate(all="ignore"):
            t = np.where(crossed, f[:, a] / (f[:, a] - f[:, b]), np.nan)[:, None]
        start, end = np.array(CORNERS[a], float), np.array(CORNERS[b], float)
        found[:, edge] = start + t * (end - start)
    return found


def mean_crossings(grid: Grid, cells: np.ndarray) -> np.ndarray:
    """The mean of the crossings of each cell, in local coordinates, (V, 3)."""
    return np.nanmean(cell_crossings(grid, cells), axis=1) if len(cells) else np.empty((0, 3))
