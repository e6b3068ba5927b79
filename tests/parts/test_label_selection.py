"""Of each label what is wanted stays, the rest goes; no label takes another one's nodes."""

import numpy as np
import pytest
from scipy import ndimage

from dmc_cli.errors import SettingsError
from dmc_cli.parts import resampled_labels, select_labels
from dmc_cli.runtime import select_device
from dmc_cli.settings import PartSettings
from dmc_cli.volume import Volume

LABELS = 4


def map_of(seed, shape=(21, 24, 37), labels=LABELS):
    """A rough map: many components a label, cavities, and labels inside others."""
    fields = np.random.default_rng(seed).normal(size=(labels + 1, *shape))
    fields = [ndimage.gaussian_filter(field, 1.1) for field in fields]
    return np.argmax(fields, axis=0).astype(np.uint16)


def volume_of(codes, spacing=(1.0, 1.0, 1.0), **given):
    return Volume(values=codes, affine=np.diag([*spacing, 1.0]), space="none", **given)


def selected(codes, spacing=(1.0, 1.0, 1.0), labels=LABELS, threads=1, **part):
    before = codes.copy()
    device, settings = select_device("cpu", threads), PartSettings(**part)
    volume, told = select_labels(volume_of(codes, spacing), labels, settings, device, lambda _: None)
    np.testing.assert_array_equal(codes, before)
    return volume.values, told


def kept_by_scipy(codes, label, keep=None, least=0.0):
    """The nodes of a label in components that stay: the largest, of equal ones the one that begins first."""
    parts, count = ndimage.label(codes == label)
    sizes = np.bincount(parts.ravel(), minlength=count + 1)[1:]
    order = np.argsort(-sizes, kind="stable")[:keep]
    return np.isin(parts, 1 + order[sizes[order] >= least]), count


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("keep", [1, 3])
def test_the_largest_components_of_each_label_stay(seed, keep):
    codes = map_of(seed)
    found, told = selected(codes, keep=str(keep))
    for label in range(1, LABELS + 1):
        expected, count = kept_by_scipy(codes, label, keep)
        np.testing.assert_array_equal(found == label, expected)
        row = told[label - 1]
        assert row["components"] == count > keep
        assert row["dropped"]["components"] == count - keep
        assert row["dropped"]["nodes"] == (codes == label).sum() - expected.sum()


def test_small_components_go_by_their_volume():
    codes = map_of(4)
    found, told = selected(codes, spacing=(0.5, 1.0, 2.0), min_volume=20)
    for label in range(1, LABELS + 1):
        expected, _ = kept_by_scipy(codes, label, least=20)
        np.testing.assert_array_equal(found == label, expected)
    assert sum(row["dropped"]["volume"] for row in told) == ((codes > 0) & (found == 0)).sum()


@pytest.mark.parametrize("limit", ["all", "3"])
def test_a_cavity_becomes_the_label_that_alone_is_beside_it(limit):
    codes = map_of(1, labels=2)
    codes[np.random.default_rng(0).random(codes.shape) < 0.03] = 0
    found, told = selected(codes, labels=2, fill_cavities=limit)
    parts, count = ndimage.label(codes == 0)
    expected = codes.copy()
    padded = np.pad(parts, 1, constant_values=-1)
    for number in range(1, count + 1):
        own = padded == number
        ring = ndimage.binary_dilation(own)[1:-1, 1:-1, 1:-1] & (parts != number)
        at_end = (ndimage.binary_dilation(own) & (padded == -1)).any()
        beside = np.unique(codes[ring])
        if not at_end and len(beside) == 1 and (limit == "all" or (parts == number).sum() <= 3):
            expected[parts == number] = beside[0]
    np.testing.assert_array_equal(found, expected)
    assert (found != codes).sum() == sum(row["filled"]["nodes"] for row in told) > 10


def test_a_cavity_between_two_labels_stays():
    codes = np.zeros((7, 7, 9), np.uint16)
    codes[1:6, 1:6, 1:4], codes[1:6, 1:6, 4:8] = 1, 2
    codes[3, 3, 3:5] = 0  # between both
    codes[2, 2, 2] = codes[3, 3, 6] = 0  # in one
    codes[4, 4, 6] = 3  # a label in a label is no cavity
    found, told = selected(codes, labels=3, fill_cavities="all")
    assert (found[2, 2, 2], found[3, 3, 6], found[3, 3, 3], found[4, 4, 6]) == (1, 2, 0, 3)
    assert [row["filled"]["components"] for row in told] == [1, 1, 0]


def ball(radius, spacing):
    reach = [int(radius / step) for step in spacing]
    z, y, x = np.meshgrid(*[np.arange(-r, r + 1) for r in reach[::-1]], indexing="ij")
    return (x * spacing[0]) ** 2 + (y * spacing[1]) ** 2 + (z * spacing[2]) ** 2 <= radius**2 + 1e-9


@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (0.5, 1.0, 2.0)])
def test_each_label_is_opened_as_if_it_were_alone(spacing):
    codes = map_of(2)
    found, told = selected(codes, spacing, open_gaps=2.5)
    for label in range(1, LABELS + 1):
        inner = ndimage.binary_erosion(codes == label, ball(1.25, spacing), border_value=1)
        expected = ndimage.binary_dilation(inner, ball(1.25, spacing))
        np.testing.assert_array_equal(found == label, expected)
        assert told[label - 1]["opened"]["nodes"] == (codes == label).sum() - expected.sum() > 0


def test_gaps_are_filled_from_the_background_alone_by_the_first_label_that_would():
    codes = np.zeros((9, 9, 12), np.uint16)
    codes[2:7, 2:7, 2:5], codes[2:7, 2:7, 6:9] = 2, 2  # a gap of one node
    codes[4, 4, 5] = 3  # in which another label is
    found, told = selected(codes, labels=3, close_gaps=2)
    assert found[3:6, 3:6, 5].tolist() == [[2, 2, 2], [2, 3, 2], [2, 2, 2]]
    assert told[0]["closed"]["nodes"] == 0
    walls = np.tile(np.array([0, 2, 0, 1, 0, 2, 0, 1, 0, 2, 2, 2], np.uint16), (9, 9, 1))
    found, _ = selected(walls, labels=2, close_gaps=4)
    assert found[4, 4].tolist() == [2, 2, 2, 1, 1, 2, 1, 1, 2, 2, 2, 2]


def test_the_same_on_any_number_of_threads():
    codes = map_of(5, (30, 31, 65))
    part = {"open_gaps": 2, "close_gaps": 2, "keep": "2", "min_volume": 4, "fill_cavities": "all"}
    one, two = (selected(codes, threads=threads, **part) for threads in (1, 2))
    np.testing.assert_array_equal(one[0], two[0])
    assert one[1] == two[1]


def test_a_width_that_reaches_no_other_node_is_refused():
    with pytest.raises(SettingsError, match=r"open_gaps is 1\.5 mm, which is less than two nodes are apart"):
        selected(map_of(0), open_gaps=1.5)


def resampled(codes, step, spacing=(1.0, 1.0, 1.0), labels=LABELS, **given):
    return resampled_labels(volume_of(codes, spacing, **given), labels, step, select_device("cpu", 1))


def test_nearer_nodes_have_the_label_of_the_nearest_one():
    codes = map_of(3, (9, 10, 11))
    found = resampled(codes, "0.25", (1.0, 0.5, 1.0))
    places = [
        np.ceil(np.arange(n) * 0.25 / step - 0.5).astype(int)
        for n, step in zip(found.shape, (1, 0.5, 1), strict=True)
    ]
    expected = codes[np.ix_(places[2], places[1], places[0])]
    assert found.shape == (41, 19, 33)
    assert found.spacing == (0.25, 0.25, 0.25)
    np.testing.assert_array_equal(found.values, expected)


def test_farther_nodes_have_the_label_of_most():
    codes = map_of(6, (16, 17, 18))
    found = resampled(codes, "2")
    weights = np.array([0.25, 0.5, 0.25])
    shares = []
    for label in range(LABELS + 1):
        share = (codes == label).astype(float)
        for axis in range(3):
            share = ndimage.convolve1d(share, weights, axis=axis, mode="nearest")
        shares.append(share[::2, ::2, ::2])
    inner = (slice(1, -1),) * 3  # at the ends there is less to weigh
    order = np.argmax([*shares[1:], shares[0]], axis=0)  # a label before the background
    np.testing.assert_array_equal(
        found.values[inner],
        ((order + 1) % (LABELS + 1))[
            : found.values.shape[0], : found.values.shape[1], : found.values.shape[2]
        ][inner],
    )


def test_uneven_slices_become_even():
    codes = np.zeros((4, 6, 6), np.uint16)
    codes[1:3, 2:4, 2:4] = 1
    positions = np.array([0.0, 1.0, 4.0, 5.0])
    found = resampled(codes, "1", spacing=(1.0, 1.0, 5 / 3), labels=1, slice_positions=positions)
    assert found.slice_positions is None
    assert found.values[:, 2, 2].tolist() == [0, 1, 1, 1, 1, 0]
