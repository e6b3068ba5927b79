"""How slices are stored: types, bits, byte orders, syntaxes, rescale and padding."""

import numpy as np
import pydicom
import pytest
from pydicom import uid

from dmc_cli.errors import (
    AmbiguousVolumeError,
)
from tests.volume_io.dicom.scanner import STACK, axial, make_slice, plane_values, save, save_stack
from tests.volume_io.reading import read


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
