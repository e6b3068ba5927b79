import os
import re
import warnings
import zipfile

import numpy as np
import pydicom
import pytest
from pydicom import uid

from dmc_cli.errors import (
    AmbiguousVolumeError,
    DamagedVolumeError,
    SettingsError,
    UnsupportedFormatError,
    VolumeError,
)
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.reading import read, world

STACK = np.array([plane_values(k) for k in range(4)])


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


def test_other_files_in_the_folder_are_passed_over(tmp_path):
    save_stack(tmp_path, axial())
    (tmp_path / "notes.txt").write_text("nothing of the kind")
    (tmp_path / "empty").touch()
    (tmp_path / "broken").write_bytes(b"\x08\x00\x05\x00CS\x0a\x00ISO")
    save(make_slice((0, 0, 0), 0, PixelData=b"", Rows=None), tmp_path / "report")
    np.testing.assert_array_equal(read(tmp_path).values, STACK)


def test_files_in_subfolders_and_links_that_loop(tmp_path):
    save_stack(tmp_path / "a" / "b", axial())
    os.symlink(tmp_path, tmp_path / "a" / "loop")
    os.symlink(tmp_path / "a" / "b", tmp_path / "again")
    np.testing.assert_array_equal(read(tmp_path).values, STACK)


@pytest.mark.parametrize("dtype", ["u1", "i1", "<u2", "<i2", "<u4", "<i4"])
def test_signed_and_unsigned_of_every_size(tmp_path, dtype):
    planes = [(plane_values(k, "<i8") - 200).astype(dtype) for k in range(4)]
    for k, position in enumerate(axial()):
        save(make_slice(position, k, values=planes[k]), tmp_path / f"{k}")
    volume = read(tmp_path)
    assert volume.values.dtype == np.dtype(dtype)
    np.testing.assert_array_equal(volume.values, planes)


@pytest.mark.parametrize("signed", [0, 1])
def test_bits_above_bits_stored_do_not_count(tmp_path, signed):
    for k, position in enumerate(axial()):
        values = plane_values(k, "<u2") - np.uint16(signed * 300)
        junk = (values & 0x0FFF) | 0xA000
        elements = {"BitsStored": 12, "HighBit": 11, "PixelRepresentation": signed}
        save(make_slice(position, k, values=junk, **elements), tmp_path / f"{k}")
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values.astype(int), STACK.astype(int) - signed * 300)


@pytest.mark.parametrize("signed", [0, 1])
@pytest.mark.parametrize("syntax", [uid.ExplicitVRLittleEndian, uid.ExplicitVRBigEndian, uid.RLELossless])
def test_bits_below_the_stored_ones_do_not_count(tmp_path, signed, syntax):
    for k, position in enumerate(axial()):
        values = plane_values(k, "<i2") - signed * 300
        left = (values << 4 | 5).astype(">i2" if syntax == uid.ExplicitVRBigEndian else "<i2")
        elements = {"BitsStored": 12, "HighBit": 15, "PixelRepresentation": signed}
        if syntax == uid.RLELossless:
            dataset = make_slice(position, k, values=left, **elements)
            dataset.compress(syntax)
        else:
            dataset = make_slice(position, k, values=left, syntax=syntax, **elements)
        save(dataset, tmp_path / f"{k}")
    np.testing.assert_array_equal(read(tmp_path).values.astype(int), STACK.astype(int) - signed * 300)


@pytest.mark.parametrize("high", [3, 40, None])
def test_a_high_bit_that_cannot_be_is_passed_over(tmp_path, high):
    volume = read(save_stack(tmp_path, axial(), BitsStored=12, HighBit=high))
    np.testing.assert_array_equal(volume.values, STACK)


@pytest.mark.parametrize("told", [17, 40, 0, None])
def test_bits_stored_that_cannot_be_are_those_of_a_pixel(tmp_path, told):
    values = plane_values(0, "<u2") | np.uint16(0x8001)
    volume = read(save_stack(tmp_path, axial(), values=values, BitsStored=told, HighBit=None))
    np.testing.assert_array_equal(volume.values, [values] * 4)


@pytest.mark.parametrize(("high", "below"), [(0, 0), (1, 1), (15, 15), (16, 0), (None, 0)])
def test_one_stored_bit_is_where_the_high_bit_says(tmp_path, high, below):
    values = plane_values(0, "<u2") * np.uint16(0x0A5B)
    volume = read(save_stack(tmp_path, axial(), values=values, BitsStored=1, HighBit=high))
    np.testing.assert_array_equal(volume.values, [values >> below & 1] * 4)


def test_slices_with_and_without_a_sign_are_one_volume(tmp_path):
    for k, position in enumerate(axial()):
        values = plane_values(k, "<i2" if k % 2 else "<u2")
        save(make_slice(position, k, values=values, RescaleIntercept="0"), tmp_path / f"{k}")
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, STACK)
    assert (volume.slope, volume.intercept, volume.sentences) == (1, 0, ())


def test_signed_and_unsigned_copies_are_stacks_to_choose_from(tmp_path):
    for k, position in enumerate(axial()):
        for dtype in ("<i2", "<u2"):
            save(make_slice(position, k, values=plane_values(k, dtype)), tmp_path / f"{k}{dtype[1]}")
    with pytest.raises(AmbiguousVolumeError, match=r"(?s)value type int16.*value type uint16"):
        read(tmp_path)
    assert read(tmp_path, series="2").values.dtype == np.uint16


def test_signed_and_unsigned_slices_of_one_stack_become_physical_values(tmp_path):
    planes = [plane_values(k, dtype) for k, dtype in enumerate(("<i2", "<u2", "<i2", "<u2"))]
    for k, position in enumerate(axial()):
        save(make_slice(position, k, values=planes[k]), tmp_path / f"{k}")
    volume = read(tmp_path)
    assert volume.values.dtype == np.float32
    np.testing.assert_array_equal(volume.values, np.array(planes) - 1024.0)


def test_monochrome1_does_not_change_the_values(tmp_path):
    save_stack(tmp_path, axial(), PhotometricInterpretation="MONOCHROME1")
    np.testing.assert_array_equal(read(tmp_path).values, STACK)


def test_padding_is_a_range_of_stored_values(tmp_path):
    volume = read(save_stack(tmp_path / "one", axial(), PixelPaddingValue=-2000))
    assert volume.padding == (-2000, -2000)
    volume = read(
        save_stack(tmp_path / "two", axial(), PixelPaddingValue=-2000, PixelPaddingRangeLimit=-1900)
    )
    assert volume.padding == (-2000, -1900)


def test_rescale_that_differs_between_slices_gives_float32(tmp_path):
    for k, position in enumerate(axial()):
        elements = {"RescaleSlope": str(1 + k), "RescaleIntercept": str(-k), "PixelPaddingValue": 3}
        save(make_slice(position, k, **elements), tmp_path / f"{k}")
    volume = read(tmp_path)
    expected = np.array([plane_values(k) * (1.0 + k) - k for k in range(4)])
    expected[STACK == 3] = np.nan
    assert (volume.values.dtype, volume.slope, volume.intercept) == (np.float32, 1, 0)
    np.testing.assert_array_equal(volume.values, expected)


@pytest.mark.parametrize(
    "syntax",
    [
        uid.ImplicitVRLittleEndian,
        uid.ExplicitVRLittleEndian,
        uid.ExplicitVRBigEndian,
        uid.DeflatedExplicitVRLittleEndian,
    ],
)
def test_uncompressed_transfer_syntaxes(tmp_path, syntax):
    for k, position in enumerate(axial()):
        values = plane_values(k, ">i2" if syntax == uid.ExplicitVRBigEndian else "<i2")
        save(make_slice(position, k, values=values, syntax=syntax, PixelPaddingValue=-7), tmp_path / f"{k}")
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, STACK)
    assert volume.values.dtype == np.int16
    assert volume.padding == (-7, -7)


def test_files_without_preamble(tmp_path):
    for k, position in enumerate(axial()):
        for syntax in (uid.ImplicitVRLittleEndian, uid.ExplicitVRLittleEndian):
            dataset = make_slice(position, k, syntax=syntax)
            del dataset.file_meta
            path = tmp_path / syntax / f"{k}"
            path.parent.mkdir(exist_ok=True)
            pydicom.dcmwrite(
                path, dataset, implicit_vr=syntax == uid.ImplicitVRLittleEndian, little_endian=True
            )
    for folder in tmp_path.iterdir():
        np.testing.assert_array_equal(read(folder).values, STACK)


def two_series(folder):
    save_stack(folder / "one", axial(), series="1.2.7")
    save_stack(folder / "two", axial(5, 3), series="1.2.9")
    return folder


def test_two_series_are_listed_with_the_option_that_chooses(tmp_path):
    with pytest.raises(
        AmbiguousVolumeError, match=r"(?s)2 series.*--series N:\n  --series 1: CT.*--series 2.*1\.2\.9"
    ) as caught:
        read(two_series(tmp_path))
    assert caught.value.exit_status == 4
    first, second = list_volumes(str(tmp_path), ReadSettings())
    assert (first.number, first.uid, first.modality, first.size) == (1, "1.2.7", "CT", (5, 4, 4))
    assert (second.number, second.description, second.slices) == (2, "series 1.2.9", 5)


def test_a_series_is_chosen_by_number_or_uid(tmp_path):
    two_series(tmp_path)
    assert read(tmp_path, series="2").shape == read(tmp_path, series="1.2.9").shape == (5, 4, 5)
    assert read(tmp_path, series="1").shape == (5, 4, 4)
    with pytest.raises(SettingsError, match=r"(?s)series is '3'.*--series 1"):
        read(tmp_path, series="3")


def test_single_images_and_localizers_are_dropped(tmp_path):
    save_stack(tmp_path / "ct", axial())
    save(make_slice((0, 0, 0), 0, orientation=(0, 1, 0, 0, 0, -1)), tmp_path / "scout")
    save_stack(tmp_path / "loc", axial(3, 50), series="1.2.1", ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
    np.testing.assert_array_equal(read(tmp_path).values, STACK)


def test_orientations_of_one_series_are_stacks_to_choose_from(tmp_path):
    save_stack(tmp_path / "axial", axial())
    sagittal = [(30.0 + k, 0, 0) for k in range(3)]
    save_stack(tmp_path / "sagittal", sagittal, orientation=(0, 1, 0, 0, 0, -1))
    with pytest.raises(AmbiguousVolumeError, match="2 series"):
        read(tmp_path)
    assert {read(tmp_path, series=n).shape[2] for n in "12"} == {3, 4}


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


@pytest.mark.parametrize("packing", [zipfile.ZIP_DEFLATED, zipfile.ZIP_STORED, zipfile.ZIP_BZIP2])
def test_a_zip_is_read_without_unpacking(tmp_path, packing):
    save_stack(tmp_path / "in", axial())
    with zipfile.ZipFile(tmp_path / "scan.zip", "w", packing) as archive:
        for path in (tmp_path / "in").iterdir():
            archive.write(path, f"scan/{path.name}")
        archive.writestr("readme.txt", "nothing")
    volume = read(tmp_path / "scan.zip")
    np.testing.assert_array_equal(volume.values, STACK)
    assert volume.files == (tmp_path / "scan.zip",)


def test_a_zip_entry_that_claims_too_much_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a", b"tiny")
    content = (tmp_path / "bomb.zip").read_bytes()
    claim = (4).to_bytes(4, "little")
    (tmp_path / "bomb.zip").write_bytes(content.replace(claim + b"\x01\0", b"\xff\xff\xff\x7f" + b"\x01\0"))
    with pytest.raises(VolumeError) as caught:
        read(tmp_path / "bomb.zip")
    assert caught.value.exit_status == 3


def test_a_dicomdir_stands_for_its_folder(tmp_path):
    save_stack(tmp_path / "IMAGES", axial())
    (tmp_path / "DICOMDIR").write_bytes(bytes(128) + b"DICM")
    np.testing.assert_array_equal(read(tmp_path / "DICOMDIR").values, STACK)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda folder: None, "no DICOM image found"),
        (lambda folder: (folder / "notes").write_text("x" * 200), "no DICOM image found"),
        (lambda folder: save(make_slice((0, 0, 0), 0), folder / "a"), "no two slices of one volume"),
        (
            lambda folder: save(make_slice((0, 0, 0), 0, ImagePositionPatient=None), folder / "a"),
            "no position",
        ),
        (lambda folder: save_stack(folder, axial(), SamplesPerPixel=3), "colour"),
        (lambda folder: save_stack(folder, axial(), PixelSpacing=[0, 0]), "positive lengths"),
        (lambda folder: save_stack(folder, axial(), orientation=(1, 0, 0, 1, 0, 0)), "perpendicular"),
        (lambda folder: save_stack(folder, axial(), orientation=(1, 0, 0, 0, 1)), "6 finite numbers"),
    ],
)
def test_folders_without_a_volume_tell_what_they_hold(tmp_path, make, told):
    make(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(VolumeError, match=told) as caught:
            read(tmp_path)
    assert caught.value.exit_status == 3


@pytest.mark.parametrize("lost", [1, 30])
def test_a_truncated_slice_is_refused(tmp_path, lost):
    save_stack(tmp_path, axial(), names="abcd")
    content = (tmp_path / "c").read_bytes()
    (tmp_path / "c").write_bytes(content[:-lost])
    with pytest.raises(DamagedVolumeError, match=r"c: .*bytes of pixel data found"):
        read(tmp_path)


def test_an_absurd_size_is_not_trusted(tmp_path):
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k)
        dataset.compress(uid.RLELossless)
        dataset.Rows = dataset.Columns = 65535
        save(dataset, tmp_path / f"{k}")
    with pytest.raises(DamagedVolumeError, match="header is damaged"):
        read(tmp_path)


@pytest.mark.parametrize("kept", [200, 400])
def test_a_missing_slice_whose_file_is_cut_short_is_told_with_it(tmp_path, kept):
    for k, position in enumerate(axial(6)):
        path = save(make_slice(position, k), tmp_path / f"IM{k}")
        if k == 3:
            path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(AmbiguousVolumeError, match=r"missing slice found.*; 1 file\(s\) left out: IM3: "):
        read(tmp_path)
