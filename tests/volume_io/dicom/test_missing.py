"""Slices that may be missing: told, refused by `--strict`, and answered by `--slice-gaps`."""

import pytest

from dmc_cli.errors import AmbiguousVolumeError
from tests.volume_io.dicom.scanner import axial, make_slice, save, save_stack
from tests.volume_io.dicom.test_kinds import told
from tests.volume_io.reading import read


def thin(folder):
    return save_stack(folder, axial(5, 10.0), SliceThickness="1")


def counted(folder):
    """A volume whose numbers count by 2, of slices of an unknown thickness."""
    for k, position in enumerate(axial()):
        save(make_slice(position, 2 * k + 1), folder / str(k))
    return folder


def of_more_slices(folder):
    return save_stack(folder, axial(), NumberOfSlices=9)


def of_more_images(folder):
    return save_stack(folder, axial(), ImagesInAcquisition="9")


KINDS = {
    "slices 1.000 mm thick": thin,
    "InstanceNumber counts by 2": counted,
    "NumberOfSlices is 9, but 4 found": of_more_slices,
    "ImagesInAcquisition is 9, but 4 found": of_more_images,
}


@pytest.mark.parametrize("sentence", KINDS)
def test_what_doubts_that_all_slices_are_there_is_told_and_refused_by_strict(tmp_path, sentence):
    folder = KINDS[sentence](tmp_path)
    assert sentence in told(read(folder))["W-SLICES-DOUBTFUL"]
    with pytest.raises(AmbiguousVolumeError, match=f"{sentence}.*--slice-gaps keep"):
        read(folder, strict=True)
    assert sentence in told(read(folder, strict=True, slice_gaps="keep"))["W-SLICES-MISSING"]


@pytest.mark.parametrize(
    ("numbers", "elements"),
    [
        ([1, 2, 3, 4], {"ImagesInAcquisition": "4"}),
        ([3, 4, 5, 6], {"ImagesInAcquisition": "0"}),
        ([2, 4, 6, 8], {"SliceThickness": "2"}),
        ([1, 3, 8, 9], {}),
    ],
)
def test_numbers_that_leave_no_doubt(tmp_path, numbers, elements):
    for k, (position, number) in enumerate(zip(axial(), numbers, strict=True)):
        save(make_slice(position, number, **elements), tmp_path / str(k))
    assert told(read(tmp_path, strict=True)) == {}


def test_a_gap_that_the_user_chose_to_bridge_passes_strict(tmp_path):
    save_stack(tmp_path, [position for k, position in enumerate(axial(8)) if k != 4])
    assert "W-SLICES-MISSING" in told(read(tmp_path, strict=True, slice_gaps="keep"))
