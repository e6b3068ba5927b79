"""Labels of a label map are found, chosen and numbered as NumPy does it."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from dmc_cli.errors import SettingsError, VolumeError
from dmc_cli.volume import Volume, encode_labels, find_labels, labels as module

SHAPES = hnp.array_shapes(min_dims=3, max_dims=3, min_side=2, max_side=5)
MAPS = st.one_of(
    hnp.arrays(np.uint8, SHAPES, elements=st.integers(0, 6)),
    hnp.arrays(np.int16, SHAPES, elements=st.integers(-3, 3)),
    hnp.arrays(np.int64, SHAPES, elements=st.sampled_from([0, 5, -(2**60), 2**60])),
    hnp.arrays(np.float32, SHAPES, elements=st.sampled_from([0.0, 1.0, -2.0, 70000.0])),
    hnp.arrays(np.float64, SHAPES, elements=st.sampled_from([0.0, 3.0, np.nan, np.inf])),
)


def label_map(values, **attributes):
    return Volume(values=values, affine=np.eye(4), space="none", **attributes)


@given(MAPS)
def test_labels_and_codes_are_those_of_numpy(values):
    volume = label_map(values)
    found = find_labels(volume)
    finite = np.where(np.isfinite(values), values, 0)
    labels, counts = np.unique(finite[finite != 0], return_counts=True)
    assert found.labels.tolist() == labels.astype(np.int64).tolist()
    assert found.counts.tolist() == counts.tolist()
    codes = encode_labels(volume, found.stored)
    assert codes.shape == tuple(n + 2 for n in values.shape)
    expected = np.pad(np.where(finite != 0, np.searchsorted(labels, finite) + 1, 0), 1)
    assert np.array_equal(codes, expected)


@given(MAPS.filter(lambda values: values.dtype.kind in "iu"), st.integers(0, 3))
def test_what_is_not_chosen_is_background(values, kept):
    volume = label_map(values)
    found = find_labels(volume)
    stored = found.stored[:kept]
    codes = encode_labels(volume, stored)[1:-1, 1:-1, 1:-1]
    assert np.array_equal(codes != 0, np.isin(values, stored))


def test_labels_are_physical_values():
    found = find_labels(label_map(np.array([[[0, 1], [2, 3]]] * 2, np.uint8), slope=-2.0, intercept=2.0))
    assert found.labels.tolist() == [-4, -2, 2]
    assert found.stored.tolist() == [3, 2, 0]


def test_labels_of_64_bits_stay_apart():
    values = np.array([[[0, 2**63 + 1], [2**63 + 2, 5]]] * 2, np.uint64)
    found = find_labels(label_map(values))
    assert found.labels.tolist() == [5, 2**63 + 1, 2**63 + 2]
    codes = encode_labels(label_map(values), found.stored)
    assert codes[1, 1:-1, 1:-1].tolist() == [[0, 2], [3, 1]]


def test_padding_is_background():
    values = np.array([[[0, 1], [2, 99]]] * 2, np.uint8)
    assert find_labels(label_map(values, padding=(99, 99))).labels.tolist() == [1, 2]


def test_values_that_are_no_whole_numbers_are_refused():
    with pytest.raises(
        VolumeError, match=r"holds the value 0\.5; expected whole numbers; leave --labels out"
    ):
        find_labels(label_map(np.full((2, 2, 2), 0.5)))


def test_too_many_values_are_refused(monkeypatch):
    monkeypatch.setattr(module, "MOST_COUNTED", 10)
    with pytest.raises(VolumeError, match="more than 10 different values"):
        find_labels(label_map(np.arange(27, dtype=np.float32).reshape(3, 3, 3)))


def test_too_many_labels_are_refused(monkeypatch):
    monkeypatch.setattr(module, "MOST_CHOSEN", 2)
    volume = label_map(np.arange(8, dtype=np.uint8).reshape(2, 2, 2))
    with pytest.raises(SettingsError, match="7 labels were chosen; expected at most 2"):
        encode_labels(volume, find_labels(volume).stored)
