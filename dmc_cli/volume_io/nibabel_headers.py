"""Read what headers of nibabel's classes say of stored values: their type, slope and intercept."""

from contextlib import suppress
from typing import Any

import numpy as np

from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.notices import Notice


def value_type(header: Any, name: str) -> np.dtype[Any]:
    """Return the type of a stored value, with its byte order, of a header that has a field `datatype`.

    Raises:
        UnsupportedFormatError: It is no real number's.
    """
    with suppress(KeyError):  # a code that nibabel does not know
        dtype: np.dtype[Any] = header.get_data_dtype()
        if dtype.kind in "iuf" and dtype.itemsize <= 8:
            return dtype
    label = header.get_value_label("datatype")
    raise UnsupportedFormatError(
        f"{name}: values of type {'unknown' if label.startswith('<') else label}, datatype code "
        f"{header['datatype']} found; expected integers of 8 to 64 bits, float32 or float64; convert the "
        "volume to one of these"
    )


def scaling(header: Any) -> tuple[float, float, tuple[Notice, ...]]:
    """Return slope and intercept of a header with `scl_slope` and `scl_inter`, and what is told of them.

    A slope that is 0 or NaN means that there is none of both; one that is infinite, and an intercept that is
    not finite, are none and told.
    """
    slope, intercept = float(header["scl_slope"]), float(header["scl_inter"])
    if slope == 0 or np.isnan(slope):
        return 1.0, 0.0, ()
    found = f"the header's scl_slope is {slope:g}, its scl_inter {intercept:g}"
    if np.isinf(slope):
        return 1.0, 0.0, (Notice("W-RESCALE-UNKNOWN", f"{found}; stored values are taken as they are"),)
    if not np.isfinite(intercept):
        return slope, 0.0, (Notice("W-RESCALE-UNKNOWN", f"{found}; 0 is taken for the latter"),)
    return slope, intercept, ()


def negative_lengths(header: Any) -> tuple[Notice, ...]:
    """Return a warning where `pixdim` has a negative distance along x, y or z, which is no direction."""
    told = header["pixdim"][1:4].tolist()
    if not min(told) < 0:
        return ()
    sizes = ", ".join(f"{length:g}" for length in told)
    sentence = f"the header's pixdim has distances of {sizes}; they are taken without sign, no axis is turned"
    return (Notice("W-GEOMETRY-CONTRADICTED", sentence),)
