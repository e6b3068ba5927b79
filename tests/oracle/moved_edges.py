"""Vertices that leave the middles of their edges for the surface: Newton steps, means of neighbours, shapes.

A step leads from an edge's middle, in cells along x, y, z; edges are rows (axis, i, j, k). All in double.
"""

import numpy as np

from tests.oracle.cube import CORNERS
from tests.oracle.grid import Grid

NEAR, FAR, LONGEST, SHORTEST, MOST = 0.5, 0.6, 0.25, 2e-4, 8


def middles(edges: np.ndarray) -> np.ndarray:
    """The middles of edges, (V, 3), in node indices."""
    return edges[:, 1:] + 0.5 * np.eye(3)[edges[:, 0]]


def free_axes(grid: Grid, edges: np.ndarray) -> np.ndarray:
    """1 for each axis along which a vertex may move, else 0, (V, 3)."""
    last = np.array(grid.distance.shape)[::-1] - 1
    free = ((edges[:, 1:] > 0) & (edges[:, 1:] < last)).astype(float)
    cells = np.pad(grid.existing_cells().transpose(2, 1, 0), 1)
    own = np.eye(3)[edges[:, 0]]
    if not grid.data.all():
        for edge, row in zip(edges, free, strict=True):
            b, c = (edge[0] + 1) % 3, (edge[0] + 2) % 3
            beside = np.repeat(edge[None, 1:], 4, axis=0)
            beside[:, b] -= [0, 1, 0, 1]
            beside[:, c] -= [0, 0, 1, 1]
            if not cells[tuple((beside + 1).T)].all():
                row[:] = 0
    return np.maximum(free, own)


def value_and_gradient(grid: Grid, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The trilinear interpolant at points (V, 3) in node indices, and its gradient."""
    last = np.array(grid.distance.shape)[::-1] - 2
    cell = np.clip(np.floor(x).astype(int), 0, last)
    local = x - cell
    value, gradient = np.zeros(len(x)), np.zeros((len(x), 3))
    for corner in CORNERS:
        f = grid.distance[tuple((cell + corner).T[::-1])]
        weights = np.where(corner, local, 1 - local)
        signs = np.where(corner, 1.0, -1.0)
        value += f * weights.prod(axis=1)
        for axis in range(3):
            gradient[:, axis] += f * signs[axis] * np.delete(weights, axis, 1).prod(axis=1)
    return value, gradient


def settled(grid: Grid, edges: np.ndarray, start: np.ndarray, stay: np.ndarray, reach: float) -> np.ndarray:
    """Steps on the surface where the gradient leads from `start`, else `stay`; all (V, 3)."""
    middle, free = middles(edges), free_axes(grid, edges)
    low, high = -middle, np.array(grid.distance.shape)[::-1] - 1 - middle
    step, found, active = start.copy(), np.zeros(len(edges), bool), np.ones(len(edges), bool)
    for _ in range(MOST):
        step *= np.minimum(1.0, reach / np.maximum(np.linalg.norm(step, axis=1), 1e-30))[:, None]
        step = np.clip(step, low, high)
        value, gradient = value_and_gradient(grid, middle + step)
        gradient *= free
        square = (gradient**2).sum(axis=1)
        way = np.divide(value, square, out=np.zeros_like(value), where=square > 0)[:, None] * gradient
        size = np.linalg.norm(way, axis=1)
        share = np.minimum(1.0, LONGEST / np.maximum(size, 1e-30))
        step -= np.where((active & np.isfinite(size))[:, None], share[:, None] * way, 0)
        is_short = size <= SHORTEST
        found |= active & is_short & ((size > 0) | (value == 0))
        active &= ~is_short & np.isfinite(size)
    assert np.isfinite(step).all()
    step = np.clip(step, low, high)
    cell = np.clip(np.floor(middle + step).astype(int), 0, np.array(grid.distance.shape)[::-1] - 2)
    found &= (np.linalg.norm(step, axis=1) <= reach) & grid.existing_cells()[tuple(cell.T[::-1])]
    return np.where(found[:, None], step, stay)


def neighbor_means(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The mean of the other corners of each vertex's triangles, (V, 3): each neighbour is in two of them."""
    faces, total, count = faces[:, :3], np.zeros_like(positions), np.zeros(len(positions))
    for corner in range(3):
        others = positions[faces[:, corner - 1]] + positions[faces[:, corner - 2]]
        np.add.at(total, faces[:, corner], others)
        np.add.at(count, faces[:, corner], 2)
    return total / count[:, None]


def towards(grid: Grid, edges: np.ndarray, step: np.ndarray, means: np.ndarray) -> np.ndarray:
    """Steps half-way to means of neighbours, along the tangent plane, (V, 3); not yet on the surface."""
    middle, free = middles(edges), free_axes(grid, edges)
    gradient = value_and_gradient(grid, middle + step)[1] * free
    normal = gradient / np.maximum(np.linalg.norm(gradient, axis=1), 1e-300)[:, None]
    way = (means - (middle + step)) * free
    way -= (way * normal).sum(axis=1)[:, None] * normal
    return step + np.where(np.isfinite(way).all(axis=1)[:, None], 0.5 * way, 0)
