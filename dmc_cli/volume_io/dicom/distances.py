"""Judge the distances between slices by the one that most of them share: copies, gaps, uneven ones.

A fixed length would take the slices of a micrometre series for copies, and neighbours alone do not show
a gap beside another gap.
"""

import numpy as np

from dmc_cli.array_types import Float64Array

SAME_PLACE = 0.01
SAME_PLACE_MM = 0.01
"""Slices closer than this many times the shared distance, and than this, are in one place."""

LEAST_PLACE = 1e-3
"""The same in pixels, whatever the distances are: positions are rounded."""

MOST_PLACE = 0.1
"""Nor farther than this in pixels: beside a wide gap those of micrometres seem near."""

EVEN = 0.03
EVEN_MM = 0.01
"""Slices no farther than either from even distances count as even: scanners round positions."""

MISSING = 1.9
"""A distance beyond this many times the shared one is a gap."""

ALIKE = 0.1
"""Largest relative difference of distances that count as shared."""

MOST_TIMES = 6
"""Multiples of the smallest distance that show it to be the true one; larger ones would fit by chance."""

CANDIDATES = 64
"""Distances that are tried as the shared one, at most."""


def shared_distance(places: Float64Array, copies: bool = True) -> float:
    """Return the distance that most neighbours share; 0 if there is none.

    Args:
        places: Sorted positions along the normal, shape (n,).
        copies: Whether several may be one place, rounded; they are taken as one then.
    """
    closest = SAME_PLACE if copies else 0.0
    distances = np.diff(places)
    positive = np.unique(distances[distances > 0])
    if len(positive) > CANDIDATES:
        positive = positive[np.linspace(0, len(positive) - 1, CANDIDATES).astype(int)]
    best, most, best_left = 0.0, (0.0, 0), np.empty(0)
    for candidate in positive:
        starts = np.concatenate([[True], distances > closest * candidate])
        left = np.diff(places[starts])
        count = int((np.abs(left - candidate) <= ALIKE * candidate).sum())
        share = count / max(len(left), 1)
        if share > most[0] + 1e-9:
            best, most, best_left = float(candidate), (share, count), left
    if most[1] == 1 and len(best_left) > 1:
        # no two are alike
        return float(np.sort(best_left)[(len(best_left) - 1) // 2])
    return best


def same_place(places: Float64Array, pixel: float) -> float:
    """Return the distance below which slices lie in one place; `pixel` is the smaller one's side."""
    most = min(SAME_PLACE_MM, MOST_PLACE * pixel)
    return min(max(SAME_PLACE * shared_distance(places), LEAST_PLACE * pixel), most)


def gaps(distances: Float64Array) -> list[int]:
    """Return the numbers of the distances, one a pair of neighbouring places, where slices are missing.

    These are far larger than the shared distance. Where the smallest one is a fraction of all others, it is
    the true one, however many slices are missing.
    """
    if len(distances) < 2:
        return []
    places = np.concatenate([[0.0], np.cumsum(distances)])
    usual = shared_distance(places, copies=False)
    smallest = float(distances.min())
    times = distances / smallest
    near = np.rint(times)
    fits = np.abs(times - near) <= ALIKE / 2 * near
    if usual > MISSING * smallest and fits.all() and near.max() <= MOST_TIMES:
        usual = smallest
    return [int(n) for n in np.flatnonzero(distances > MISSING * usual)]


def is_even(places: Float64Array) -> bool:
    """Return whether places lie at even distances, as far as scanners round them."""
    allowed = min(EVEN_MM, EVEN * shared_distance(places, copies=False))
    return bool(np.abs(places - np.linspace(places[0], places[-1], len(places))).max() <= allowed)
