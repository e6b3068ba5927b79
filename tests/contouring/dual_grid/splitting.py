"""Split quads into triangles as the papers do for their figures, and count irregular vertices."""

import numpy as np


def least_angles(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The least angle of each triangle, (T,)."""
    corners = points[triangles]
    angles = []
    for c in range(3):
        to_next = corners[:, (c + 1) % 3] - corners[:, c]
        to_last = corners[:, (c + 2) % 3] - corners[:, c]
        across = np.linalg.norm(np.cross(to_next, to_last), axis=1)
        angles.append(np.arctan2(across, np.einsum("tk,tk->t", to_next, to_last)))
    return np.min(angles, axis=0)


def split_by_angle(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Triangles by the diagonal with the larger least angle; ties take that of corners 1 and 3."""
    first = quads[:, [[0, 1, 2], [0, 2, 3]]]
    second = quads[:, [[0, 1, 3], [1, 2, 3]]]
    points = points.astype(np.float64)
    worst = [np.minimum(*(least_angles(points, pair[:, n]) for n in range(2))) for pair in (first, second)]
    return np.where((worst[0] > worst[1])[:, None, None], first, second).reshape(-1, 3)


def irregular_triangle_percent(triangles: np.ndarray, count: int) -> float:
    """Share of `count` vertices that have not exactly six mesh edges."""
    ends = np.sort(np.concatenate([triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]), axis=1)
    valence = np.bincount(np.unique(ends, axis=0).ravel(), minlength=count)
    return 100.0 * (1.0 - np.count_nonzero(valence == 6) / count)
