"""Distances of pixels that are not those in the body: at a detector, on a film, shapes, locations."""

import numpy as np
import pytest

from dmc_cli.errors import VolumeError
from tests.volume_io.dicom.scanner import axial, save, save_stack
from tests.volume_io.dicom.test_frames import many_frames
from tests.volume_io.dicom.test_kinds import told
from tests.volume_io.reading import read

CAPTURE = {"SOPClassUID": "1.2.840.10008.5.1.4.1.1.7.2"}
"""A file of many frames that nothing is told of."""


@pytest.mark.parametrize(
    ("elements", "sentence"),
    [
        (
            {"NominalScannedPixelSpacing": [0.3, 0.3]},
            "NominalScannedPixelSpacing 0.3 mm, that of a scanned film",
        ),
        (
            {"ImagerPixelSpacing": [0.2, 0.2], "EstimatedRadiographicMagnificationFactor": "1.5"},
            "ImagerPixelSpacing 0.2 mm, that of the detector and "
            "EstimatedRadiographicMagnificationFactor 1.5",
        ),
    ],
)
def test_distances_that_are_not_those_in_the_body_are_named_and_not_taken(tmp_path, elements, sentence):
    dataset, _ = many_frames([0] * 3, **CAPTURE, **elements)
    volume = read(save(dataset, tmp_path / "frames"))
    assert volume.spacing == (1, 1, 1)
    assert f"only {sentence}; 1 mm is taken" in told(volume)["W-SPACING-MISSING"]
    save_stack(tmp_path / "slices", axial(), PixelSpacing=None, **elements)
    with pytest.raises(VolumeError, match=f"no pixel spacing, only {sentence}"):
        read(tmp_path / "slices")


@pytest.mark.parametrize(
    ("imager", "factor", "is_told"), [(0.5, "1.5", True), (0.75, "1.5", False), (0.5, "1", False)]
)
def test_a_spacing_at_the_detector_beside_a_magnification_is_told(tmp_path, imager, factor, is_told):
    elements = {"ImagerPixelSpacing": [imager] * 2, "EstimatedRadiographicMagnificationFactor": factor}
    found = told(read(save_stack(tmp_path, axial(), PixelSpacing=[0.5, 0.5], **elements)))
    assert ("W-GEOMETRY-CONTRADICTED" in found) == is_told
    if is_told:
        assert "MagnificationFactor 1.5, by which lengths" in found["W-GEOMETRY-CONTRADICTED"]


def test_the_shape_of_pixels_without_a_distance_is_kept(tmp_path):
    dataset, _ = many_frames([0] * 3, **CAPTURE, PixelAspectRatio=["3", "2"])
    volume = read(save(dataset, tmp_path / "a"))
    assert volume.spacing == (1, 1.5, 1)
    assert "pixels 1 mm wide are taken" in told(volume)["W-SPACING-MISSING"]


def test_a_shape_of_pixels_that_contradicts_their_distance_is_told_without_positions(tmp_path):
    dataset, _ = many_frames([0] * 3, **CAPTURE, PixelAspectRatio=["3", "2"], PixelSpacing=[0.5, 0.5])
    volume = read(save(dataset, tmp_path / "a"))
    assert volume.spacing == (0.5, 0.5, 1)
    assert "PixelAspectRatio 3:2" in told(volume)["W-GEOMETRY-CONTRADICTED"]


def test_locations_of_frames_without_a_position_are_their_distances(tmp_path):
    dataset, values = many_frames([0] * 4, **CAPTURE, PixelSpacing=[0.5, 0.5])
    dataset.FrameIncrementPointer = 0x00182005
    dataset.SliceLocationVector = [6, 4, 2, 0]
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_array_equal(volume.values, values[::-1])
    assert (volume.spacing, volume.space) == ((0.5, 0.5, 2), "none")
    assert list(told(volume)) == ["W-POSITION-MISSING"]
