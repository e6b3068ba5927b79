"""Read what attributes of an array say of its values by the Climate and Forecast conventions (CF).

netCDF 4 keeps them in HDF5, xarray in Zarr. CF 8.1: a physical value is `scale_factor` times the stored one
and `add_offset`. CF 2.5.1: `_FillValue` and `missing_value` stand where there is none, and so does what lies
outside `valid_range`, or `valid_min` and `valid_max`; all are stored values, but bounds that are no whole
numbers beside scaled whole ones are physical. The netCDF users' guide: `_Unsigned` says whether whole numbers
have a sign, whatever their type is.
"""

import base64
import binascii
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.notices import Notice

MARKS = ("_FillValue", "missing_value")
BOUNDS = ("valid_range", "valid_min", "valid_max")

_ROUNDED = 1e-6
"""By how much a bound in stored units may be beside a whole number that is meant."""


def scale_of_values(attributes: Mapping[str, Any]) -> tuple[float, float, tuple[Notice, ...]]:
    """Return slope and intercept, 1 and 0 where attributes tell none, and what is told of them."""
    told = attributes.get("scale_factor", 1.0), attributes.get("add_offset", 0.0)
    slope, intercept = map(_number, told)
    if slope and intercept is not None:
        return slope, intercept, ()
    sentence = f"scale_factor {told[0]!r:.40} and add_offset {told[1]!r:.40} are none; values are as stored"
    return 1.0, 0.0, (Notice("W-RESCALE-UNKNOWN", f"the array's {sentence}"),)


def true_type(attributes: Mapping[str, Any], dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type that stored whole numbers have in truth: with a sign or without, by `_Unsigned`."""
    told = attributes.get("_Unsigned", "")
    told = told.decode("latin-1") if isinstance(told, bytes) else str(told)
    kind = {"true": "u", "false": "i"}.get(told.lower())
    return np.dtype(f"{dtype.byteorder}{kind}{dtype.itemsize}") if kind and dtype.kind in "iu" else dtype


def without_missing(
    attributes: Mapping[str, Any], values: AnyArray, scale: tuple[float, float]
) -> tuple[tuple[float, float] | None, tuple[Notice, ...]]:
    """Mark the nodes whose value attributes say is none; what is told of them.

    Args:
        attributes: Those of the array.
        values: Stored values, shape (nz, ny, nx); missing ones all become NaN, or the first whole number
            that is found to be one.
        scale: Slope and intercept.

    Returns:
        The closed range of stored values that mean no data, None where there is none or it is NaN.
    """
    marks, odd = _marks(attributes, values.dtype)
    low, high = _bounds(attributes, values.dtype, scale)
    told = [
        Notice("W-VALUES-MAPPED", f"the array's {key} {attributes[key]!r:.40} is no number; not used")
        for key in odd
    ]
    if not marks and low == -math.inf and high == math.inf:
        return None, tuple(told)
    is_whole = values.dtype.kind in "iu"
    mark = None if is_whole else values.dtype.type(np.nan)
    count = 0
    for plane in values:
        missing = np.isin(plane, marks) if marks else np.zeros(plane.shape, bool)
        if low > -math.inf:
            missing |= plane < low
        if high < math.inf:
            missing |= plane > high
        if missing.any():
            mark = plane[missing][0] if mark is None else mark
            plane[missing] = mark
            count += int(missing.sum())
    if not count:
        return None, tuple(told)
    keys = " and ".join(key for key in (*MARKS, *BOUNDS) if key in attributes and key not in odd)
    told.append(Notice("W-NO-DATA", f"{count} nodes have no value, as the array's {keys} says"))
    return (None if mark is None or not is_whole else (int(mark), int(mark))), tuple(told)


def _marks(attributes: Mapping[str, Any], dtype: np.dtype[Any]) -> tuple[list[Any], list[str]]:
    """Return the values of a type that stand for none, and the attributes that are no numbers."""
    found, odd = [], []
    for key in MARKS:
        if key not in attributes:
            continue
        numbers = _numbers(attributes[key])
        if not numbers:
            odd.append(key)
        for number in numbers:
            if dtype.kind in "iu" and "_Unsigned" in attributes and math.isfinite(number):
                # the same bits with a sign, or without
                bits, low = 8 * dtype.itemsize, int(np.iinfo(dtype).min)
                number = (int(number) - low) % (1 << bits) + low  # noqa: PLW2901
            if dtype.kind == "f":
                with np.errstate(over="ignore"):
                    found.append(dtype.type(number))
            elif math.isfinite(number) and number == int(number):
                low, high = np.iinfo(dtype).min, np.iinfo(dtype).max
                found += [dtype.type(int(number))] if low <= number <= high else []
    return found, odd


def _bounds(
    attributes: Mapping[str, Any], dtype: np.dtype[Any], scale: tuple[float, float]
) -> tuple[float, float]:
    """Return the least and the largest stored value that is one, infinite where nothing tells it."""
    ends = _numbers(attributes.get("valid_range", ()))
    low, high = ends if len(ends) == 2 else (-math.inf, math.inf)
    if len(ends) != 2:
        low = next(iter(_numbers(attributes.get("valid_min", ()))), low)
        high = next(iter(_numbers(attributes.get("valid_max", ()))), high)
    if math.isnan(low) or math.isnan(high) or low > high:
        return -math.inf, math.inf
    if dtype.kind == "f":
        with np.errstate(over="ignore"):
            return float(dtype.type(low)), float(dtype.type(high))
    is_real = any(_is_real(attributes[key]) for key in BOUNDS if key in attributes)
    if is_real and scale != (1.0, 0.0):
        first, last = sorted((end - scale[1]) / scale[0] for end in (low, high))
        low = first if first == -math.inf else math.ceil(first - _ROUNDED)
        high = last if last == math.inf else math.floor(last + _ROUNDED)
    if dtype.kind == "u" and "_Unsigned" in attributes and low < 0:
        return -math.inf, math.inf
    return low, high


def _is_real(told: Any) -> bool:
    try:
        return np.asarray(told).dtype.kind == "f"
    except ValueError:  # lists of different lengths
        return False


def _numbers(told: Any) -> list[float]:
    """Return the numbers that an attribute is; of a text that it says, or that xarray packed as base64."""
    if isinstance(told, bytes):
        told = told.decode("latin-1")
    if isinstance(told, str):
        return _of_text(told)
    try:
        found = np.asarray(told)
    except ValueError:  # lists of different lengths
        return []
    return [entry.item() for entry in found.reshape(-1)] if found.dtype.kind in "iuf" else []


def _of_text(told: str) -> list[float]:
    try:
        return [float(told)]
    except ValueError:
        pass
    try:
        content = base64.b64decode(told, validate=True)
    except (binascii.Error, ValueError):
        return []
    return [float(np.frombuffer(content, "<f8")[0])] if len(content) == 8 else []


def _number(told: Any) -> float | None:
    """Return the finite number that an attribute is, or an array of one; else None."""
    found = [] if isinstance(told, str | bytes) else _numbers(told)
    return float(found[0]) if len(found) == 1 and math.isfinite(found[0]) else None
