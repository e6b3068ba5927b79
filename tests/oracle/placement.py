"""Where a vertex lies in its cell: the papers' three placements (2021, section 3.1.2; 2020, equation 3).

`f` holds the eight corner distances of a cell; a polygon is the set of its crossed edges; points are
local coordinates (u, v, w). Double precision throughout.
"""

import numpy as np

from tests.oracle.cube import AXES, CORNERS, EDGES
from tests.oracle.faces import Cell
from tests.oracle.grid import Grid

COARSE, FINE = 7, 25
DAMPING, STEPS = 0.5, 4
MANY_EDGES = 6


def corner_distances(grid: Grid, cell: Cell) -> np.ndarray:
    """The distances to the isovalue at a cell's corners, shape (8,)."""
    i, j, k = cell
    return np.array([grid.distance[k + c, j + b, i + a] for a, b, c in CORNERS])


def interpolate(f: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The trilinear interpolant at points of shape (..., 3)."""
    weights = np.where(CORNERS, points[..., None, :], 1.0 - points[..., None, :]).prod(axis=-1)
    return weights @ f


def gradient(f: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Its derivatives: differences along the axes, since it is linear along each."""
    low, high = np.tile(point, (3, 1)), np.tile(point, (3, 1))
    np.fill_diagonal(low, 0.0)
    np.fill_diagonal(high, 1.0)
    return interpolate(f, high) - interpolate(f, low)


def crossings(f: np.ndarray, polygon: frozenset[int]) -> np.ndarray:
    """The points where the surface crosses the polygon's edges, shape (n, 3)."""
    found = []
    for a, b in (EDGES[edge] for edge in sorted(polygon)):
        t = f[a] / (f[a] - f[b])
        found.append((1.0 - t) * np.array(CORNERS[a]) + t * np.array(CORNERS[b]))
    return np.array(found)


def solved_axis(f: np.ndarray, points: np.ndarray) -> int:
    """The axis that is solved for: the box's thinnest, with many edges the steepest; ties z, y, x."""
    sizes = np.ptp(points, axis=0)
    wanted = -sizes if len(points) < MANY_EDGES else np.abs(gradient(f, points.mean(axis=0)))
    return max(AXES, key=lambda axis: (wanted[axis], axis))


def samples(f: np.ndarray, points: np.ndarray, axis: int, count: int) -> np.ndarray:
    """The samples on a lattice of count x count points that lie in the polygon's box, shape (n, 3)."""
    low, high = points.min(axis=0), points.max(axis=0)
    first, second = (other for other in AXES if other != axis)
    steps = np.arange(1, count + 1) / (count + 1)
    found = np.zeros((count, count, 3))
    found[..., first] = (low[first] + steps * (high[first] - low[first]))[None, :]
    found[..., second] = (low[second] + steps * (high[second] - low[second]))[:, None]
    at_one = found.copy()
    at_one[..., axis] = 1.0
    below, above = interpolate(f, found), interpolate(f, at_one)
    with np.errstate(divide="ignore", invalid="ignore"):
        found[..., axis] = below / (below - above)
        valid = (found[..., axis] >= low[axis]) & (found[..., axis] <= high[axis])
    return found[valid]


def place_sampled(f: np.ndarray, polygon: frozenset[int]) -> tuple[np.ndarray, bool]:
    """The sample nearest to the mean of the crossings; without any the mean, and True."""
    points = crossings(f, polygon)
    mean = points.mean(axis=0)
    axis = solved_axis(f, points)
    for count in (COARSE, FINE):
        found = samples(f, points, axis, count)
        if len(found):
            return found[np.argmin(np.linalg.norm(found - mean, axis=1))], False
    return mean, True


def place_iterative(f: np.ndarray, polygon: frozenset[int]) -> tuple[np.ndarray, bool]:
    """The mean after damped steps along the gradient, or the mean itself if they do not help, and True."""
    mean = crossings(f, polygon).mean(axis=0)
    point = mean
    for _ in range(STEPS):
        slopes = gradient(f, point)
        if not slopes.any():
            break
        following = point - DAMPING * interpolate(f, point) / (slopes @ slopes) * slopes
        if (following < 0).any() or (following > 1).any():
            break
        point = following
    start = abs(interpolate(f, mean))
    if abs(interpolate(f, point)) < start:
        return point, False
    return mean, bool(start > 0)


def place_at_centroid(f: np.ndarray, polygon: frozenset[int]) -> tuple[np.ndarray, bool]:
    """The mean of the crossings."""
    return crossings(f, polygon).mean(axis=0), False


PLACEMENTS = {"sampled": place_sampled, "iterative": place_iterative, "centroid": place_at_centroid}
