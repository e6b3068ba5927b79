"""Distances between slices are judged by the one that most of them share."""

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from dmc_cli.errors import AmbiguousVolumeError
from dmc_cli.volume_io.dicom.distances import gaps, is_even, same_place, shared_distance
from tests.volume_io.dicom.scanner import save_stack
from tests.volume_io.reading import physical, read, read_with_itk, world

SPACINGS = (0.005, 0.0099, 0.3, 1.0, 5.0)


@given(st.sampled_from(SPACINGS), st.sets(st.integers(1, 28), min_size=1, max_size=20))
def test_any_pattern_of_missing_slices_shows_while_two_neighbours_are_left(spacing, missing):
    kept = np.array([k for k in range(30) if k not in missing])
    steps = np.diff(kept)
    assume(steps.min() == 1 and steps.max() <= 6)
    expected = np.flatnonzero(steps > 1).tolist()
    assert gaps(steps * spacing) == expected


@given(st.sampled_from(SPACINGS), st.integers(2, 30), st.integers(1, 6), st.integers(0, 99))
def test_copies_are_told_from_neighbours_at_any_scale(spacing, count, copies, seed):
    places = np.repeat(np.arange(count) * spacing, copies)
    jitter = np.random.default_rng(seed).uniform(0, min(0.004 * spacing, 0.009), len(places))
    places = np.sort(places + jitter)
    assert shared_distance(places) == pytest.approx(spacing, rel=0.01)
    closest = same_place(places, spacing)
    assert (np.diff(places) >= closest).sum() == count - 1


@pytest.mark.parametrize(
    "distances",
    [
        [2, 2.5, 3.5, 1.1],
        [4, 4, 4, 7, 7, 7, 1.081],
        [1, 1, 1, 0.37, 1, 1],
        [6.96, 7.07, 6.97, 7.06, 6.96],
        [3],
    ],
)
def test_uneven_slices_are_no_gaps(distances):
    assert gaps(np.array(distances, float)) == []


@pytest.mark.parametrize(
    ("distances", "found"),
    [([1.5, 73.5], [1]), ([2, 2, 2, 1], [0, 1, 2]), ([1, 1, 1.2, 2.6, 2.6], [3, 4])],
)
def test_gaps_are_found_whatever_stands_beside_them(distances, found):
    assert gaps(np.array(distances, float)) == found


def test_no_distance_is_shared_where_all_slices_are_in_one_place():
    assert shared_distance(np.zeros(3)) == 0
    assert gaps(np.zeros(0)) == []


@pytest.mark.parametrize("spacing", SPACINGS)
def test_even_is_relative_to_the_distance(spacing):
    places = np.arange(9) * spacing
    assert is_even(places)
    places[4] += 0.05 * spacing
    assert not is_even(places)


def test_slices_of_micrometres_lie_where_they_say(tmp_path):
    positions = [(0.01, 0.02, 0.03 + 0.005 * k) for k in range(6)]
    volume = read(save_stack(tmp_path, positions, PixelSpacing=[0.005, 0.005]))
    assert volume.shape == (5, 4, 6)
    for k, position in enumerate(positions):
        np.testing.assert_allclose(world(volume, k), position, atol=1e-9)


def test_copies_of_micrometre_slices_are_refused_in_words_that_show_them(tmp_path):
    heights = (0, 0.005, 0.00500001, 0.01, 0.015)
    save_stack(tmp_path, [(0, 0, z) for z in heights], PixelSpacing=[0.005, 0.005])
    with pytest.raises(AmbiguousVolumeError, match=r"1 of 5 slices .*closer than 5e-05 mm"):
        read(tmp_path)


@pytest.mark.parametrize(
    ("stated", "thickness", "is_missing"),
    [
        ("1", "1", True),
        ("1", "0.8", True),
        ("1", None, True),
        ("2", "1", False),
        ("1", "2", False),
        ("0.7", "0.7", False),
    ],
)
def test_every_second_slice_of_a_stated_distance_is_missing(tmp_path, stated, thickness, is_missing):
    """Unless slices are as thick as they are far apart."""
    elements = {"SpacingBetweenSlices": stated, "SliceThickness": thickness}
    save_stack(tmp_path, [(0, 0, 2.0 * k) for k in range(5)], **elements)
    if is_missing:
        with pytest.raises(
            AmbiguousVolumeError, match=r"4 missing slices found.*SpacingBetweenSlices is 1\.000 mm"
        ):
            read(tmp_path)
    assert read(tmp_path, slice_gaps="keep").spacing[2] == 2


@pytest.mark.parametrize(
    "name",
    [
        "one_missing",
        "second_missing",
        "two_alternate_missing",
        "many_alternate_missing",
        "two_consecutive_pairs",
    ],
)
def test_case_of_gaps(cases, name):
    with pytest.raises(AmbiguousVolumeError, match=r"missing slices? found.*1\.000 mm elsewhere"):
        read(cases / "dicom_gaps" / name)
    assert read(cases / "dicom_gaps" / name, slice_gaps="keep").slice_positions is not None


@pytest.mark.parametrize(("name", "spacing"), [("um5", 0.005), ("um9p9", 0.0099), ("um12", 0.012)])
def test_case_of_micrometres(cases, name, spacing):
    folder = cases / "dicom_microct_5um" / name
    volume = read(folder)
    assert volume.shape == (48, 40, 30)
    np.testing.assert_allclose(volume.spacing, spacing, rtol=1e-6)
    assert volume.slice_positions is None
    files = sorted(folder.glob("*.dcm"))
    for k in (0, 29):
        values, affine = read_with_itk(files[k])
        np.testing.assert_array_equal(physical(volume)[k], values[0])
        np.testing.assert_allclose(world(volume, k), affine[:3, 3], atol=1e-9)
