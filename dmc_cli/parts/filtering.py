"""Smooth a volume's values, or take them at other distances; the surface is that of the new values.

Smoothing is by a Gaussian, cut off at four standard deviations. New nodes begin at the first one and lie as
far apart as is asked for. Where that is farther than the nodes are, a new value is a mean in a triangle that
reaches a new distance either way, so that nothing finer than the new nodes is left to alias; where it is
nearer, the trilinear function is sampled. Beyond the volume's ends its last values go on. Nodes without data
weigh nothing.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmc_cli.array_types import BoolArray, Float32Array, Float64Array
from dmc_cli.errors import SettingsError
from dmc_cli.parts.blending import Blend, blend_of, blended
from dmc_cli.runtime import Device
from dmc_cli.volume import Volume

CUT_OFF = 4.0
"""Standard deviations of a Gaussian that count."""

ROUNDING = 1e-6
"""Share of a distance by which a new node may lie beyond the last one."""

MOST_NODES = 1 << 15
"""New nodes along an axis, at most."""


def smoothed_volume(volume: Volume, sigma: float, device: Device) -> Volume:
    """Return a volume smoothed by a Gaussian of a standard deviation in mm.

    Raises:
        SettingsError: It is too small to change anything.
    """
    if sigma < 0.1 * min(volume.spacing):
        raise SettingsError(
            f"smooth_volume is {sigma:g} mm, less than a tenth of the nodes' distance; expected at least"
            f" {0.1 * min(volume.spacing):g} mm; choose more, or leave it out"
        )
    blends = [_gaussian(places, sigma) for places in _places(volume)]
    return _filtered(volume, blends, device, keeps_nodes=True)


def resampled_volume(volume: Volume, step: str, device: Device) -> Volume:
    """Return a volume with nodes as far apart as `step` says, in mm, or `isotropic`, as the nearest are.

    Raises:
        SettingsError: That makes fewer than two nodes along an axis, or too many.
    """
    blends, affine = resampling(volume, step)
    return _filtered(volume, blends, device, keeps_nodes=False, affine=affine, slice_positions=None)


def resampling(volume: Volume, step: str) -> tuple[list[Blend | None], Float64Array]:
    """Return the sums along x, y and z that resampling takes, None where nodes stay, and the new affine.

    Raises:
        SettingsError: That makes fewer than two nodes along an axis, or too many.
    """
    places, spacing = _places(volume), _new_spacing(volume, step)
    blends: list[Blend | None] = []
    affine = volume.affine.copy()
    for axis, (old, distance) in enumerate(zip(places, (spacing,) * 3, strict=True)):
        count = new_count(old, distance)
        if count > MOST_NODES or count < 2:
            raise SettingsError(
                f"resample is {step}, which makes {count} nodes along {'xyz'[axis]} of {len(old)}; expected 2"
                f" to {MOST_NODES}; choose another distance"
            )
        is_same = volume.slice_positions is None or axis < 2
        is_same = is_same and abs(distance - volume.spacing[axis]) <= ROUNDING * distance
        blends.append(None if is_same else _triangle(old, distance, count))
        if not is_same:
            affine[:3, axis] *= distance / volume.spacing[axis]
    return blends, affine


def resampled_shape(volume: Volume, step: str) -> tuple[int, int, int]:
    """Return the nodes along x, y and z that resampling makes."""
    spacing = _new_spacing(volume, step)
    x, y, z = (new_count(old, spacing) for old in _places(volume))
    return x, y, z


def new_count(places: Float64Array, distance: float) -> int:
    """Return how many nodes at a distance there are from the first place to the last."""
    return math.floor((places[-1] - places[0]) / distance + ROUNDING) + 1


def _new_spacing(volume: Volume, step: str) -> float:
    """Return the distance of the new nodes in mm."""
    if step != "isotropic":
        return float(step)
    least = [float(np.diff(places).min()) for places in _places(volume)]
    return min(least[0], least[1], volume.spacing[2])


def _places(volume: Volume) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return where nodes lie along x, y and z, in mm from the first one."""
    x, y, z = (
        step * np.arange(count, dtype=np.float64)
        for step, count in zip(volume.spacing, volume.shape, strict=True)
    )
    return x, y, z if volume.slice_positions is None else np.asarray(volume.slice_positions, np.float64)


def _thickness(places: Float64Array) -> Float64Array:
    """Return what each node stands for along its axis, in mm."""
    steps = np.diff(places)
    found: Float64Array = (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])) / 2
    return found


def _gaussian(places: Float64Array, sigma: float) -> Blend | None:
    """Return the sums that smooth along an axis; None where nodes are so far apart that nothing changes."""
    step = float(np.diff(places).min())
    reach = int(CUT_OFF * sigma / step)
    if reach == 0:
        return None
    count = len(places)
    before = places[0] - step * np.arange(reach, 0, -1)
    after = places[-1] + step * np.arange(1, reach + 1)
    longer = np.concatenate([before, places, after])
    thick = _thickness(longer)
    rows = []
    for m in range(count):
        at = np.arange(m - reach, m + reach + 1)
        distance = (longer[at + reach] - places[m]) / sigma
        rows.append((at, thick[at + reach] * np.exp(-0.5 * distance**2)))
    return blend_of(rows, count)


def _triangle(places: Float64Array, distance: float, count: int) -> Blend:
    """Return the sums that take values at other distances."""
    thick, rows = _thickness(places), []
    for m in range(count):
        place = min(places[0] + m * distance, places[-1])
        low = min(int(np.searchsorted(places, place, side="right")) - 1, len(places) - 2)
        gap = places[low + 1] - places[low]
        if distance <= gap * (1 + ROUNDING):
            share = (place - places[low]) / gap
            rows.append((np.array([low, low + 1]), np.array([1 - share, share])))
        else:
            first, last = np.searchsorted(places, (place - distance, place + distance))
            at = np.arange(first, last)
            rows.append((at, thick[at] * (1 - np.abs(places[at] - place) / distance)))
    return blend_of(rows, len(places))


def _filtered(
    volume: Volume, blends: Sequence[Blend | None], device: Device, *, keeps_nodes: bool, **places: Any
) -> Volume:
    """Return a volume of blended values; wide integers and doubles are counted from the middle of the range.

    A node of the same place as before has data if it had some, any other one if half of its weights have;
    `places` are the fields of the volume that tell where nodes lie, where they are others.
    """
    dtype, shift = volume.values.dtype, 0.0
    if dtype.itemsize > 2 and dtype != np.float32:
        ends = volume.value_range() or (0.0, 0.0)
        shift = (ends[0] / 2 + ends[1] / 2 - volume.intercept) / volume.slope
    values, data = _as_floats(volume, shift)
    found = blended(values, blends, device)
    if data is not None:
        share = blended(data.astype(np.float32), blends, device)
        with np.errstate(invalid="ignore", divide="ignore"):
            found = np.where(data if keeps_nodes else share >= 0.5, found / share, np.float32(np.nan))
    intercept = volume.intercept + volume.slope * shift
    held = {"padding": None, "gradient": None, "formula": None} | places
    return replace(volume, values=found, intercept=intercept, **held)


def _as_floats(volume: Volume, shift: float) -> tuple[Float32Array, BoolArray | None]:
    """Return stored values less a number, 0 where data lack, and which nodes have data, None for all."""
    values = np.empty(volume.values.shape, np.float32)
    if volume.values.dtype.kind in "iu" and volume.padding is None:
        for plane, out in zip(volume.values, values, strict=True):
            out[...] = plane - np.float64(shift) if shift else plane
        return values, None
    data = np.empty(volume.values.shape, bool)
    for k, (plane, out) in enumerate(zip(volume.values, values, strict=True)):
        has = np.isfinite(plane)
        if volume.padding is not None:
            low, high = (np.float64(end) for end in volume.padding)
            has &= (plane < low) | (plane > high)
        data[k] = has
        out[...] = np.where(has, plane, 0.0) - np.float64(shift) if shift else np.where(has, plane, 0)
        out[~has] = 0.0
    return values, None if data.all() else data
