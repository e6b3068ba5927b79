"""Makers' own elements, objects beside objects, volumes that lack slices, contradicted geometry."""

import numpy as np
import pytest
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian, generate_uid

from dmc_cli.errors import AmbiguousVolumeError, VolumeError
from dmc_cli.volume_io.dicom.makers import GE
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.dicom.test_factors import PLACED, listed, nuclear
from tests.volume_io.dicom.test_frames import enhanced, many_frames, sequence
from tests.volume_io.dicom.test_segments import random_masks, segmentation
from tests.volume_io.reading import physical, read

SYNTAXES = [ExplicitVRLittleEndian, ImplicitVRLittleEndian]


def told(volume):
    return {notice.code: notice.sentence for notice in volume.warnings}


def words(path):
    return [text.split("(", 1)[1][:-1] for text in listed(path)]


@pytest.mark.parametrize("syntax", SYNTAXES)
@pytest.mark.parametrize("block", [0x10, 0x12])
@pytest.mark.parametrize("as_unknown", [False, True])
@pytest.mark.parametrize(
    ("group", "creator", "number", "vr", "values", "expected"),
    [
        (0x0019, "SIEMENS MR HEADER", 0x0C, "IS", ("50", "1000"), "b-value {} s/mm2"),
        (0x0043, GE, 0x39, "IS", ([50, 8, 0, 0], [1000001000, 8, 0, 0]), "b-value {} s/mm2"),
        (0x2001, "Philips Imaging DD 001", 0x03, "FL", (50.0, 1000.0), "b-value {} s/mm2"),
        (0x0065, "Image Private Header", 0x09, "FD", (50.0, 1000.0), "b-value {} s/mm2"),
    ],
)
def test_makers_own_b_values(
    tmp_path, syntax, block, as_unknown, group, creator, number, vr, values, expected
):
    for n, value in enumerate(values):
        for k, position in enumerate(axial(3)):
            dataset = make_slice(position, k, values=plane_values(k + 10 * n), syntax=syntax)
            dataset.add_new(group << 16 | block, "LO", creator)
            tag = group << 16 | block << 8 | number
            dataset.add_new(tag, vr, value)
            if as_unknown:
                texts = "\\".join(map(str, np.atleast_1d(value)))
                packed = (
                    np.array(value, {"FL": "<f4", "FD": "<f8"}[vr]).tobytes()
                    if vr in ("FL", "FD")
                    else texts.encode()
                )
                dataset.add_new(tag, "UN", packed + b" " * (len(packed) % 2))
            save(dataset, tmp_path / f"{(n * 7 + k * 5) % 23}")
    assert words(tmp_path) == [expected.format(50), expected.format(1000)]
    np.testing.assert_array_equal(read(tmp_path, series="2").values, [plane_values(k + 10) for k in range(3)])


def test_elements_of_another_owner_are_not_taken(tmp_path):
    for n in range(2):
        for k, position in enumerate(axial(3)):
            dataset = make_slice(position, k, values=plane_values(k + 10 * n))
            dataset.add_new(0x00190010, "LO", "ANOTHER")
            dataset.add_new(0x0019100C, "IS", str(n))
            save(dataset, tmp_path / f"{n}{k}")
    with pytest.raises(AmbiguousVolumeError, match="lie where another one lies"):
        read(tmp_path)


def test_parts_of_complex_images_of_ge(tmp_path):
    for n in range(4):
        for k, position in enumerate(axial(3)):
            dataset = make_slice(position, k, values=plane_values(k + 10 * n))
            dataset.add_new(0x00430010, "LO", GE)
            dataset.add_new(0x0043102F, "SS", n)
            save(dataset, tmp_path / f"{n}{k}")
    assert words(tmp_path) == [
        f"complex component {name}" for name in ("IMAGINARY", "MAGNITUDE", "PHASE", "REAL")
    ]


@pytest.mark.parametrize("syntax", SYNTAXES)
def test_elements_of_the_single_images_that_an_enhanced_one_was_made_of(tmp_path, syntax):
    dataset, values = enhanced([0, 2, 4, 0, 2, 4], syntax=syntax)
    for n, group in enumerate(dataset.PerFrameFunctionalGroupsSequence):
        group.UnassignedPerFrameConvertedAttributesSequence = sequence(EchoTime=("80.0", "9")[n // 3])
    path = save(dataset, tmp_path / "a")
    assert words(path) == ["echo time 9 ms", "echo time 80 ms"]
    np.testing.assert_array_equal(read(path, series="1").values, values[3:])


def test_times_within_a_second_are_told_apart(tmp_path):
    for n, time in enumerate(("101112.125", "101112.25")):
        save_stack(tmp_path / str(n), axial(), ContentTime=time)
    assert words(tmp_path) == ["content time 101112.125", "content time 101112.25"]


def test_one_number_in_several_spellings_is_one(tmp_path):
    for n, spellings in enumerate((("5", "5.0", "5.00"), ("50", "5E1", "50."))):
        for k, position in enumerate(axial(3)):
            save(
                make_slice(position, k, EchoTime=spellings[k], values=plane_values(k + 10 * n)),
                tmp_path / f"{n}{k}",
            )
    assert words(tmp_path) == ["echo time 5 ms", "echo time 50 ms"]


def test_objects_of_one_series_in_the_same_places(tmp_path):
    for n in (2, 10):
        dataset, _ = enhanced([0, 2, 4])
        dataset.InstanceNumber = str(n)
        dataset.PixelData = (np.frombuffer(dataset.PixelData, "<i2") + np.int16(n)).tobytes()
        save(dataset, tmp_path / str(n))
    assert words(tmp_path) == ["object 2", "object 10"]
    assert read(tmp_path, series="2").values[0, 0, 0] == 10


def test_copies_of_an_enhanced_image_are_copies(tmp_path):
    dataset, values = enhanced([0, 2, 4])
    save(dataset, tmp_path / "a")
    save(dataset, tmp_path / "b")
    with pytest.raises(AmbiguousVolumeError, match="3 of 6 slices lie where another one lies"):
        read(tmp_path)
    np.testing.assert_array_equal(read(tmp_path, duplicates="first").values, values)


def test_segments_of_two_objects_are_not_put_together(tmp_path):
    masks = random_masks(6)
    for n, heights in enumerate(([0, 2, 4], [6, 8, 10])):
        dataset = segmentation([(1, height) for height in heights], masks[3 * n : 3 * n + 3])
        dataset.SOPInstanceUID = generate_uid()
        dataset.InstanceNumber = str(n + 1)
        save(dataset, tmp_path / f"{n}")
    assert len(listed(tmp_path)) == len(set(listed(tmp_path))) == 2
    np.testing.assert_array_equal(physical(read(tmp_path, series="1")), masks[:3])
    np.testing.assert_array_equal(physical(read(tmp_path, series="2")), masks[3:])


def test_another_volume_shows_that_every_second_slice_is_missing(tmp_path):
    save_stack(tmp_path / "a", axial(7), EchoTime="5")
    save_stack(tmp_path / "b", axial(7)[::2], EchoTime="50")
    assert told(read(tmp_path, series="1")) == {}
    with pytest.raises(AmbiguousVolumeError, match=r"3 missing slices found.*other volumes of the series"):
        read(tmp_path, series="2")
    assert read(tmp_path, series="2", slice_gaps="keep").spacing[2] == 4


def test_another_volume_shows_how_many_slices_are_missing(tmp_path):
    """Two between each, whose places in two other volumes are rounded differently."""
    for echo, off in (("5", 0), ("10", 0.02)):
        save_stack(tmp_path / echo, [(x, y, z + off) for x, y, z in axial(7)], EchoTime=echo)
    save_stack(tmp_path / "b", axial(7)[::3], EchoTime="50")
    with pytest.raises(AmbiguousVolumeError, match=r"4 missing slices found.*other volumes of the series"):
        read(tmp_path, series="3")


def test_slices_of_another_thickness_leave_nothing_out(tmp_path):
    save_stack(tmp_path / "a", axial(7), ConvolutionKernel="SHARP", SliceThickness="2")
    save_stack(tmp_path / "b", axial(7)[::2], ConvolutionKernel="SOFT", SliceThickness="4")
    assert told(read(tmp_path, series="2")) == {}


def head(folder, missing=()):
    """Write a head of thin slices at its base and thick ones above, which touch each other."""
    slices = [(2.5 * k, "2.5") for k in range(8)] + [(20 + 5.0 * k, "5") for k in range(10)]
    for k, (height, thickness) in enumerate(slices):
        if k not in missing:
            save(make_slice((0, 0, height), k, SliceThickness=thickness), folder / str(k))
    return folder


def test_thick_slices_above_thin_ones_leave_nothing_out(tmp_path):
    volume = read(head(tmp_path))
    np.testing.assert_allclose(volume.slice_positions, [*np.arange(0, 20, 2.5), *np.arange(20, 70, 5)])
    assert list(told(volume)) == ["W-SLICES-UNEVEN"]


@pytest.mark.parametrize("missing", [3, 12])
def test_a_slice_that_is_missing_among_thin_or_thick_ones_shows(tmp_path, missing):
    with pytest.raises(AmbiguousVolumeError, match="1 missing slice found"):
        read(head(tmp_path, {missing}))


def test_ends_that_other_volumes_have_are_told(tmp_path):
    save_stack(tmp_path / "a", axial(7), EchoTime="5")
    save_stack(tmp_path / "b", axial(7)[1:5], EchoTime="50")
    assert "3 place(s) beyond the ends" in told(read(tmp_path, series="2"))["W-SLICES-DOUBTFUL"]


@pytest.mark.parametrize("kept", [[0, 29], [0, 15, 29], list(range(0, 30, 3)), [0, 7, 14, 21, 28]])
@pytest.mark.parametrize("elements", [{"SpacingBetweenSlices": "1"}, {"SliceThickness": "1"}])
def test_even_patterns_of_missing_slices_show_by_what_is_told(tmp_path, kept, elements):
    for k in kept:
        save(make_slice((0, 0, k), k, **elements), tmp_path / str(k))
    with pytest.raises(AmbiguousVolumeError, match="missing slice"):
        read(tmp_path)


def test_thin_slices_far_apart_are_told(tmp_path):
    volume = read(save_stack(tmp_path, axial(5, 10.0), SliceThickness="1"))
    assert "slices 1.000 mm thick at distances from 10.000 mm" in told(volume)["W-SLICES-DOUBTFUL"]


@pytest.mark.parametrize("pointed", [True, False])
def test_vectors_count_with_or_without_a_pointer(tmp_path, pointed):
    dataset, values = nuclear({"TimeSlotVector": [1, 1, 1, 2, 2, 2], "SliceVector": [3, 1, 2] * 2}, 6)
    if not pointed:
        del dataset.FrameIncrementPointer
    path = save(dataset, tmp_path / "a")
    np.testing.assert_array_equal(read(path, series="2").values, values[[4, 5, 3]])


@pytest.mark.parametrize("kind", ["TOMO", "STATIC", "DYNAMIC", "WHOLE BODY", "GATED TOMO", "GATED"])
def test_views_of_nuclear_medicine_are_no_slices(tmp_path, kind):
    dataset, _ = nuclear({}, 3)
    dataset.SOPClassUID = "1.2.840.10008.5.1.4.1.1.20"
    dataset.ImageType = ["ORIGINAL", "PRIMARY", kind, "EMISSION"]
    with pytest.raises(VolumeError, match=f"of the kind {kind}, views or times, no slices"):
        read(save(dataset, tmp_path / "a"))
    dataset.ImageType = ["ORIGINAL", "PRIMARY", "RECON TOMO", "EMISSION"]
    assert read(save(dataset, tmp_path / "a")).spacing == (2, 2, 4)


@pytest.mark.parametrize(
    ("pointer", "told"),
    [
        (0x00182003, "views from around"),
        (0x00181520, "views from around"),
        (0x00182002, "pages"),
        (0x00091234, "differ in element 00091234"),
    ],
)
def test_frames_that_differ_in_something_else_are_no_slices(tmp_path, pointer, told):
    dataset, _ = many_frames([0, 0, 0], **PLACED)
    dataset.FrameIncrementPointer = pointer
    with pytest.raises(VolumeError, match=told):
        read(save(dataset, tmp_path / "a"))


def test_slice_locations_of_frames_are_used(tmp_path):
    dataset, values = many_frames([0, 0, 0], **PLACED)
    dataset.FrameIncrementPointer = 0x00182005
    dataset.SliceLocationVector = [10, 16, 13]
    volume = read(save(dataset, tmp_path / "a"))
    np.testing.assert_array_equal(volume.values, values[[0, 2, 1]])
    np.testing.assert_array_equal(volume.affine[:3, 2:], [[0, 5], [0, 6], [3, 7]])


@pytest.mark.parametrize("kind", [None, "3D"])
def test_a_part_of_a_larger_matrix_is_a_tile(tmp_path, kind):
    dataset, _ = enhanced([0, 2, 4], TotalPixelMatrixColumns=500, DimensionOrganizationType=kind)
    with pytest.raises(VolumeError, match="tiles of a whole-slide image"):
        read(save(dataset, tmp_path / "a"))


def test_a_mosaic_of_another_maker_is_no_slice(tmp_path):
    save_stack(tmp_path, axial(), ImageType=["ORIGINAL", "PRIMARY", "M", "MOSAIC"])
    with pytest.raises(VolumeError, match="a mosaic of many slices"):
        read(tmp_path)


def test_low_values_that_are_white_are_told(tmp_path):
    volume = read(save_stack(tmp_path, axial(), PhotometricInterpretation="MONOCHROME1"))
    assert "MONOCHROME1" in told(volume)["W-PHOTOMETRIC"]


@pytest.mark.parametrize(
    ("stated", "is_told"),
    [("2", False), ("-2", False), ("2.05", False), ("5", True), ("1.3", True), ("0", False)],
)
def test_a_stated_distance_that_is_none_is_told(tmp_path, stated, is_told):
    volume = read(save_stack(tmp_path, axial(), SpacingBetweenSlices=stated, SliceThickness="2"))
    assert volume.spacing[2] == 2
    assert ("W-GEOMETRY-CONTRADICTED" in told(volume)) == is_told


def test_a_tilt_beyond_any_gantry_is_told(tmp_path):
    positions = [(0, 3.0 * k, 2.0 * k) for k in range(4)]
    volume = read(save_stack(tmp_path / "a", positions))
    assert "56 degrees beside their normal" in told(volume)["W-GEOMETRY-CONTRADICTED"]
    assert told(read(save_stack(tmp_path / "b", [(0, k, 2.0 * k) for k in range(4)]))) == {}


def test_pixels_of_another_shape_are_told(tmp_path):
    volume = read(save_stack(tmp_path, axial(), PixelAspectRatio=["1", "1"]))
    assert "PixelAspectRatio 1:1" in told(volume)["W-GEOMETRY-CONTRADICTED"]
    assert told(read(save_stack(tmp_path, axial(), PixelAspectRatio=["2", "3"]))) == {}


def test_slices_of_several_frames_of_reference_are_told(tmp_path):
    for k, position in enumerate(axial()):
        save(make_slice(position, k, FrameOfReferenceUID=f"1.2.{k // 2}"), tmp_path / str(k))
    assert "2 frames of reference" in told(read(tmp_path))["W-GEOMETRY-CONTRADICTED"]
