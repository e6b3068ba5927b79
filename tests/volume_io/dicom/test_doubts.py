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


@pytest.mark.parametrize("heights", [[0, 2, 4, 6], [0, 9], [0, 3, 6]])
@pytest.mark.parametrize("name", ["SpacingBetweenSlices", "SliceThickness"])
def test_what_functional_groups_tell_of_distances_counts(tmp_path, heights, name):
    dataset, _ = enhanced(heights)
    measures = dataset.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0]
    setattr(measures, name, 1.0)
    path = save(dataset, tmp_path / "a")
    if name == "SliceThickness":
        assert "others may be missing" in told(read(path))["W-SLICES-DOUBTFUL"]
    else:
        with pytest.raises(AmbiguousVolumeError, match=r"SpacingBetweenSlices is 1\.000 mm"):
            read(path)


def test_a_wide_gap_between_slices_of_micrometres(tmp_path):
    heights = [*(0.005 * np.arange(10)), 1.0, 1.005]
    save_stack(tmp_path, [(0, 0, z) for z in heights], PixelSpacing=[0.005, 0.005])
    with pytest.raises(
        AmbiguousVolumeError, match=r"190 missing slices found: 0\.955 mm .* 0\.005 mm elsewhere"
    ):
        read(tmp_path)


@pytest.mark.parametrize(
    "elements", [{"PixelSpacing": [0.50045, 0.75]}, {"orientation": (1, 0.0009, 0, -0.0009, 1, 0)}]
)
def test_directions_and_spacings_that_vary_are_told(tmp_path, elements):
    for k, position in enumerate(axial()):
        values = plane_values(0, shape=(200, 200))
        save(make_slice(position, k, values=values, **(elements if k == 2 else {})), tmp_path / str(k))
    assert "the last node of 2 is 0." in told(read(tmp_path))["W-GEOMETRY-CONTRADICTED"]


@pytest.mark.parametrize(("bits", "written"), [(12, 4096 - 20), (12, 65536 - 20), (16, 65536 - 20)])
def test_padding_written_without_its_sign(tmp_path, bits, written):
    for k, position in enumerate(axial()):
        values = ((plane_values(k, "<i4") - 25) & ((1 << bits) - 1)).astype("<u2")
        elements = {"BitsStored": bits, "HighBit": bits - 1, "PixelRepresentation": 1}
        dataset = make_slice(position, k, values=values, **elements)
        dataset.add_new(0x00280120, "US", written)
        save(dataset, tmp_path / str(k))
    assert read(tmp_path).padding == (-20, -20)


@pytest.mark.parametrize(("stated", "thickness"), [("2", "5"), ("1.5", "5.5")])
def test_the_space_that_slices_leave_is_no_distance(tmp_path, stated, thickness):
    elements = {"SpacingBetweenSlices": stated, "SliceThickness": thickness}
    volume = read(save_stack(tmp_path, axial(5, 7.0), **elements))
    assert (volume.spacing[2], told(volume)) == (7, {})


@pytest.mark.parametrize(
    ("keyword", "values", "sentence"),
    [
        ("PatientID", ["A", "A", "B", "B"], "2 patients (0010,0020)"),
        ("StudyInstanceUID", ["1.2", "1.2", "1.2", "1.3"], "2 studies (0020,000D)"),
        ("PatientID", ["A", "A", "", None], ""),
    ],
)
def test_slices_of_several_patients_are_told(tmp_path, keyword, values, sentence):
    for k, (position, value) in enumerate(zip(axial(4), values, strict=True)):
        save(make_slice(position, k, **{keyword: value}), tmp_path / str(k))
    found = told(read(tmp_path))
    assert list(found) == (["W-IDENTITY-CONTRADICTED"] if sentence else [])
    assert sentence in found.get("W-IDENTITY-CONTRADICTED", "")


@pytest.mark.parametrize(
    ("parts", "total", "is_told"),
    [((1, 2, 3), 3, False), ((1, 2), 3, True), ((1, 3), None, True), ((1, 2), None, False)],
)
def test_missing_parts_of_a_concatenation_are_told(tmp_path, parts, total, is_told):
    for n, part in enumerate(parts):
        numbers = {"InConcatenationNumber": part, "InConcatenationTotalNumber": total}
        dataset, _ = enhanced([6 * n, 6 * n + 2, 6 * n + 4], ConcatenationUID="1.2.9", **numbers)
        save(dataset, tmp_path / str(n))
    volume = read(tmp_path)
    assert len(volume.values) == 3 * len(parts)
    assert [notice.code for notice in volume.warnings] == (["W-FILE-DAMAGED"] if is_told else [])


@pytest.mark.parametrize(("stated", "is_told"), [(4, False), (6, True), (None, False)])
def test_slices_that_pet_counts_otherwise_are_told(tmp_path, stated, is_told):
    save_stack(tmp_path, axial(4), NumberOfSlices=stated)
    codes = [notice.code for notice in read(tmp_path).warnings]
    assert codes == (["W-SLICES-DOUBTFUL"] if is_told else [])
