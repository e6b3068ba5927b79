"""Read what headers of nibabel's classes say of stored values: their type, slope and intercept."""

from contextlib import suppress
from typing import Any

import numpy as np

from dmc_cli.errors import UnsupportedFormatError


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


def scaling(header: Any) -> tuple[float, float]:
    """Return slope and intercept of a header with `scl_slope` and `scl_inter`.

    A slope that is 0 or not finite means that there is none of both, an intercept that is not finite 0.
    """
    slope = float(header["scl_slope"])
    if slope == 0 or not np.isfinite(slope):
        return 1.0, 0.0  # nibabel's class for SPM2 would look for one in the range to display
    if not np.isfinite(header["scl_inter"]):
        header["scl_inter"] = 0
    return header.get_slope_inter()  # type: ignore[no-any-return]
