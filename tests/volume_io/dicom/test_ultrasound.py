"""Enhanced ultrasound volumes: planes in a frame of reference of their own, or in the patient."""

import numpy as np
import pytest
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian

from dmc_cli.errors import AmbiguousVolumeError, VolumeError
from tests.volume_io.dicom.scanner import save
from tests.volume_io.dicom.test_factors import listed
from tests.volume_io.dicom.test_frames import item, many_frames, sequence
from tests.volume_io.dicom.test_kinds import told
from tests.volume_io.reading import read

ENHANCED_US = "1.2.840.10008.5.1.4.1.1.6.2"
DIRECTIONS = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]


def ultrasound(heights, syntax=ExplicitVRLittleEndian, directions=DIRECTIONS, spacing=(0.4, 0.6)):
    """An enhanced ultrasound volume whose planes lie at the heights in the volume's frame of reference."""
    dataset, values = many_frames(
        heights, SOPClassUID=ENHANCED_US, Modality="US", UltrasoundAcquisitionGeometry="APEX", syntax=syntax
    )
    shared = item()
    if directions:
        shared.PlaneOrientationVolumeSequence = sequence(ImageOrientationVolume=directions)
    if spacing:
        shared.PixelMeasuresSequence = sequence(PixelSpacing=list(spacing))
    dataset.SharedFunctionalGroupsSequence = Sequence([shared])
    dataset.PerFrameFunctionalGroupsSequence = Sequence(
        item(PlanePositionVolumeSequence=sequence(ImagePositionVolume=[5.0, 6.0, float(height)]))
        for height in heights
    )
    return dataset, values


@pytest.mark.parametrize("syntax", [ExplicitVRLittleEndian, ImplicitVRLittleEndian])
def test_planes_of_an_ultrasound_volume_lie_in_its_own_frame_of_reference(tmp_path, syntax):
    dataset, values = ultrasound([3, 0, 1.5], syntax)
    path = save(dataset, tmp_path / "a")
    volume = read(path)
    np.testing.assert_array_equal(volume.values, values[[1, 2, 0]])
    np.testing.assert_array_equal(
        volume.affine, [[0.6, 0, 0, 5], [0, 0.4, 0, 6], [0, 0, 1.5, 0], [0, 0, 0, 1]]
    )
    assert volume.space == "none"
    assert "how it lies in the patient is not told" in told(volume)["W-ORIENTATION-MISSING"]
    with pytest.raises(AmbiguousVolumeError, match="how it lies in the patient"):
        read(path, strict=True)


def test_planes_that_tell_their_place_in_the_patient_have_it(tmp_path):
    dataset, _ = ultrasound([0, 1.5, 3])
    shared = dataset.SharedFunctionalGroupsSequence[0]
    shared.PlaneOrientationSequence = sequence(ImageOrientationPatient=[0, 1, 0, 0, 0, -1])
    for n, group in enumerate(dataset.PerFrameFunctionalGroupsSequence):
        group.PlanePositionSequence = sequence(ImagePositionPatient=[-1.5 * n, 7, 8])
    volume = read(save(dataset, tmp_path / "a"))
    assert (volume.space, told(volume)) == ("LPS", {})
    np.testing.assert_array_equal(volume.affine[:3, 3], [0, 7, 8])


def test_data_types_and_times_of_an_ultrasound_volume_are_factors(tmp_path):
    dataset, values = ultrasound([0, 1.5] * 4)
    for n, group in enumerate(dataset.PerFrameFunctionalGroupsSequence):
        group.ImageDataTypeSequence = sequence(DataType=("TISSUE_INTENSITY", "FLOW_POWER")[n // 4])
        group.TemporalPositionSequence = sequence(TemporalPositionTimeOffset=(0.5, 0.0)[n // 2 % 2])
    path = save(dataset, tmp_path / "a")
    assert [text.split("(")[1][:-1] for text in listed(path)] == [
        f"temporal offset {time} s, data type {kind}"
        for time in ("0", "0.5")
        for kind in ("FLOW_POWER", "TISSUE_INTENSITY")
    ]
    np.testing.assert_array_equal(read(path, series="1").values, values[[6, 7]])


@pytest.mark.parametrize(
    ("lacking", "sentence"),
    [({"directions": None}, "no position or orientation"), ({"spacing": None}, "no pixel spacing")],
)
def test_an_ultrasound_volume_that_does_not_tell_its_geometry_is_refused(tmp_path, lacking, sentence):
    dataset, _ = ultrasound([0, 1.5, 3], **lacking)
    with pytest.raises(VolumeError, match=sentence):
        read(save(dataset, tmp_path / "a"))
