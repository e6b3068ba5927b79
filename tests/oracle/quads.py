"""Quads round crossed grid edges, and the vertices that they use.

A grid edge (axis, i, j, k) runs along `axis` from its lower node. It has a quad if the surface
crosses it and its four cells exist; the corners of the quad are the four polygons that hold it.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from tests.oracle.cube import AXES, edge_at
from tests.oracle.faces import Cell
from tests.oracle.grid import Grid
from tests.oracle.polygons import Polygon

GridEdge = tuple[int, int, int, int]
AROUND = ((-1, -1), (0, -1), (0, 0), (-1, 0))
"""Steps along the next two axes to the four cells round an edge, counter-clockwise seen from the
edge's upper end: in this order the quad's normal points along the edge."""


@dataclass(frozen=True)
class Vertex:
    """A mesh vertex: its cell, the edges of its polygon, and those of its fan of quads.

    Without splitting into fans `fan` holds all edges of the polygon that have a quad.
    """

    cell: Cell
    polygon: frozenset[int]
    fan: frozenset[int]


def cells_round(edge: GridEdge) -> list[tuple[Cell, int]]:
    """The four cells round a grid edge in cyclic order, each with its own number for the edge."""
    axis, i, j, k = edge
    return [((i + a, j + b, k + c), number) for (a, b, c), number in steps_round(axis)]


@cache
def steps_round(axis: int) -> tuple[tuple[Cell, int], ...]:
    """The steps from the lower node of an edge along `axis` to its four cells, and its numbers in them."""
    found = []
    for step_first, step_second in AROUND:
        steps, position = [0, 0, 0], [0, 0, 0]
        for other, step in ((axis + 1) % 3, step_first), ((axis + 2) % 3, step_second):
            steps[other] = step
            position[other] = -step
        found.append((tuple(steps), edge_at(axis, tuple(position))))
    return tuple(found)


def crossed_grid_edges(grid: Grid) -> list[GridEdge]:
    """Grid edges between an inside and an outside node, both with data.

    In the kernels' order: by words of 32 lower nodes in grid order, in a word by axis, then by node.
    """
    edges = []
    for axis in AXES:
        low, high = [slice(None)] * 3, [slice(None)] * 3
        low[2 - axis], high[2 - axis] = slice(None, -1), slice(1, None)
        crossed = grid.inside[tuple(low)] != grid.inside[tuple(high)]
        crossed &= grid.data[tuple(low)] & grid.data[tuple(high)]
        edges += [(axis, int(i), int(j), int(k)) for k, j, i in np.argwhere(crossed)]
    return sorted(edges, key=lambda edge: (edge[3], edge[2], edge[1] // 32, edge[0], edge[1]))


def edges_with_quad(grid: Grid, cells: dict[Cell, int]) -> list[GridEdge]:
    """The crossed grid edges whose four cells all exist, in grid order."""
    return [edge for edge in crossed_grid_edges(grid) if all(cell in cells for cell, _ in cells_round(edge))]


def polygon_fans(polygon: Polygon, with_quad: set[int]) -> list[frozenset[int]]:
    """The runs of consecutive polygon edges that have quads; the whole polygon is one run."""
    if all(edge in with_quad for edge in polygon):
        return [frozenset(polygon)]
    start = next(at for at, edge in enumerate(polygon) if edge not in with_quad)
    runs, run = [], []
    for edge in polygon[start:] + polygon[:start] + (None,):
        if edge in with_quad:
            run.append(edge)
        elif run:
            runs.append(frozenset(run))
            run = []
    return runs


def vertices_of_cells(
    polygons: dict[Cell, tuple[Polygon, ...]], edges: list[GridEdge], *, split_fans: bool
) -> dict[tuple[Cell, int], Vertex]:
    """The vertex of each cell at each of the cell's edges that have a quad."""
    with_quad: dict[Cell, set[int]] = {}
    for edge in edges:
        for cell, number in cells_round(edge):
            with_quad.setdefault(cell, set()).add(number)
    found = {}
    for cell, numbers in with_quad.items():
        for polygon in polygons[cell]:
            fans = polygon_fans(polygon, numbers)
            if not split_fans:
                fans = [frozenset(polygon) & numbers]
            for fan in fans:
                vertex = Vertex(cell, frozenset(polygon), fan)
                found.update({(cell, number): vertex for number in fan})
    return found
