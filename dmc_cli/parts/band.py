"""Map values so that what lies between two isovalues is inside: the surface of a band.

The mapped value is min(value - low, high - value), 0 at both ends and positive between. Where both ends of a
crossed edge lie on the same side of the band's middle, the crossing is exactly that of the values; where an
edge leads from the band's upper half to below it, or the reverse, it is that of the mapped values, since a
node cannot have two numbers. The surface is the trilinear one of the mapped values.

Integer values with ends that are integers too stay integers: the same nodes are inside as by two comparisons,
and none lies on the surface.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.volume import Volume, allocate_values

_WIDER: dict[str, Any] = {"int8": np.int16, "uint8": np.int16, "int16": np.int32, "uint16": np.int32}
"""Integers that hold the mapped values of shorter ones, and a number less for nodes without data."""


def band_volume(volume: Volume, low: float, high: float) -> Volume:
    """Return the volume whose isovalue 0 bounds what lies between two values, both ends among it.

    Args:
        volume: The volume; nodes without data stay so.
        low: The band's lower end, in physical values.
        high: Its upper end.
    """
    dtype = volume.values.dtype
    first, last = _stored_ends(volume, low, high)
    kept = _mapped_type(dtype, first, last)
    if dtype.kind in "iu" and kept.kind == "f":  # as an integer isovalue is cut half a step away
        first, last = first - 0.5 * (first == np.floor(first)), last + 0.5 * (last == np.floor(last))
    mapped = allocate_values(volume.path or "the band", volume.shape, kept)
    missing = np.iinfo(kept).min if kept.kind == "i" else np.nan
    for plane, out in zip(volume.values, mapped, strict=True):
        _map_plane(plane, out, (first, last), volume.padding, missing)
    padding = (float(missing), float(missing)) if kept.kind == "i" and volume.padding is not None else None
    return replace(
        volume,
        values=mapped,
        slope=abs(volume.slope),
        intercept=0.0,
        padding=padding,
        gradient=None,
        formula=None,
    )


def band_bytes(volume: Volume, low: float, high: float) -> int:
    """Return the bytes that the mapped values take."""
    return (
        math.prod(volume.shape) * _mapped_type(volume.values.dtype, *_stored_ends(volume, low, high)).itemsize
    )


def _stored_ends(volume: Volume, low: float, high: float) -> tuple[float, float]:
    """Return a band's ends in stored values, rounded to their type as any isovalue is."""
    first, last = sorted((end - volume.intercept) / volume.slope for end in (low, high))
    if volume.values.dtype.kind == "f":
        first, last = (float(volume.values.dtype.type(end)) for end in (first, last))
    return first, last


def _mapped_type(dtype: np.dtype[Any], first: float, last: float) -> np.dtype[Any]:
    """Return the type of mapped values: integers where the ends are, else floats that lose no sign."""
    if dtype.kind == "f":
        return dtype
    wider = _WIDER.get(dtype.name)
    if wider is None:
        return np.dtype(np.float64)
    limit = np.iinfo(wider).max // 2
    is_whole = first == np.floor(first) and last == np.floor(last) and max(abs(first), abs(last)) < limit
    return np.dtype(wider if is_whole else np.float32)


def _map_plane(
    plane: AnyArray,
    out: AnyArray,
    ends: tuple[float, float],
    padding: tuple[float, float] | None,
    missing: float,
) -> None:
    """Write the mapped values of a slice."""
    values = plane if plane.dtype.kind == "f" and plane.dtype.itemsize == 8 else plane.astype(np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        mapped = np.minimum(values - ends[0], ends[1] - values)
        if padding is not None:
            mapped[(values >= padding[0]) & (values <= padding[1])] = missing
        if out.dtype.kind == "f":
            largest = np.finfo(out.dtype).max
            mapped = np.where(np.isfinite(values) & ~np.isnan(mapped), mapped.clip(-largest, largest), np.nan)
        out[...] = mapped
