"""Ambiguous cell faces: which of them join their inside corners.

A face (axis, i, j, k) lies across `axis` with its lowest node at (i, j, k). The asymptotic decider
in its product form: with the distances to the isovalue, the inside corners are joined exactly when
the product of theirs is at least that of the outside corners.
"""

import numpy as np

from tests.oracle.cube import AXES, FACES
from tests.oracle.grid import Grid

Cell = tuple[int, int, int]
Face = tuple[int, int, int, int]


def cell_face(cell: Cell, face: int) -> Face:
    """The grid's face that is face number `face` of a cell."""
    axis, side = FACES[face]
    lowest = list(cell)
    lowest[axis] += side
    return axis, lowest[0], lowest[1], lowest[2]


def cells_of_face(face: Face) -> tuple[Cell, Cell]:
    """The cell below and the cell above a face; either may lie beyond the grid."""
    axis, *lowest = face
    below = list(lowest)
    below[axis] -= 1
    return tuple(below), tuple(lowest)


def joins_inside(f0: float, f1: float, f2: float, f3: float) -> bool:
    """Whether an ambiguous face joins its inside corners; f0 and f3 are diagonal distances."""
    if f0 >= 0:
        return f0 * f3 >= f1 * f2
    return f1 * f2 >= f0 * f3


def decide_faces(grid: Grid) -> dict[Face, bool]:
    """Every ambiguous face of an existing cell, with whether it joins its inside corners."""
    cells = grid.existing_cells()
    decisions = {}
    for axis in AXES:
        f0, f1, f2, f3 = face_corner_planes(grid.inside, axis)
        ambiguous = (f0 == f3) & (f1 == f2) & (f0 != f1) & face_exists(cells, axis)
        corners = face_corner_planes(grid.distance, axis)
        for k, j, i in np.argwhere(ambiguous):
            decisions[axis, int(i), int(j), int(k)] = joins_inside(*(f[k, j, i] for f in corners))
    return decisions


def face_corner_planes(nodes: np.ndarray, axis: int) -> list[np.ndarray]:
    """For f0 f1 f2 f3 the array of their values over all faces across `axis`, [k, j, i]."""
    first, second = (2 - other for other in AXES if other != axis)
    low, high = slice(None, -1), slice(1, None)
    planes = []
    for on_second in (low, high):
        for on_first in (low, high):
            chosen = [slice(None)] * 3
            chosen[first], chosen[second] = on_first, on_second
            planes.append(nodes[tuple(chosen)])
    return planes


def face_exists(cells: np.ndarray, axis: int) -> np.ndarray:
    """Whether a face has an existing cell on either side, [k, j, i]."""
    below, above = [(0, 0)] * 3, [(0, 0)] * 3
    below[2 - axis], above[2 - axis] = (1, 0), (0, 1)
    return np.pad(cells, below) | np.pad(cells, above)
