"""Files that contradict themselves: indexes of missing files, lengths of pixels, times of day, planes."""

import numpy as np
import pytest
from pydicom.dataset import FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian, generate_uid

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError
from dmc_cli.volume_io.dicom.repetitions import are_regular
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.dicom.test_factors import listed
from tests.volume_io.dicom.test_frames import enhanced, item, sequence
from tests.volume_io.reading import read


def told(volume):
    return {notice.code: notice.sentence for notice in volume.warnings}


def directory(files):
    """A DICOMDIR that lists files."""
    meta = FileMetaDataset()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    meta.MediaStorageSOPClassUID = "1.2.840.10008.1.3.10"
    meta.MediaStorageSOPInstanceUID = generate_uid()
    records = [item(DirectoryRecordType="PATIENT")]
    records += [item(DirectoryRecordType="IMAGE", ReferencedFileID=file.split("/")) for file in files]
    dataset = item(FileSetID="", DirectoryRecordSequence=Sequence(records))
    dataset.file_meta = meta
    return dataset


@pytest.mark.parametrize("is_named", [True, False])
def test_files_that_a_dicomdir_lists_and_that_are_missing_are_told(tmp_path, is_named):
    files = [f"IMAGES/IM{k}" for k in range(5)]
    for k, position in enumerate(axial(5)):
        save(make_slice(position, k), tmp_path / f"images/IM{k}")
    path = save(directory(files), tmp_path / "DICOMDIR", enforce_file_format=False)
    path = path if is_named else tmp_path
    assert told(read(path)) == {}
    (tmp_path / "images/IM4").unlink()
    assert "DICOMDIR lists 1 file(s) that are not there: IMAGES/IM4;" in told(read(path))["W-FILE-DAMAGED"]


@pytest.mark.parametrize(
    ("more", "outcome"),
    [
        (b"", None),
        (b"\0\0", "longer than rows"),
        (bytes(30), "longer than rows"),
        (bytes(40), DamagedVolumeError),
    ],
)
def test_pixels_that_are_longer_than_they_should_be(tmp_path, more, outcome):
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k)
        dataset.PixelData += more
        save(dataset, tmp_path / f"{k}")
    if outcome is DamagedVolumeError:
        with pytest.raises(DamagedVolumeError, match="pixel data of 80 bytes found, 40 expected"):
            read(tmp_path)
        return
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, [plane_values(k) for k in range(4)])
    assert (outcome or "") in told(volume).get("W-BITS-CONTRADICTED", "" if outcome is None else "nothing")


def test_an_odd_number_of_bytes_is_padded(tmp_path):
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k, values=plane_values(k, "u1", (3, 3)))
        dataset.PixelData += b"\0"
        save(dataset, tmp_path / f"{k}")
    assert told(read(tmp_path)) == {}


def test_fragments_of_known_length_under_a_native_syntax_are_refused(tmp_path):
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k)
        dataset.PixelData = b"\xfe\xff\x00\xe0\0\0\0\0\xfe\xff\x00\xe0" + bytes(40)
        save(dataset, tmp_path / f"{k}")
    with pytest.raises(DamagedVolumeError, match="or in fragments"):
        read(tmp_path)


CLOCK = "acquisition time"


@pytest.mark.parametrize(
    ("times", "name", "expected"),
    [
        ([["0", "10", "20"], ["1", "11", "21"]], CLOCK, True),
        ([["10", "11", "12"], ["14", "15", "16"]], CLOCK, True),
        ([["10", "11"], ["14", "16"], ["20", "21"]], CLOCK, True),
        ([["10", "11", "13"], ["14", "16", "17"]], CLOCK, False),
        ([["101158", "101159", "101200"], ["101301", "101302", "101303"]], CLOCK, True),
        ([["0", "45", "90", "135"], ["0", "55", "110", "165"]], "trigger time", True),
        ([["0", "45", "90", "855"], ["0", "155", "210", "965"]], "trigger time", True),
        ([["0", "450", "500", "855"], ["0", "55", "110", "965"]], "trigger time", False),
        ([["1", "2"], ["2", "3"]], "temporal position", False),
        ([["a", "b"], ["a", "c"]], CLOCK, False),
    ],
)
def test_repetitions_belong_together_only_where_their_times_show_it(times, name, expected):
    assert are_regular(times, name) == expected


def test_repetitions_that_lack_one_image_at_each_place_are_refused(tmp_path):
    removed = {0: 0, 1: 2, 2: 1, 3: 0}
    for k, position in enumerate(axial()):
        for n in {0, 1, 2} - {removed[k]}:
            time = f"1012{10 * n + k:02}"
            dataset = make_slice(position, k, values=plane_values(k + 10 * n), AcquisitionTime=time)
            save(dataset, tmp_path / f"{n}{k}")
    with pytest.raises(AmbiguousVolumeError, match="lie where another one lies"):
        read(tmp_path)


def test_stacks_of_several_directions_in_one_object_are_named_by_them(tmp_path):
    dataset, _ = enhanced(range(9))
    directions = ([1, 0, 0, 0, 1, 0], [0, 1, 0, 0, 0, -1], [1, 0, 0, 0, 0, -1])
    for n, group in enumerate(dataset.PerFrameFunctionalGroupsSequence):
        cosines = directions[n // 3]
        position = 2.0 * (n % 3) * np.cross(cosines[:3], cosines[3:])
        group.PlanePositionSequence = sequence(ImagePositionPatient=[float(x) for x in position])
        group.PlaneOrientationSequence = sequence(ImageOrientationPatient=cosines)
    path = save(dataset, tmp_path / "a")
    assert [text.split("(")[1] for text in listed(path)] == ["axial)", "sagittal)", "coronal)"]


def test_a_relative_dose_is_told(tmp_path):
    volume = read(save_stack(tmp_path, axial(), Modality="RTDOSE", DoseUnits="RELATIVE", DoseGridScaling="2"))
    assert "relative dose" in told(volume)["W-VALUES-MAPPED"]
