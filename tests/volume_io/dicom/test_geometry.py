"""Where slices lie: order, directions, tilt, uneven and missing ones, copies, slices beside the line."""

import re

import numpy as np
import pytest

from dmc_cli.errors import (
    AmbiguousVolumeError,
    UnsupportedFormatError,
)
from tests.volume_io.dicom.scanner import STACK, axial, make_slice, save, save_stack
from tests.volume_io.reading import read, world


def test_slices_are_sorted_by_position_whatever_their_names(tmp_path):
    volume = read(save_stack(tmp_path, axial()))
    np.testing.assert_array_equal(volume.values, STACK)
    np.testing.assert_array_equal(
        volume.affine, [[0.75, 0, 0, 10], [0, 0.5, 0, 20], [0, 0, 2, 30], [0, 0, 0, 1]]
    )
    assert (volume.space, volume.slope, volume.intercept) == ("LPS", 1, -1024)
    assert volume.slice_positions is None
    assert len(volume.files) == 4
    assert volume.sentences == ()


@pytest.mark.parametrize(
    "orientation", [(1, 0, 0, 0, 1, 0), (0, 1, 0, 0, 0, -1), (0.6, 0.8, 0, 0, 0, -1), (-1, 0, 0, 0, -1, 0)]
)
def test_every_orientation_stacks_along_its_own_normal(tmp_path, orientation):
    normal = np.cross(orientation[:3], orientation[3:])
    positions = [np.array([5, 6, 7]) + 1.5 * k * normal for k in range(4)]
    volume = read(save_stack(tmp_path, positions, orientation=orientation))
    np.testing.assert_array_equal(volume.values, STACK)
    assert np.linalg.det(volume.affine) > 0
    for k, position in enumerate(positions):
        np.testing.assert_allclose(world(volume, k), position, atol=1e-9)
    x = np.array(orientation[:3]) * 0.75
    np.testing.assert_allclose(world(volume, 0, i=1) - world(volume, 0), x, atol=1e-9)


def test_gantry_tilt_is_a_shear(tmp_path):
    positions = [(10, 20 - 0.9 * k, 30 + 2 * k) for k in range(4)]
    volume = read(save_stack(tmp_path, positions))
    assert volume.slice_positions is None
    for k, position in enumerate(positions):
        np.testing.assert_allclose(world(volume, k), position, atol=1e-9)
    np.testing.assert_allclose(world(volume, 2, i=3, j=1) - world(volume, 2), [2.25, 0.5, 0], atol=1e-9)


@pytest.mark.parametrize("tilt", [0, 0.4])
def test_uneven_slices_keep_their_positions(tmp_path, tilt):
    heights = [0, 2, 4.5, 8, 9.1]
    positions = [(10, 20 + tilt * z, 30 + z) for z in heights]
    volume = read(save_stack(tmp_path, positions))
    np.testing.assert_allclose(volume.slice_positions, np.array(heights) * np.hypot(1, tilt))
    for k, position in enumerate(positions):
        np.testing.assert_allclose(world(volume, k), position, atol=1e-9)
    told = r"vary from 1\.100 mm between IM000\d and IM000\d to 3\.500 mm between IM000\d and IM000\d"
    assert re.search(told, volume.sentences[0])
    assert [notice.code for notice in volume.warnings] == ["W-SLICES-UNEVEN"]


def test_rounded_positions_are_even(tmp_path):
    positions = [(0, 0, z) for z in (0, 2.009, 4, 6.005, 8)]
    assert read(save_stack(tmp_path, positions)).slice_positions is None


def test_small_differences_that_add_up_are_kept(tmp_path):
    heights = np.cumsum([0, *[0.996] * 5, *[1.004] * 5])
    volume = read(save_stack(tmp_path, [(0, 0, z) for z in heights]))
    np.testing.assert_allclose(volume.slice_positions, heights)


@pytest.mark.parametrize("heights", [(0, 2, 4, 8, 10), (0, 4, 6, 8), (0, 2, 4, 8)])
def test_a_missing_slice_is_refused_or_bridged(tmp_path, heights):
    save_stack(tmp_path, [(0, 0, z) for z in heights], names=[f"slice{n}" for n in range(len(heights))])
    with pytest.raises(
        AmbiguousVolumeError, match=r"4\.000 mm between slice\d and slice\d.*--slice-gaps keep"
    ):
        read(tmp_path)
    volume = read(tmp_path, slice_gaps="keep")
    np.testing.assert_allclose(volume.slice_positions, heights)
    assert "missing" in volume.sentences[0]


def test_a_missing_slice_is_compared_with_the_other_distances(tmp_path):
    save_stack(tmp_path, [(0, 0, z) for z in (0, 1.5, 75)])
    with pytest.raises(AmbiguousVolumeError, match=r"73\.500 mm between .*, 1\.500 mm elsewhere"):
        read(tmp_path)


def test_two_slices_in_one_place_are_refused_or_the_first_is_taken(tmp_path):
    save_stack(tmp_path, axial(), names="abcd")
    save(make_slice(axial()[1], 1), tmp_path / "z")
    with pytest.raises(AmbiguousVolumeError, match=r"first b and z, 0\.000 mm apart.*--duplicates first"):
        read(tmp_path)
    volume = read(tmp_path, duplicates="first")
    np.testing.assert_array_equal(volume.values, STACK)
    assert volume.sentences == ("1 slice in the place of another one was left out: z",)
    assert [notice.code for notice in volume.warnings] == ["W-DUPLICATES-DROPPED"]


def test_slices_beside_the_line_are_refused(tmp_path):
    positions = [(10 + (k == 2), 20, 30 + k) for k in range(5)]
    with pytest.raises(UnsupportedFormatError, match=r"1\.000 mm beside the line"):
        read(save_stack(tmp_path, positions))


def test_slices_a_little_beside_the_line_are_told(tmp_path):
    positions = [(10 + 0.1 * (k == 2), 20, 30 + k) for k in range(5)]
    volume = read(save_stack(tmp_path, positions))
    assert "0.100 mm beside the line" in volume.sentences[0]
    assert [notice.code for notice in volume.warnings] == ["W-SLICES-SHIFTED"]
