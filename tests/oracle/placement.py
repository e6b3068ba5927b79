"""Place a vertex in its cell by the papers' three placements (2021, section 3.1.2; 2020, equation 3).

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


def solve_along(f: np.ndarray, points: np.ndarray, axis: int) -> np.ndarray:
    """The points of the surface on the lines through `points` along an axis; NaN or infinite without any."""
    low, high = points.copy(), points.copy()
    low[..., axis], high[..., axis] = 0.0, 1.0
    below, above = interpolate(f, low), interpolate(f, high)
    found = points.copy()
    with np.errstate(divide="ignore", invalid="ignore"):
        found[..., axis] = below / (below - above)
    return found


def solve_by_falling_gradient(
    f: np.ndarray, mean: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray | None:
    """The first solution from the mean in a box, the axes by falling gradient; ties x, y, z."""
    steepness = np.abs(gradient(f, mean))
    for axis in sorted(AXES, key=lambda axis: (-steepness[axis], axis)):
        found = solve_along(f, mean, axis)
        if low[axis] <= found[axis] <= high[axis]:
            return found
    return None


def solve_on_lattice(f: np.ndarray, points: np.ndarray, count: int) -> np.ndarray | None:
    """The solution in the polygon's box nearest to the mean, on count x count lines along each axis."""
    low, high, mean = points.min(axis=0), points.max(axis=0), points.mean(axis=0)
    steps = np.arange(1, count + 1) / (count + 1)
    found = []
    for axis in AXES:
        outer, inner = (axis + 1) % 3, (axis + 2) % 3
        starts = np.tile(mean, (count, count, 1))
        starts[..., outer] = (low[outer] + steps * (high[outer] - low[outer]))[:, None]
        starts[..., inner] = (low[inner] + steps * (high[inner] - low[inner]))[None, :]
        solutions = solve_along(f, starts, axis)
        found.append(solutions[(solutions[..., axis] >= low[axis]) & (solutions[..., axis] <= high[axis])])
    return nearest(np.concatenate(found), mean)


def nearest(points: np.ndarray, to: np.ndarray) -> np.ndarray | None:
    """The first of the points nearest to another one, or None without points."""
    return points[np.argmin(np.linalg.norm(points - to, axis=1))] if len(points) else None


def root_on_segment(f: np.ndarray, start: np.ndarray, end: np.ndarray, samples: int = 16) -> np.ndarray:
    """The root in the first of `samples` steps to the end over which the sign changes; else the end."""
    at = np.linspace(0.0, 1.0, samples + 1)[:-1, None]
    signs = interpolate(f, start + at * (end - start)) >= 0
    changes = np.flatnonzero(signs != signs[0])
    if not len(changes):
        return end
    low, high = (changes[0] - 1) / samples, changes[0] / samples
    for _ in range(60):
        middle = 0.5 * (low + high)
        if (interpolate(f, start + middle * (end - start)) >= 0) == signs[0]:
            low = middle
        else:
            high = middle
    return start + low * (end - start)


def place_exactly(f: np.ndarray, polygon: frozenset[int]) -> tuple[np.ndarray, str]:
    """A polygon's vertex on the surface, and which attempt found it."""
    points = crossings(f, polygon)
    mean = points.mean(axis=0)
    attempts = {
        "axis": lambda: solve_by_falling_gradient(f, mean, points.min(axis=0), points.max(axis=0)),
        "coarse lattice": lambda: solve_on_lattice(f, points, COARSE),
        "fine lattice": lambda: solve_on_lattice(f, points, FINE),
        "axis in the cell": lambda: solve_by_falling_gradient(f, mean, np.zeros(3), np.ones(3)),
        "segment": lambda: nearest(np.array([root_on_segment(f, mean, p) for p in points]), mean),
    }
    for name, attempt in attempts.items():
        found = attempt()
        if found is not None:
            return found, name
    raise AssertionError("the mean of no crossings")
