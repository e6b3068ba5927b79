"""Files with many frames: enhanced images, dose grids, nuclear medicine."""

import numpy as np
import pytest
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, VolumeError
from tests.volume_io.dicom.scanner import make_slice, plane_values, save
from tests.volume_io.reading import physical, read

NOWHERE = {"ImagePositionPatient": None, "ImageOrientationPatient": None, "PixelSpacing": None}


def item(**elements):
    dataset = Dataset()
    for key, value in elements.items():
        setattr(dataset, key, value)
    return dataset


def sequence(**elements):
    return Sequence([item(**elements)])


def many_frames(heights, **elements):
    """A file with a frame a height, its pixels only."""
    values = np.array([plane_values(k) for k in range(len(heights))])
    dataset = make_slice((0, 0, 0), 0, values=values[0], **{**NOWHERE, **elements})
    dataset.NumberOfFrames = len(heights)
    dataset.PixelData = values.tobytes()
    return dataset, values


def enhanced(heights, times=None, slopes=None, **elements):
    """An enhanced file whose frames lie at the heights, in the groups that the standard has for it."""
    dataset, values = many_frames(heights, **elements)
    shared = item(
        PlaneOrientationSequence=sequence(ImageOrientationPatient=[1, 0, 0, 0, 1, 0]),
        PixelMeasuresSequence=sequence(PixelSpacing=[0.5, 0.75]),
    )
    dataset.SharedFunctionalGroupsSequence = Sequence([shared])
    groups = []
    for k, height in enumerate(heights):
        group = item(PlanePositionSequence=sequence(ImagePositionPatient=[1, 2, height]))
        if times:
            group.FrameContentSequence = sequence(TemporalPositionIndex=times[k])
        if slopes:
            group.PixelValueTransformationSequence = sequence(RescaleSlope=slopes[k], RescaleIntercept=-k)
        groups.append(group)
    dataset.PerFrameFunctionalGroupsSequence = Sequence(groups)
    return dataset, values


def test_frames_are_sorted_by_their_own_positions(tmp_path):
    dataset, values = enhanced([4, 0, 2])
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_array_equal(volume.values, values[[1, 2, 0]])
    np.testing.assert_array_equal(
        volume.affine, [[0.75, 0, 0, 1], [0, 0.5, 0, 2], [0, 0, 2, 0], [0, 0, 0, 1]]
    )
    assert volume.space == "LPS"


def test_rescale_of_each_frame(tmp_path):
    dataset, values = enhanced([0, 2, 4], slopes=[1, 2, 3])
    volume = read(save(dataset, tmp_path / "a"))
    expected = [values[k] * (k + 1.0) - k for k in range(3)]
    assert volume.values.dtype == np.float32
    np.testing.assert_array_equal(physical(volume), expected)


def test_time_points_are_volumes_to_choose_from(tmp_path):
    dataset, values = enhanced([0, 2, 4, 0, 2, 4], times=[1, 1, 1, 2, 2, 2])
    path = save(dataset, tmp_path / "a")
    with pytest.raises(AmbiguousVolumeError, match=r"(?s)temporal position 1.*temporal position 2"):
        read(path)
    np.testing.assert_array_equal(read(path, series="2").values, values[3:])


@pytest.mark.parametrize("syntax", [ExplicitVRLittleEndian, ImplicitVRLittleEndian])
@pytest.mark.parametrize(
    ("label", "name", "element", "values"),
    [
        ("stack", "FrameContentSequence", "StackID", "AB"),
        ("echo time", "MREchoSequence", "EffectiveEchoTime", (20.0, 80.0)),
        ("temporal position", "FrameContentSequence", "TemporalPositionIndex", (1, 2)),
        ("b-value", "MRDiffusionSequence", "DiffusionBValue", (0.0, 800.0)),
        ("frame type", "MRImageFrameTypeSequence", "FrameType", ("M", "P")),
    ],
)
def test_what_tells_frames_at_the_same_place_apart_is_named(tmp_path, label, name, element, values, syntax):
    dataset, pixels = enhanced([0, 2, 4, 0, 2, 4], syntax=syntax)
    for number, group in enumerate(dataset.PerFrameFunctionalGroupsSequence):
        setattr(group, name, sequence(**{element: values[number // 3]}))
    path = save(dataset, tmp_path / "a")
    told = [
        f"{label} {value:g}" if label in ("echo time", "b-value") else f"{label} {value}" for value in values
    ]
    with pytest.raises(AmbiguousVolumeError, match="(?s)" + ".*".join(told)):
        read(path)
    np.testing.assert_array_equal(read(path, series="2").values, pixels[3:])


def test_groups_and_frames_must_agree(tmp_path):
    dataset, _ = enhanced([0, 2, 4])
    dataset.PerFrameFunctionalGroupsSequence = dataset.PerFrameFunctionalGroupsSequence[:2]
    with pytest.raises(DamagedVolumeError, match="2 functional groups found for 3 frames"):
        read(save(dataset, tmp_path / "a"))


def test_an_absurd_number_of_frames_is_told_as_it_is(tmp_path):
    dataset, _ = many_frames([0, 2, 4])
    dataset.NumberOfFrames = 2_000_000_001
    with pytest.raises(DamagedVolumeError, match="2000000001 frames found"):
        read(save(dataset, tmp_path / "a"))


def test_a_dose_grid_has_offsets_and_a_scaling(tmp_path):
    place = {
        "ImagePositionPatient": [1, 2, 3],
        "ImageOrientationPatient": [1, 0, 0, 0, 1, 0],
        "PixelSpacing": [1, 1],
    }
    dataset, values = many_frames(
        [0, 0, 0], Modality="RTDOSE", RescaleSlope=None, RescaleIntercept=None, **place
    )
    dataset.GridFrameOffsetVector = [0, 2.5, 5]
    dataset.DoseGridScaling = "0.5"
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_array_equal(physical(volume), values * 0.5)
    np.testing.assert_array_equal(volume.affine[:3, 3], [1, 2, 3])
    assert volume.spacing == (1, 1, 2.5)


def test_nuclear_medicine_has_its_place_in_its_detector(tmp_path):
    dataset, values = many_frames([0, 0, 0], Modality="NM", SpacingBetweenSlices="4", PixelSpacing=[2, 2])
    dataset.DetectorInformationSequence = sequence(
        ImagePositionPatient=[5, 6, 7], ImageOrientationPatient=[1, 0, 0, 0, 1, 0]
    )
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_array_equal(volume.values, values)
    np.testing.assert_array_equal(volume.affine, [[2, 0, 0, 5], [0, 2, 0, 6], [0, 0, 4, 7], [0, 0, 0, 1]])


def test_positions_of_an_ultrasound_volume_without_directions_are_refused(tmp_path):
    dataset, _ = many_frames([0, 1, 2], SOPClassUID="1.2.840.10008.5.1.4.1.1.6.2")
    heights = (0.0, 3.5, 7.0)
    dataset.PerFrameFunctionalGroupsSequence = Sequence(
        [item(PlanePositionVolumeSequence=sequence(ImagePositionVolume=[0, 0, z])) for z in heights]
    )
    with pytest.raises(VolumeError, match="no position or orientation"):
        read(save(dataset, tmp_path / "a"))
