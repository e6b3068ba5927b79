"""Meshes whose vertices lie on the grid's edges: which edges have one, where, and the polygons between them.

A grid edge (axis, i, j, k) runs along `axis` from its lower node (i, j, k).
"""

from functools import cache

import numpy as np

from dmc_cli.settings import SurfaceSettings
from tests.oracle.cube import CORNERS, EDGES, FACES, edge_axis, face_edges
from tests.oracle.faces import Cell
from tests.oracle.grid import Grid
from tests.oracle.polygons import Polygon, active_cells, trace_polygons
from tests.oracle.surface import points_along_edge

GridEdge = tuple[int, int, int, int]


def edge_of_cell(cell: Cell, edge: int) -> GridEdge:
    """The grid edge that is edge number `edge` of a cell."""
    corner = CORNERS[EDGES[edge][0]]
    return edge_axis(edge), *(int(c + d) for c, d in zip(cell, corner, strict=True))


def ordered_edges(grid: Grid) -> np.ndarray:
    """The crossed edges of existing cells, (V, 4): rows in grid order, in a row by axis, then along x."""
    found = []
    inside, cells = grid.inside.transpose(2, 1, 0), grid.existing_cells().transpose(2, 1, 0)
    for axis in range(3):
        low, high = np.delete(inside, -1, axis), np.delete(inside, 0, axis)
        across = [n for n in range(3) if n != axis]
        beside = np.pad(cells, [(int(n != axis),) * 2 for n in range(3)])
        for n in across:
            beside = np.delete(beside, -1, n) | np.delete(beside, 0, n)
        nodes = np.argwhere((low != high) & beside)
        found.append(np.column_stack([np.full(len(nodes), axis), nodes]))
    edges = np.concatenate(found)
    return edges[np.lexsort((edges[:, 1], edges[:, 0], edges[:, 2], edges[:, 3]))]


def edges_with_two_fans(grid: Grid) -> set[GridEdge]:
    """The crossed edges at which only two cells exist, opposite each other: their polygons share no side."""
    cells, edges = np.pad(grid.existing_cells(), 1), ordered_edges(grid)
    at = edges[:, 1:] + 1
    a, b = (np.eye(3, dtype=int)[across[edges[:, 0]]] for across in np.array([[1, 0, 0], [2, 2, 1]]))
    first, second, third, fourth = (cells[tuple((at - back).T[::-1])] for back in (0 * a, a, a + b, b))
    opposite = (first == third) & (second == fourth) & (first != second)
    return {tuple(edge) for edge in edges[opposite].tolist()}


def numbered_edges(grid: Grid) -> dict[GridEdge, int]:
    """The number of each edge in the order of `ordered_edges`."""
    return {tuple(edge): number for number, edge in enumerate(ordered_edges(grid).tolist())}


def crossings(grid: Grid, edges: np.ndarray) -> np.ndarray:
    """How far along each edge (V, 4) the distance is zero, by linear interpolation, float32."""
    low, high = edges[:, 1:].T, (edges[:, 1:] + np.eye(3, dtype=int)[edges[:, 0]]).T
    a, b = (grid.distance[tuple(node[::-1])] for node in (low, high))
    return (a / (a - b)).astype(np.float32)


@cache
def points_outwards(case: int, polygon: Polygon) -> bool:
    """Whether a polygon's normal points away from the inside.

    Its first side lies in a face of the cell; seen from outside the cell, the inside is on its right then.
    """
    first, second = polygon[:2]
    axis, side = FACES[next(f for f in range(6) if {first, second} <= set(face_edges(f)))]
    ends = np.array([[CORNERS[a], CORNERS[b]] for a, b in (EDGES[first], EDGES[second])], dtype=float)
    along = ends[1].mean(axis=0) - ends[0].mean(axis=0)
    inwards = (ends[0, 0] - ends[0, 1]) * (1 if case >> EDGES[first][0] & 1 else -1)
    return np.cross(along, inwards)[axis] * (1 if side else -1) < 0


def oriented(case: int, polygon: Polygon, settings: SurfaceSettings, determinant: float) -> Polygon:
    """A polygon the way round that the settings ask for, from its lowest edge on."""
    along = points_along_edge(True, settings, determinant=determinant)
    if points_outwards(case, polygon) == along:
        return polygon
    return polygon[:1] + polygon[:0:-1]


def separated_polygons(
    grid: Grid, settings: SurfaceSettings, determinant: float
) -> list[tuple[Cell, Polygon]]:
    """The polygons of all cells in grid order, inside corners separated on every ambiguous face."""
    return [
        (cell, oriented(case, polygon, settings, determinant))
        for cell, case in active_cells(grid).items()
        for polygon in trace_polygons(case, (False,) * 6)
    ]
