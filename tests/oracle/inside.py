"""Find which nodes are inside: the isovalue in stored values, and the distance of each node to it.

Inside is value >= isovalue, in physical values. Values stay as stored, so the isovalue goes through
slope and intercept; with a negative slope the inside is stored <= isovalue. Distances are in the
sense of physical values: positive or zero inside, negative outside, whatever the slope's sign.
"""

import math

import numpy as np


def stored_isovalue(dtype: np.dtype, isovalue: float, slope: float, intercept: float) -> float:
    """The isovalue that is cut, in stored values.

    For integers an isovalue that is an integer goes half a step outwards, so that no node lies on
    the surface and the inside set stays; for floats it is rounded to their type.
    """
    stored = (isovalue - intercept) / slope
    if dtype.kind == "f":
        return float(dtype.type(stored))
    if stored == math.floor(stored):
        return stored - 0.5 if slope > 0 else stored + 0.5
    return stored


def distances(values: np.ndarray, stored: float, slope: float) -> np.ndarray:
    """Distance of every node to the isovalue, float64, >= 0 inside."""
    distance = values.astype(np.float64) - stored
    return distance if slope > 0 else 0.0 - distance


def has_data(values: np.ndarray, padding: tuple[float, float] | None) -> np.ndarray:
    """Which nodes hold data: finite values outside the closed range of the padding."""
    data = np.isfinite(values)
    if padding is not None:
        exact = values.astype(np.float64)
        data &= (exact < padding[0]) | (exact > padding[1])
    return data


def next_lower_distance(dtype: np.dtype, stored: float, slope: float) -> float:
    """Distance of the number next to the isovalue on the outside, in the values' type."""
    if dtype.kind != "f":
        return -1.0
    towards = dtype.type(-np.inf if slope > 0 else np.inf)
    return -abs(float(np.nextafter(dtype.type(stored), towards)) - stored)
