"""Read what attributes of an array say of its values by the Climate and Forecast conventions (CF).

netCDF 4 keeps them in HDF5, xarray in Zarr. CF 8.1: a physical value is `scale_factor` times the stored one
and `add_offset`. CF 2.5.1: `_FillValue` or `missing_value` stands where there is none.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.notices import Notice

MARKS = ("_FillValue", "missing_value")


def scale_of_values(attributes: Mapping[str, Any]) -> tuple[float, float, tuple[Notice, ...]]:
    """Return slope and intercept, 1 and 0 where attributes tell none, and what is told of them."""
    told = attributes.get("scale_factor", 1.0), attributes.get("add_offset", 0.0)
    slope, intercept = map(_number, told)
    if slope and intercept is not None:
        return slope, intercept, ()
    sentence = f"scale_factor {told[0]!r:.40} and add_offset {told[1]!r:.40} are none; values are as stored"
    return 1.0, 0.0, (Notice("W-RESCALE-UNKNOWN", f"the array's {sentence}"),)


def marked_values(attributes: Mapping[str, Any], values: AnyArray) -> tuple[Notice, ...]:
    """Return what is told of stored values, shape (nz, ny, nx), that an attribute says are none."""
    for key in MARKS:
        mark = _number(attributes.get(key))
        if mark is not None and any(bool((plane == mark).any()) for plane in values):
            sentence = f"the array's {key} {mark:g} marks nodes without a value; they are taken as stored"
            return (Notice("W-VALUES-MAPPED", sentence),)
    return ()


def _number(told: Any) -> float | None:
    """Return the finite number that an attribute is, or an array of one; else None."""
    try:
        found = np.asarray(told)
    except ValueError:  # lists of different lengths
        return None
    if found.size != 1 or found.dtype.kind not in "iuf" or not np.isfinite(found).all():
        return None
    return float(found.item())
