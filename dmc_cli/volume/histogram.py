"""Count the values of a volume: each one of integers of up to 16 bits, in bins of one width of others.

Every node with data counts, and the counts do not depend on how many threads there are.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dmc_cli.array_types import AnyArray, Float64Array, IntArray
from dmc_cli.system import usable_cores
from dmc_cli.threads import each_in_threads
from dmc_cli.volume.volume import Volume

BINS = 4096
"""Bins where values are not counted one by one."""

MOST_VALUES = 1 << 16
"""Different integers that are counted one by one, at most."""


SHARES = 32
"""Parts of a volume that threads count one after another."""


@dataclass(frozen=True)
class Histogram:
    """How many nodes have which value.

    Attributes:
        values: Physical values that there are, or the middles of bins with values, ascending, float64 (n,).
        counts: The nodes of each, int64 (n,).
        is_exact: Whether each value has a count of its own.
        ends: The least and the greatest value, or None where no node has data.
    """

    values: Float64Array
    counts: IntArray
    is_exact: bool
    ends: tuple[float, float] | None


def count_values(volume: Volume) -> Histogram:
    """Return the histogram of a volume's data."""
    ends = volume.value_range()
    if ends is None:
        return Histogram(np.empty(0), np.empty(0, np.int64), is_exact=True, ends=None)
    stored = sorted((end - volume.intercept) / volume.slope for end in ends)
    dtype = volume.values.dtype
    is_exact = dtype.kind in "iu" and stored[1] - stored[0] < MOST_VALUES and max(map(abs, stored)) < 2.0**53
    if is_exact:
        values, counts = _count_each(volume, round(stored[0]), round(stored[1]))
    else:
        values, counts = _count_bins(volume, stored[0], stored[1])
    there = np.flatnonzero(counts)
    physical = volume.slope * values[there] + volume.intercept
    order = slice(None, None, -1 if volume.slope < 0 else 1)
    return Histogram(physical[order], counts[there][order], is_exact, ends)


def _count_each(volume: Volume, low: int, high: int) -> tuple[Float64Array, IntArray]:
    """Return each stored value from `low` to `high`, and its count; values of padding count nothing."""
    size = high - low + 1

    def count(plane: AnyArray) -> IntArray:
        """Return the counts of a slice."""
        flat = plane.ravel()
        if volume.padding is not None:
            flat = flat[(flat >= low) & (flat <= high)]  # padding may lie beyond
        found = flat.astype(np.int64)
        found -= low
        return np.bincount(found, minlength=size)

    counts = _in_threads(volume, count, size)
    values = np.arange(low, high + 1)
    if volume.padding is not None:
        counts[(values >= volume.padding[0]) & (values <= volume.padding[1])] = 0
    return values.astype(np.float64), counts


def _count_bins(volume: Volume, low: float, high: float) -> tuple[Float64Array, IntArray]:
    """Return the middles of bins from the least to the greatest stored value, and their counts."""
    exponent = max(math.frexp(low)[1], math.frexp(high)[1]) if high - low == math.inf else 0
    start = math.ldexp(low, -exponent)  # beyond half of what float64 holds a range is no number
    width = (math.ldexp(high, -exponent) - start) / BINS
    if width == 0.0:
        counts = np.zeros(BINS, np.int64)
        counts[0] = sum(int(np.count_nonzero(_is_data(plane, volume.padding))) for plane in volume.values)
        return np.full(BINS, low), counts
    scale = 1.0 / width if width > 1.0 / np.finfo(np.float64).max else 0.0

    def count(plane: AnyArray) -> IntArray:
        """Return the counts of a slice."""
        data = plane.ravel().astype(np.float64)
        if volume.padding is not None or not np.isfinite(data.sum()):
            data = data[_is_data(data, volume.padding)]
        data = np.ldexp(data, -exponent) if exponent else data
        data -= start
        if scale:
            data *= scale
        else:
            data /= width
        found = data.astype(np.int64)
        np.minimum(found, BINS - 1, out=found)
        return np.bincount(found, minlength=BINS)

    counts = _in_threads(volume, count, BINS)
    return np.ldexp(start + width * (np.arange(BINS) + 0.5), exponent), counts


def _in_threads(volume: Volume, count: Callable[[AnyArray], IntArray], size: int) -> IntArray:
    """Return the counts of all slices, some slices a thread at a time, of which the sums are kept."""

    def counted(slices: AnyArray) -> IntArray:
        found = np.zeros(size, np.int64)
        for plane in slices:
            found += count(plane)
        return found

    total = np.zeros(size, np.int64)
    for found in each_in_threads(counted, np.array_split(volume.values, SHARES), usable_cores()):
        total += found
    return total


def _is_data(plane: AnyArray, padding: tuple[float, float] | None) -> AnyArray:
    """Return whether each stored value is data: finite and not padding."""
    found: AnyArray = np.isfinite(plane)
    if padding is not None:
        first, last = (np.float64(end) for end in padding)
        found &= (plane < first) | (plane > last)
    return found
