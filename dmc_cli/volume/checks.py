"""What the values and the place of a volume must be, whoever makes it: a reader, or one with an array."""

from typing import Any

import numpy as np

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError, VolumeError

_Array = np.ndarray[Any, np.dtype[Any]]
_Float64 = np.ndarray[Any, np.dtype[np.float64]]

WIDENED = {"e": "f4", "?": "u1"}
"""Type characters that are widened: half floats and truth values."""


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


def check_affine(name: str, affine: _Float64) -> None:
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
    """The type itself if a volume can hold it: integers of 8 to 64 bits, float32, float64.

    Raises:
        UnsupportedFormatError: Complex, colour and other types.
    """
    if dtype.kind in "iu" or (dtype.kind == "f" and dtype.itemsize in (4, 8)):
        return dtype
    raise UnsupportedFormatError(
        f"{name}: values of type {dtype} found; expected integers of 8 to 64 bits, float32 or float64; "
        "convert the volume to one of these"
    )


def checked_values(name: str, values: Any) -> _Array:
    """A read-only view of an array [k, j, i] that a volume can hold, or a converted copy where none can be.

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
    dtype = np.dtype(WIDENED.get(values.dtype.char, values.dtype))
    native = storable_type(name, dtype).newbyteorder("=")
    held = np.require(values.view(np.ndarray), native, ["C", "A"]).view()
    held.flags.writeable = False
    return held


def _float64(given: Any) -> _Float64:
    """A copy in double precision; ValueError for what is no array of real numbers."""
    found = np.asarray(given)
    if found.dtype.kind not in "iuf":
        raise ValueError(f"{found.dtype} is no type of real numbers")
    return found.astype(np.float64)


def checked_affine(name: str, affine: Any) -> _Float64:
    """A copy of a map from node indices to millimetres, shape (4, 4).

    Raises:
        VolumeError: It is of another shape, not finite, not invertible, or its last row is not 0, 0, 0, 1.
    """
    try:
        held = _float64(affine)
    except (TypeError, ValueError) as error:
        raise VolumeError(f"{name}: an affine of no real numbers found; expected a 4 x 4 matrix") from error
    if held.shape != (4, 4) or (np.isfinite(held).all() and held[3].tolist() != [0, 0, 0, 1]):
        told = f"shape {held.shape}" if held.shape != (4, 4) else f"last row {held[3].tolist()}"
        raise VolumeError(
            f"{name}: an affine of {told} found; expected a 4 x 4 matrix with the last row 0, 0, 0, 1 that "
            "takes node indices (i, j, k, 1) to millimetres"
        )
    check_affine(name, held)
    return held


def checked_positions(name: str, positions: Any, slices: int) -> _Float64:
    """A copy of the positions of uneven slices: one a slice, from 0 and increasing.

    Raises:
        VolumeError: They are not.
    """
    try:
        held = _float64(positions)
    except (TypeError, ValueError) as error:
        raise VolumeError(
            f"{name}: slice positions found that are no real numbers; expected {slices}"
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
    return held


def check_meaning(name: str, slope: float, intercept: float, padding: tuple[float, float] | None) -> None:
    """Refuse what gives stored values no physical ones.

    Raises:
        VolumeError: Slope 0, numbers that are not finite, or padding that is no range.
    """
    try:
        is_scale = bool(np.isfinite(slope) and slope != 0 and np.isfinite(intercept))
        is_range = padding is None or (len(padding) == 2 and padding[0] <= padding[1])
    except (TypeError, ValueError) as error:
        raise VolumeError(
            f"{name}: slope {slope!r}, intercept {intercept!r}, padding {padding!r} found; expected numbers"
        ) from error
    if not is_scale:
        raise VolumeError(
            f"{name}: slope {slope} and intercept {intercept} found; expected finite numbers, the slope "
            "not 0; leave them out where values are physical"
        )
    if not is_range:
        raise VolumeError(
            f"{name}: padding {padding} found; expected the lowest and the highest stored value that means "
            "no data"
        )
