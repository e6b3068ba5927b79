"""Check the values and the place of a volume, whoever makes it: a reader, or one with an array."""

from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, Float64Array
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.settings import as_real, is_whole

WIDENED = {"e": "f4", "?": "u1"}
"""Type characters that are widened: half floats and truth values."""

FARTHEST_MM = float(np.finfo(np.float32).max)
"""No slice is farther from another one, nor from the origin of a scanner: float32 holds no such vertex."""


def check_shape(name: str, shape: tuple[int, ...]) -> None:
    """Raise VolumeError unless there are three axes with at least two nodes each."""
    nodes = " x ".join(str(n) for n in shape)
    if len(shape) != 3:
        raise UnsupportedFormatError(f"{name}: {nodes} nodes found; expected a volume with three axes")
    if any(n < 1 for n in shape):
        raise DamagedVolumeError(
            f"{name}: {nodes} nodes found; expected positive numbers; the header is damaged"
        )
    if any(n < 2 for n in shape):
        raise VolumeError(
            f"{name}: {nodes} nodes found; a surface needs at least two along each axis; "
            "give the whole volume, not a single slice"
        )


def check_affine(name: str, affine: Float64Array) -> None:
    """Raise DamagedVolumeError unless the affine is finite and its three axes span the space."""
    if not np.isfinite(affine).all():
        raise DamagedVolumeError(
            f"{name}: the geometry is not finite; expected spacing, axes and origin; correct its metadata"
        )
    with np.errstate(all="ignore"):
        lengths = np.linalg.norm(affine[:3, :3], axis=0)
        volume = abs(np.linalg.det(affine[:3, :3] / lengths)) if lengths.all() else 0.0
    if not np.isfinite(lengths).all() or not volume > 1e-6:
        raise DamagedVolumeError(
            f"{name}: the axes do not span the space (spacings "
            f"{', '.join(f'{length:g}' for length in lengths)} mm); expected three independent axes; correct "
            "its metadata"
        )


def storable_type(name: str, dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type itself if a volume can hold it: integers of 8 to 64 bits, float32, float64.

    Raises:
        UnsupportedFormatError: Complex, colour and other types.
    """
    if dtype.kind in "iu" or (dtype.kind == "f" and dtype.itemsize in (4, 8)):
        return dtype
    raise UnsupportedFormatError(
        f"{name}: values of type {dtype} found; expected integers of 8 to 64 bits, float32 or float64; "
        "convert the volume to one of these"
    )


def widened_type(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type that values of a type become in a volume."""
    return np.dtype(WIDENED.get(dtype.char, dtype))


def checked_values(name: str, values: Any) -> AnyArray:
    """Return a read-only view of an array [k, j, i] that a volume can hold, or else a converted copy.

    Copied are values in foreign byte order, not contiguous or not aligned, and half floats, which become
    float32; truth values become uint8. The caller's array is never changed.

    Raises:
        VolumeError: No array, without three axes of two nodes, or of values that are no real numbers.
    """
    if not isinstance(values, np.ndarray) or isinstance(values, np.ma.MaskedArray):
        raise UnsupportedFormatError(
            f"{name}: values in a {type(values).__name__} found; expected a NumPy array [k, j, i]; convert "
            "it with np.asarray, and fill what is masked, with NaN for no data"
        )
    check_shape(name, values.shape[::-1])
    native = storable_type(name, widened_type(values.dtype)).newbyteorder("=")
    held = np.require(values.view(np.ndarray), native, ["C", "A"]).view()
    held.flags.writeable = False
    return held


def _float64(given: Any) -> Float64Array:
    """Return a copy in double precision; ValueError unless all of it are real numbers, and there."""
    if isinstance(given, np.ma.MaskedArray):
        raise ValueError("a masked array may lack some")
    found = np.asarray(given)
    if found.dtype.kind not in "iuf":
        raise ValueError(f"{found.dtype} is no type of real numbers")
    return found.astype(np.float64)


def checked_affine(name: str, affine: Any) -> Float64Array:
    """Return a copy of a map from node indices to millimetres, shape (4, 4).

    Raises:
        VolumeError: It is of another shape, not finite, not invertible, or its last row is not 0, 0, 0, 1.
    """
    try:
        held = _float64(affine)
    except (TypeError, ValueError) as error:
        raise VolumeError(
            f"{name}: an affine of no real numbers found ({error}); expected a 4 x 4 matrix with "
            "nothing masked"
        ) from error
    if held.shape != (4, 4) or held[3].tolist() != [0, 0, 0, 1]:
        told = f"shape {held.shape}" if held.shape != (4, 4) else f"last row {held[3].tolist()}"
        raise VolumeError(
            f"{name}: an affine of {told} found; expected a 4 x 4 matrix with the last row 0, 0, 0, 1 that "
            "takes node indices (i, j, k, 1) to millimetres"
        )
    check_affine(name, held)
    return held


def checked_positions(name: str, positions: Any, slices: int, step: float) -> Float64Array:
    """Return a copy of the positions of uneven slices, from 0 and increasing; `step` is the affine's.

    Raises:
        VolumeError: They are not.
    """
    try:
        held = _float64(positions)
    except (TypeError, ValueError) as error:
        raise VolumeError(
            f"{name}: slice positions found that are no real numbers ({error}); expected {slices} with "
            "nothing masked"
        ) from error
    is_rising = (
        held.shape == (slices,) and np.isfinite(held).all() and held[0] == 0 and (np.diff(held) > 0).all()
    )
    if not is_rising:
        raise VolumeError(
            f"{name}: slice positions of shape {held.shape} found that begin with "
            f"{', '.join(f'{p:g}' for p in held.ravel()[:3])}; expected {slices} finite millimetres from 0 "
            "and increasing; sort the slices, and subtract the first one's position"
        )
    if held[-1] > FARTHEST_MM * min(step, 1.0):
        raise VolumeError(
            f"{name}: slice positions up to {held[-1]:g} mm found where the affine has steps of {step:g} mm; "
            f"expected fewer than {FARTHEST_MM:.2g} millimetres and steps; give both in millimetres"
        )
    return held


def checked_scale(name: str, slope: Any, intercept: Any) -> tuple[float, float]:
    """Return what gives stored values physical ones, in Python's own floats.

    Raises:
        VolumeError: Slope 0, or what is no finite number.
    """
    found = f"{name}: slope {slope!r:.80} and intercept {intercept!r:.80} found"
    try:
        held = as_real(slope), as_real(intercept)
    except (TypeError, OverflowError) as error:
        raise VolumeError(f"{found}; expected finite numbers") from error
    if not np.isfinite(held).all() or held[0] == 0:
        raise VolumeError(
            f"{found}; expected finite numbers, the slope not 0; leave them out where values are physical"
        )
    return held


def checked_padding(name: str, padding: Any) -> tuple[float, float] | None:
    """Return the closed range of stored values that mean no data, whole numbers exact.

    Raises:
        VolumeError: It is no range of numbers.
    """
    if padding is None:
        return None
    try:
        low, high = (int(end) if is_whole(end) else as_real(end) for end in padding)
        if low <= high and float(low) <= float(high):  # else no float64 holds them
            return low, high
    except (TypeError, ValueError, OverflowError):
        pass
    raise VolumeError(
        f"{name}: padding {padding!r:.80} found; expected two numbers, the lowest and the highest stored "
        "value that means no data"
    )
