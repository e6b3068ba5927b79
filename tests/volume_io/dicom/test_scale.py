"""What stored values mean: lookup tables, dose scaling, bits; what is told and not applied."""

import numpy as np
import pydicom
import pytest
from pydicom.pixels import apply_modality_lut
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian

from dmc_cli.errors import DamagedVolumeError
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.dicom.test_frames import enhanced, item, many_frames, sequence
from tests.volume_io.reading import physical, read


def told(volume):
    return {notice.code: notice.sentence for notice in volume.warnings}


def table(first, values, bits=16, vr="US"):
    """A Modality LUT; 8-bit entries lie two in a word."""
    lut = item(ModalityLUTType="US")
    lut.add_new(0x00283002, vr, [len(values), first, bits])
    content = np.asarray(values, "<u2" if bits > 8 else "u1").tobytes()
    lut.add_new(0x00283006, "OW", content + b"\0" * (len(content) % 2))
    return lut


@pytest.mark.parametrize("syntax", [ExplicitVRLittleEndian, ImplicitVRLittleEndian])
@pytest.mark.parametrize(("first", "bits"), [(0, 16), (5, 16), (3, 8)])
def test_a_modality_lut_takes_the_place_of_the_rescale(tmp_path, syntax, first, bits):
    values = [(17 * n + 3) % 200 for n in range(300 if bits == 16 else 251)]
    lut = Sequence([table(first, values, bits)])
    save_stack(tmp_path, axial(), names="abcd", syntax=syntax, ModalityLUTSequence=lut)
    volume = read(tmp_path)
    stored = np.array([plane_values(k) for k in range(4)])
    np.testing.assert_array_equal(physical(volume), np.take(values, stored - first, mode="clip"))
    assert (volume.slope, volume.intercept, volume.warnings) == (1, 0, ())


def test_a_lut_of_values_with_a_sign_begins_below_zero(tmp_path):
    lut = Sequence([table(-20, range(500, 600), vr="SS")])
    values = np.arange(-30, -10, dtype="<i2").reshape(4, 5)
    volume = read(save_stack(tmp_path, axial(), values=values, ModalityLUTSequence=lut))
    np.testing.assert_array_equal(volume.values[0].ravel(), [500] * 10 + list(range(500, 510)))


def test_a_lut_of_each_slice_and_padding(tmp_path):
    for k, position in enumerate(axial()):
        lut = Sequence([table(0, np.arange(400) + 1000 * k)])
        save(make_slice(position, k, ModalityLUTSequence=lut, PixelPaddingValue=3), tmp_path / f"{k}")
    expected = np.array([plane_values(k) + 1000.0 * k for k in range(4)])
    expected[0, 0, 3] = np.nan
    np.testing.assert_array_equal(read(tmp_path).values, expected)


def test_a_lut_of_each_frame(tmp_path):
    dataset, values = enhanced([0, 2, 4])
    for k, group in enumerate(dataset.PerFrameFunctionalGroupsSequence):
        group.PixelValueTransformationSequence = sequence(
            ModalityLUTSequence=Sequence([table(0, np.arange(300) * (k + 1))])
        )
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_array_equal(volume.values, [values[k] * (k + 1) for k in range(3)])


def test_a_lut_that_is_too_short_is_refused(tmp_path):
    lut = table(0, range(10))
    lut[0x00283002].value = [300, 0, 16]
    with pytest.raises(DamagedVolumeError, match="LUT of 10 entries found, 300 expected"):
        read(save_stack(tmp_path, axial(), ModalityLUTSequence=Sequence([lut])))


@pytest.mark.parametrize("syntax", [ExplicitVRLittleEndian, ExplicitVRBigEndian])
@pytest.mark.parametrize("signed", [0, 1])
@pytest.mark.parametrize(("junk", "is_told"), [(0xA000, True), (0, False)])
def test_bits_above_the_stored_ones_are_told(tmp_path, signed, junk, is_told, syntax):
    for k, position in enumerate(axial()):
        values = (plane_values(k, "<i2") - signed * 300).astype("<u2") & 0x0FFF
        values[0, 0] |= junk if k > 1 else 0
        if syntax == ExplicitVRBigEndian:
            values = values.astype(">u2")
        elements = {"BitsStored": 12, "HighBit": 11, "PixelRepresentation": signed, "syntax": syntax}
        save(make_slice(position, k, values=values, **elements), tmp_path / f"{k}")
    volume = read(tmp_path)
    np.testing.assert_array_equal(
        volume.values.astype(int), [plane_values(k).astype(int) - signed * 300 for k in range(4)]
    )
    assert ("W-BITS-CONTRADICTED" in told(volume)) == is_told
    if is_told:
        assert (
            "above the 12 that are stored (BitsStored) found in 2 of 4" in told(volume)["W-BITS-CONTRADICTED"]
        )


def test_the_sign_of_values_is_no_bit_too_many(tmp_path):
    values = np.arange(-10, 10, dtype="<i2").reshape(4, 5)
    volume = read(save_stack(tmp_path, axial(), values=values, BitsStored=12, HighBit=11))
    assert volume.warnings == ()
    np.testing.assert_array_equal(volume.values, [values] * 4)


@pytest.mark.parametrize(
    ("elements", "sentence"),
    [
        ({"BitsStored": 17}, "BitsStored 17 of 16 allocated"),
        ({"BitsStored": 12, "HighBit": 3}, "HighBit 3 of 12 stored"),
        ({"PixelRepresentation": None}, "PixelRepresentation None"),
        ({"PixelRepresentation": 7}, "PixelRepresentation 7"),
    ],
)
def test_a_header_that_contradicts_itself_is_told(tmp_path, elements, sentence):
    volume = read(save_stack(tmp_path, axial(), **elements))
    assert sentence in told(volume)["W-BITS-CONTRADICTED"]


@pytest.mark.parametrize(
    ("lowest", "kind", "is_told"), [(-5, "SS", True), (5, "SS", False), (5, "US", False)]
)
def test_a_lowest_value_with_a_sign_of_values_without_is_told(tmp_path, lowest, kind, is_told):
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k, values=plane_values(k, "<u2"))
        dataset.add_new(0x00280106, kind, lowest)
        save(dataset, tmp_path / str(k))
    sentence = told(read(tmp_path)).get("W-BITS-CONTRADICTED", "")
    assert ("SmallestImagePixelValue -5" in sentence) == is_told


def test_float_pixels_have_no_representation_to_contradict(tmp_path):
    dataset, _ = enhanced([0, 2, 4], RescaleIntercept="0")
    values = np.linspace(-1, 1, 60, dtype="<f4").reshape(3, 4, 5)
    for name in ("PixelData", "BitsStored", "HighBit", "PixelRepresentation"):
        delattr(dataset, name)
    dataset.BitsAllocated, dataset.FloatPixelData = 32, values.tobytes()
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_array_equal(volume.values, values)
    assert volume.warnings == ()


@pytest.mark.parametrize(("slope", "is_told"), [(2.0, True), (1.0, False)])
def test_real_world_values_are_told_and_not_applied(tmp_path, slope, is_told):
    mapped = item(RealWorldValueSlope=slope, RealWorldValueIntercept=-1024.0)
    mapped.MeasurementUnitsCodeSequence = sequence(CodeValue="HU", CodeMeaning="Hounsfield")
    volume = read(save_stack(tmp_path, axial(), RealWorldValueMappingSequence=Sequence([mapped])))
    assert (volume.slope, volume.intercept) == (1, -1024)
    assert ("W-VALUES-MAPPED" in told(volume)) == is_told


def test_pet_has_a_rescale_for_each_slice_and_no_uptake(tmp_path):
    for k, position in enumerate(axial()):
        elements = {"RescaleSlope": str(1 + k / 2), "RescaleIntercept": "0", "Units": "BQML"}
        elements |= {"Modality": "PT", "DecayCorrection": "START"}
        save(make_slice(position, k, **elements), tmp_path / f"{k}")
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, [plane_values(k) * (1 + k / 2) for k in range(4)])
    assert "PET values in BQML with decay correction START found" in told(volume)["W-VALUES-MAPPED"]


PLACE = {
    "ImagePositionPatient": [1, 2, 3],
    "ImageOrientationPatient": [1, 0, 0, 0, 1, 0],
    "PixelSpacing": [1, 1],
    "Modality": "RTDOSE",
    "RescaleSlope": None,
    "RescaleIntercept": None,
}


def test_a_dose_without_its_scaling_is_told(tmp_path):
    dataset, values = many_frames([0, 0, 0], **PLACE)
    dataset.GridFrameOffsetVector = [0, 2.5, 5]
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_array_equal(physical(volume), values)
    assert "without DoseGridScaling" in told(volume)["W-RESCALE-UNKNOWN"]


@pytest.mark.parametrize(
    ("offsets", "orientation", "is_told"),
    [
        ([0, 2, 4], [1, 0, 0, 0, 1, 0], False),
        ([3, 5, 7], [1, 0, 0, 0, 1, 0], False),
        ([4, 6, 8], [1, 0, 0, 0, 1, 0], True),
        ([3, 5, 7], [-1, 0, 0, 0, -1, 0], True),
    ],
)
def test_dose_offsets_that_contradict_the_position_are_told(tmp_path, offsets, orientation, is_told):
    place = PLACE | {"ImageOrientationPatient": orientation, "DoseGridScaling": "0.5"}
    dataset, values = many_frames([0, 0, 0], **place)
    dataset.GridFrameOffsetVector = offsets
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_array_equal(physical(volume), values * 0.5)
    np.testing.assert_array_equal(volume.affine[:3, 2:], [[0, 1], [0, 2], [2, 3]])
    assert ("W-GEOMETRY-CONTRADICTED" in told(volume)) == is_told


@pytest.mark.parametrize("name", ["lut", "lut_and_rescale"])
def test_case_of_a_modality_lut(cases, name):
    folder = cases / "modality_lut" / name
    volume = read(folder)
    assert volume.value_range() == (95, 4095)
    datasets = sorted(
        (pydicom.dcmread(p) for p in folder.glob("*.dcm")), key=lambda d: d.ImagePositionPatient[2]
    )
    expected = [apply_modality_lut(dataset.pixel_array, dataset) for dataset in datasets]
    np.testing.assert_array_equal(volume.values, expected)


@pytest.mark.parametrize(
    ("name", "ends"), [("relative", (-50, -17)), ("absolute", (-50, -17)), ("relative_negative", (-83, -50))]
)
def test_case_of_dose_offsets(cases, name, ends):
    path = cases / "rtdose_offsets" / f"{name}.dcm"
    volume = read(path)
    first, step = volume.affine[2, 3], volume.affine[2, 2]
    last = first + step * (volume.shape[2] - 1)
    np.testing.assert_allclose(sorted((first, last)), ends)
    dataset = pydicom.dcmread(path)
    planes = dataset.pixel_array * float(dataset.DoseGridScaling)
    heights = np.array(dataset.GridFrameOffsetVector, float)
    order = np.argsort(heights) if step > 0 else np.argsort(-heights)
    np.testing.assert_allclose(physical(volume), planes[order])


@pytest.mark.parametrize(
    ("intercept", "lacking", "is_told"),
    [("-1024", 2, True), ("-1024", 0, False), ("0", 2, False), (None, 0, False)],
)
def test_a_rescale_that_only_some_slices_have_is_told(tmp_path, intercept, lacking, is_told):
    for k, position in enumerate(axial()):
        told = {} if k >= lacking else {"RescaleSlope": None}
        scale = None if k < lacking else intercept
        save(make_slice(position, k, RescaleIntercept=scale, **told), tmp_path / f"IM{k}")
    volume = read(tmp_path)
    assert [notice.code for notice in volume.warnings] == ["W-RESCALE-UNKNOWN"] * is_told
    if is_told:
        assert "in 2 of 4 slices, first IM0" in volume.sentences[0]


@pytest.mark.parametrize(
    ("modality", "first", "second", "is_told"),
    [
        ("CT", "HU", "US", True),
        ("CT", None, "HU", False),
        ("CT", None, "US", True),
        ("CT", "HU_MOD", "HU", True),
        ("MR", None, "US", False),
        ("MR", "US", "NORMALIZED", True),
    ],
)
def test_values_measured_in_different_things_are_told(tmp_path, modality, first, second, is_told):
    for k, position in enumerate(axial()):
        kind = first if k < 1 else second
        save(make_slice(position, k, Modality=modality, RescaleType=kind), tmp_path / f"IM{k}")
    volume = read(tmp_path)
    assert [notice.code for notice in volume.warnings] == ["W-RESCALE-UNKNOWN"] * is_told
    if is_told:
        assert "in 1, first IM0" in volume.sentences[0]
        assert "in 3, first IM1" in volume.sentences[0]


@pytest.mark.parametrize("kinds", ["HU US", "HU HU"])
def test_frames_and_tables_measured_in_different_things_are_told(tmp_path, kinds):
    dataset, _ = enhanced([0, 2])
    is_told = kinds == "HU US"
    for group, kind in zip(dataset.PerFrameFunctionalGroupsSequence, kinds.split(), strict=True):
        group.PixelValueTransformationSequence = sequence(
            RescaleType=kind, RescaleSlope=1, RescaleIntercept=0
        )
    codes = [notice.code for notice in read(save(dataset, tmp_path / "a")).warnings]
    assert codes == ["W-RESCALE-UNKNOWN"] * is_told
    for k, kind in enumerate(kinds.split()):
        lut = table(0, np.arange(400))
        lut.ModalityLUTType = kind
        save(make_slice(axial()[k], k, ModalityLUTSequence=Sequence([lut])), tmp_path / f"luts/{k}")
    codes = [notice.code for notice in read(tmp_path / "luts").warnings]
    assert codes == ["W-RESCALE-UNKNOWN"] * is_told
