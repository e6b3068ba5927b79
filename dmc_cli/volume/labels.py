"""Find the labels of a label map, and number chosen ones for the kernels.

A label is a physical value that is a whole number; 0 is the background, as are nodes without data.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmc_cli.array_types import AnyArray, IntArray
from dmc_cli.errors import SettingsError, VolumeError
from dmc_cli.volume.volume import Volume

BACKGROUND = 0
"""The label of what is no part of anything."""

MOST_CHOSEN = 65535
"""Labels that can be made surfaces of at a time: codes have 16 bits, and 0 is the background."""

MOST_COUNTED = 1 << 22
"""Stored values from the least to the largest that are counted by a table; others are sorted."""


@dataclass(frozen=True)
class LabelValues:
    """The labels that a label map holds.

    Attributes:
        labels: Those that are not the background, whole numbers (n,), ascending.
        stored: The stored value of each.
        counts: Its nodes, int64 (n,).
    """

    labels: AnyArray
    stored: AnyArray
    counts: IntArray


def find_labels(volume: Volume) -> LabelValues:
    """Return the labels that a volume holds, with their nodes.

    Raises:
        VolumeError: A value is no whole number.
    """
    stored, counts = _stored_values(volume)
    labels = _physical(volume, stored)
    kept = labels != BACKGROUND
    order = np.argsort(labels[kept], kind="stable")
    return LabelValues(labels[kept][order], stored[kept][order], counts[kept][order])


def _physical(volume: Volume, stored: AnyArray) -> AnyArray:
    """Return what stored values are as labels: themselves, where no scale has to be applied.

    Raises:
        VolumeError: One is no whole number.
    """
    if stored.dtype.kind in "iu" and (volume.slope, volume.intercept) == (1.0, 0.0):
        return stored  # numbers of 64 bits, which floats would round, among them
    physical = volume.slope * stored.astype(np.float64) + volume.intercept
    labels = np.rint(physical)
    odd = np.abs(physical - labels) > 1e-6 * np.maximum(np.abs(physical), 1.0)
    if odd.any():
        raise VolumeError(
            f"{volume.path or 'the volume'} is no label map: it holds the value {physical[odd][0]:g};"
            " expected whole numbers; leave --labels out, and choose an isovalue with -i"
        )
    return labels.astype(np.int64)


def encode_labels(volume: Volume, stored: AnyArray) -> AnyArray:
    """Return the nodes' codes, uint16, with a layer of background on every side: (nz + 2, ny + 2, nx + 2).

    Args:
        volume: A label map.
        stored: Stored values of the chosen labels; the code of the first is 1, all others are 0.

    Raises:
        SettingsError: There are more labels than codes.
    """
    if len(stored) > MOST_CHOSEN:
        raise SettingsError(
            f"{len(stored)} labels were chosen; expected at most {MOST_CHOSEN} at a time; choose some of them"
            " with --labels"
        )
    codes = np.zeros(tuple(n + 2 for n in volume.values.shape), np.uint16)
    if not len(stored):
        return codes
    order = np.argsort(stored, kind="stable")
    ascending, low, high = stored[order], stored[order[0]], stored[order[-1]]
    span = float(high) - float(low)
    if stored.dtype.kind in "iu" and span < MOST_COUNTED:
        table = np.zeros(int(span) + 2, np.uint16)  # the last item stands for all that is beyond
        table[(ascending - low).astype(np.int64)] = order + 1
        for k, plane in enumerate(volume.values):
            within = (plane >= low) & (plane <= high)
            places = np.where(within, plane, low).astype(np.int64) - int(low)
            codes[k + 1, 1:-1, 1:-1] = np.where(within, table[places], 0)
        return codes
    for k, plane in enumerate(volume.values):
        places = np.minimum(np.searchsorted(ascending, plane), len(ascending) - 1)
        codes[k + 1, 1:-1, 1:-1] = np.where(ascending[places] == plane, order[places] + 1, 0)
    return codes


def _stored_values(volume: Volume) -> tuple[AnyArray, IntArray]:
    """Return the stored values that are data, ascending, and how many nodes have each."""
    values = volume.values
    if values.dtype.kind in "iu":
        low, high = int(values.min()), int(values.max())
        if high - low < MOST_COUNTED:
            counts = np.zeros(high - low + 1, np.int64)
            for plane in values:
                counts += np.bincount((plane.astype(np.int64) - low).ravel(), minlength=len(counts))
            stored = np.flatnonzero(counts)
            kept = _is_data(volume, stored + low)
            found = (stored + low).astype(values.dtype)
            return found[kept], counts[stored][kept]
    return _merged(volume)


def _merged(volume: Volume) -> tuple[AnyArray, IntArray]:
    """Return what `_stored_values` does, slice by slice, of values that are far apart or floats."""
    found: dict[float | int, int] = {}
    for values, counts in _of_planes(volume.values):
        for value, count in zip(values.tolist(), counts.tolist(), strict=True):
            found[value] = found.get(value, 0) + count
        if len(found) > MOST_COUNTED:
            raise VolumeError(
                f"{volume.path or 'the volume'} holds more than {MOST_COUNTED} different values; expected the"
                " labels of a label map; leave --labels out, and choose an isovalue with -i"
            )
    stored = np.array(sorted(found), volume.values.dtype)
    kept = _is_data(volume, stored)
    return stored[kept], np.array([found[value] for value in sorted(found)], np.int64)[kept]


def _of_planes(values: AnyArray) -> Iterator[tuple[AnyArray, IntArray]]:
    """Yield the finite values of each slice, ascending, and how often each is there."""
    for plane in values:
        finite = plane[np.isfinite(plane)] if plane.dtype.kind == "f" else plane
        yield np.unique(finite, return_counts=True)


def _is_data(volume: Volume, stored: AnyArray) -> AnyArray:
    """Return which stored values are no padding."""
    if volume.padding is None:
        return np.ones(len(stored), bool)
    low, high = volume.padding
    return (stored < low) | (stored > high)
