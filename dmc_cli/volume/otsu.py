"""Part the values of a histogram into classes whose values differ least from their means: Otsu's method.

N. Otsu: A threshold selection method from gray-level histograms, 1979. For several classes the best of all
partitions is found by dynamic programming: what an interval contributes obeys the quadrangle inequality, so
the best last cut moves upwards with the end of the values, and ends are settled from the middle outwards, all
of a level at once.
"""

from collections.abc import Callable

import numpy as np

from dmc_cli.array_types import Float64Array, IntArray


def otsu_cuts(values: Float64Array, counts: IntArray, number: int) -> list[float]:
    """Return the isovalues, ascending, that part values into `number` + 1 classes: midway between two values.

    Args:
        values: Values, ascending, float64 (n,), n above `number`.
        counts: How often each occurs, int64 (n,), all positive.
        number: How many isovalues.
    """
    middle = float(np.average(values / 2, weights=counts)) * 2
    scale = max(float(np.abs(values / 2 - middle / 2).max()), np.finfo(np.float64).tiny)
    centred = (values / 2 - middle / 2) / scale
    weight = np.concatenate([[0.0], np.cumsum(counts, dtype=np.float64)])
    moment = np.concatenate([[0.0], np.cumsum(centred * counts)])

    def gain(first: IntArray, end: IntArray) -> Float64Array:
        """Return what intervals of values contribute to the variance between classes."""
        found: Float64Array = (moment[end] - moment[first]) ** 2 / (weight[end] - weight[first])
        return found

    count = len(values)
    best = np.concatenate([[0.0], gain(np.zeros(count, np.int64), np.arange(1, count + 1))])
    cuts = []
    for classes in range(2, number + 2):
        best, cut = _add_class(best, classes, count, gain)
        cuts.append(cut)
    ends, end = [], count
    for cut in reversed(cuts):
        end = int(cut[end])
        ends.append(end)
    return [float(values[e - 1] / 2 + values[e] / 2) for e in reversed(ends)]


def _add_class(
    best: Float64Array, classes: int, count: int, gain: Callable[[IntArray, IntArray], Float64Array]
) -> tuple[Float64Array, IntArray]:
    """Return the best gains with one class more, and where the last class of each begins, (count + 1,) each.

    Args:
        best: The best gain of the first n values in one class fewer.
        classes: Classes with the new one.
        count: Values.
        gain: What intervals contribute.
    """
    found = np.full(count + 1, -np.inf)
    cut = np.zeros(count + 1, np.int64)
    spans = np.array([[classes, count, classes - 1, count - 1]])  # ends to settle, where their cuts may be
    while len(spans):
        low, high, first, last = spans.T
        end = (low + high) // 2
        last = np.minimum(last, end - 1)
        lengths = last - first + 1
        starts = np.cumsum(lengths) - lengths
        tried = np.arange(lengths.sum()) - np.repeat(starts - first, lengths)
        ends = np.repeat(end, lengths)
        gains = best[tried] + gain(tried, ends)
        found[end] = np.maximum.reduceat(gains, starts)
        is_best = gains == np.repeat(found[end], lengths)
        places = np.where(is_best, np.arange(len(gains)), len(gains))
        cut[end] = tried[np.minimum.reduceat(places, starts)]
        left = np.stack([low, end - 1, first, cut[end]], axis=1)
        right = np.stack([end + 1, high, cut[end], spans[:, 3]], axis=1)
        spans = np.concatenate([left, right])
        spans = spans[spans[:, 0] <= spans[:, 1]]
    return found, cut
