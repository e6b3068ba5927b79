"""Measure meshes of triangles, rows of four corners whose fourth is -1, from their numbers alone."""

import numpy as np

from tests.oracle.edges import pair_valences, vertex_pairs


def euler_characteristic(faces: np.ndarray) -> int:
    """V - E + F, of the vertices that faces name."""
    corners = faces[:, :3]
    return len(np.unique(corners)) - len(np.unique(vertex_pairs(corners))) + len(corners)


def triangle_valences(faces: np.ndarray) -> np.ndarray:
    """How many mesh edges each vertex has; all have some."""
    return pair_valences(faces[:, :3], int(faces.max(initial=-1)) + 1)


def radii_ratios(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Twice the radius of each triangle's inner circle by that of its outer one, shape (F,)."""
    corners = points.astype(float)[faces[:, :3]]
    a, b, c = (np.linalg.norm(corners[:, n] - corners[:, n - 1], axis=1) for n in range(3))
    product = a * b * c
    shape = (a + b - c) * (b + c - a) * (c + a - b)
    return np.divide(shape, product, out=np.zeros(len(faces)), where=product > 0)
