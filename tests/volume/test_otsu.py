"""Otsu's classes are the best of all partitions, and every node counts once."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.volume import Volume, count_values
from dmc_cli.volume.histogram import BINS
from dmc_cli.volume.otsu import otsu_cuts


def volume_of(values, **given):
    return Volume(values=np.asarray(values), affine=np.eye(4), space="none", **given)


def variance_between(values, counts, cuts):
    """Return what a partition gains: the sum of squares of classes' means, times how many are in each."""
    parts = np.split(np.arange(len(values)), np.searchsorted(values, cuts))
    return sum(np.average(values[p], weights=counts[p]) ** 2 * counts[p].sum() for p in parts)


@given(st.data(), st.integers(1, 3))
def test_cuts_are_the_best_of_all(data, number):
    values = np.array(
        sorted(data.draw(st.sets(st.integers(-300, 300), min_size=number + 1, max_size=12))), float
    )
    counts = np.array(data.draw(st.lists(st.integers(1, 99), min_size=len(values), max_size=len(values))))
    found = variance_between(values, counts, otsu_cuts(values, counts, number))
    tried = combinations((values[1:] + values[:-1]) / 2, number)
    assert found == pytest.approx(max(variance_between(values, counts, cut) for cut in tried), rel=1e-9)


def test_two_classes_agree_with_a_search_through_all_values_of_a_scan():
    rng = np.random.default_rng(1)
    values = np.concatenate([rng.normal(100, 30, 9000), rng.normal(900, 200, 3000)]).astype(np.int16)
    histogram = count_values(volume_of(values.reshape(12, 10, 100)))
    (cut,) = otsu_cuts(histogram.values, histogram.counts, 1)
    gains = [variance_between(histogram.values, histogram.counts, [v]) for v in histogram.values[1:]]
    assert 1 + int(np.argmax(gains)) == np.searchsorted(histogram.values, cut)


@pytest.mark.parametrize("dtype", ["uint8", "int8", "int16", "uint16", "int64", "uint64"])
def test_integers_are_counted_one_by_one(dtype):
    rng = np.random.default_rng(2)
    limits = np.iinfo(dtype)
    values = rng.integers(max(limits.min, -3000), min(limits.max, 3000), (5, 7, 33), dtype, endpoint=True)
    found = count_values(volume_of(values, padding=(2, 9), slope=-0.5, intercept=7.0))
    data, counts = np.unique(values[(values < 2) | (values > 9)], return_counts=True)
    np.testing.assert_array_equal(found.values, (-0.5 * data + 7.0)[::-1])
    np.testing.assert_array_equal(found.counts, counts[::-1])
    assert found.is_exact


@pytest.mark.parametrize("scale", [1.0, 1e-30, 1e300])
def test_floats_are_counted_in_bins_of_one_width(scale):
    rng = np.random.default_rng(3)
    values = scale * rng.normal(size=(6, 8, 40))
    values[0, 0, :3] = np.nan, np.inf, -np.inf
    data = values[np.isfinite(values)]
    found = count_values(volume_of(values))
    assert not found.is_exact
    assert found.counts.sum() == data.size
    counts, _ = np.histogram(data / scale, BINS)
    assert np.abs(np.cumsum(counts[counts > 0])[-1] - found.counts.sum()) == 0
    assert np.isin(np.searchsorted(found.values, data), np.arange(len(found.values) + 1)).all()
    assert found.ends == (data.min(), data.max())


def test_the_widest_range_of_floats_is_counted():
    values = np.array([-1.7e308, 0.0, 1.7e308, 1.6e308] * 2).reshape(2, 2, 2)
    found = count_values(volume_of(values))
    assert found.counts.tolist() == [2, 2, 2, 2]
    assert np.isfinite(found.values).all()
    assert otsu_cuts(found.values, found.counts, 1)[0] == pytest.approx(0.8e308, rel=0.01)


def test_a_volume_without_data_has_no_value():
    found = count_values(volume_of(np.full((2, 2, 2), np.nan)))
    assert (found.ends, len(found.values)) == (None, 0)
