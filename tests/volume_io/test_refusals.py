"""Every refusal of a header but NRRD's, by a file made for it, beside the nearest file that is taken."""

import struct
import zipfile

import nibabel as nib
import numpy as np
import pytest

from dmc_cli.errors import (
    AmbiguousVolumeError,
    DamagedVolumeError,
    MemoryBudgetError,
    SettingsError,
    UnsupportedFormatError,
    VolumeError,
)
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import allocation
from dmc_cli.volume_io.dicom.decoding import _behind_pixels
from dmc_cli.volume_io.left_out import left_out, shortened
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.reading import counting, read

VALUES = counting((4, 3, 2))


def meta(folder, *lines, content=None, **fields):
    known = {
        "NDims": "3",
        "DimSize": "2 3 4",
        "ElementType": "MET_SHORT",
        **fields,
        "ElementDataFile": "LOCAL",
    }
    if "ElementDataFile" in fields:
        known["ElementDataFile"] = fields["ElementDataFile"]
    text = "".join(f"{key} = {value}\n" for key, value in known.items() if value is not None)
    (folder / "a.mha").write_bytes(text.encode() + (VALUES.tobytes() if content is None else content))
    return folder / "a.mha"


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"NDims": None}, "no MetaImage header found"),
        ({"DimSize": None}, "has no DimSize"),
        ({"ElementType": None}, "has no ElementType"),
        ({"ElementType": "MET_OTHER"}, "ElementType 'MET_OTHER' found; expected one of MET_CHAR"),
        ({"NDims": "4"}, "NDims 4 found, but DimSize has 3"),
        ({"NDims": "11", "DimSize": "2 3 4" + " 1" * 8}, "NDims 11 found"),
        ({"DimSize": "2 3 x"}, "expected finite numbers"),
        ({"DimSize": "2 3 inf"}, "expected finite numbers"),
        ({"DimSize": ""}, "expected finite numbers"),
        ({"DimSize": "2 3 4.5"}, "DimSize = '2 3 4.5' found; expected whole numbers"),
        ({"NDims": "3.7"}, "NDims = '3.7' found; expected whole numbers"),
        ({"ElementNumberOfChannels": "1.5"}, "expected whole numbers"),
        ({"HeaderSize": "0.5"}, "expected whole numbers"),
        ({"NDims": "4", "DimSize": "2 3 4 0"}, "expected positive numbers"),
        ({"ElementNumberOfChannels": "0"}, "0 channels found"),
        ({"ElementNumberOfChannels": "1025"}, "1025 channels found"),
        ({"TransformMatrix": "1 0 0 1"}, "4, 0 and 0 numbers found"),
        ({"ElementSpacing": "1 1"}, "9, 2 and 0 numbers found"),
        ({"Offset": "1 1"}, "9, 0 and 2 numbers found"),
        ({"ElementDataFile": ""}, "empty ElementDataFile"),
        ({"ElementDataFile": "LIST 1"}, "expected a list of slices"),
        ({"ElementDataFile": "none.raw"}, "data file 'none.raw' is not there"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_meta_headers(tmp_path, fields, told):
    with pytest.raises(VolumeError) as caught:
        read(meta(tmp_path, content=b"", **fields))
    assert told in str(caught.value)
    assert caught.value.exit_status == 3


@pytest.mark.parametrize(
    "fields",
    [
        {"NDims": "10", "DimSize": "2 3 4" + " 1" * 7},
        {"ElementType": "MET_SHORT_ARRAY"},
        {"BinaryData": "True"},
        {"CompressedData": "False"},
        {"ElementNumberOfChannels": "1"},
        {"HeaderSize": "0"},
        {"NDims": "3.0", "DimSize": "2 3.0 4e0"},
        {"ElementDataFile": "local"},
        {"ElementDataFile": "LIST 2D\ns0\ns1\ns2\ns3"},
        {"ElementDataFile": "LIST 2\ns0\ns1\ns2\ns3"},
        {"ElementDataFile": "LIST\ns0\ns1\ns2\ns3"},
        {"ElementDataFile": "s%d 0 3 1"},
        {"HeaderSize": "-1", "ElementDataFile": "end.raw"},
        {"HeaderSize": "5", "ElementDataFile": "end.raw"},
    ],
    ids=lambda value: str(value)[:40],
)
def test_meta_headers_that_are_taken(tmp_path, fields):
    for k, plane in enumerate(VALUES):
        (tmp_path / f"s{k}").write_bytes(plane.tobytes())
    (tmp_path / "end.raw").write_bytes(bytes(5) + VALUES.tobytes())
    is_detached = fields.get("ElementDataFile", "local") != "local"
    path = meta(tmp_path, content=b"" if is_detached else None, **fields)
    np.testing.assert_array_equal(read(path).values, VALUES)


@pytest.mark.parametrize("count", [1, 1024])
def test_channels_as_many_as_there_may_be(tmp_path, count):
    many = np.repeat(VALUES[..., None], count, axis=-1) + np.arange(count, dtype="i2") * 24
    path = meta(tmp_path, content=many.tobytes(), ElementNumberOfChannels=count)
    np.testing.assert_array_equal(read(path, volume_index=count - 1).values, many[..., -1])
    told = {1: "1 volume; expected 0, or none", 1024: "1024 channels or volumes; expected 0 to 1023"}[count]
    for wrong in (-1, count):
        with pytest.raises(
            SettingsError,
            match=rf"volume_index is {wrong}; .*/a\.mha holds {told} ",
        ):
            read(path, volume_index=wrong)


def test_units_and_names_of_meta(tmp_path):
    volume = read(meta(tmp_path, DistanceUnits="um", ElementSize="1 2 3", Position="4 5 6"))
    np.testing.assert_allclose(np.diag(volume.affine)[:3], (1e-3, 2e-3, 3e-3))
    np.testing.assert_allclose(volume.affine[:3, 3], (4e-3, 5e-3, 6e-3))


@pytest.mark.parametrize(
    ("unit", "scale", "codes"),
    [
        ("um", 1e-3, []),
        ("CM", 10, []),
        ("micrometers", 1e-3, []),
        ("pixel", 1, ["W-UNIT-UNKNOWN"]),
        ("?", 1, ["W-UNIT-MISSING"]),
    ],
)
def test_units_of_meta(tmp_path, unit, scale, codes):
    path = meta(tmp_path, DistanceUnits=unit, ElementSpacing="1 2 4", Offset="4 5 6")
    volume = read(path)
    np.testing.assert_allclose(np.diag(volume.affine)[:3], np.array([1, 2, 4]) * scale)
    np.testing.assert_allclose(volume.affine[:3, 3], np.array([4, 5, 6]) * scale)
    assert [notice.code for notice in volume.warnings] == codes
    if codes:
        given = read(path, spacing=(0.5, 1, 2))  # half the numbers: the unit is half a millimetre
        np.testing.assert_allclose(np.diag(given.affine)[:3], (0.5, 1, 2))
        np.testing.assert_allclose(given.affine[:3, 3], (2, 2.5, 3))
        assert given.warnings == ()


def hdr(folder, code=4, dim=(3, 2, 3, 4, 1, 1, 1, 1), offset=0.0, slope=0.0, size=348):
    """Return an Analyze pair by hand."""
    header = bytearray(348)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, *dim)
    struct.pack_into("<hh", header, 70, code, 16)
    struct.pack_into("<8f", header, 76, 0, 1, 1, 1, 0, 0, 0, 0)
    struct.pack_into("<3f", header, 108, offset, slope, 7.0)
    (folder / "a.hdr").write_bytes(header[:size])
    (folder / "a.img").write_bytes(VALUES.tobytes())
    return folder / "a.hdr"


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"code": 32}, "datatype code 32 found"),
        ({"dim": (2, 2, 12, 1, 1, 1, 1, 1)}, "expected three or more positive numbers"),
        ({"dim": (8, 2, 3, 4, 1, 1, 1, 1)}, "expected three or more positive numbers"),
        ({"dim": (4, 2, 3, 4, 0, 1, 1, 1)}, "expected three or more positive numbers"),
        ({"offset": np.nan}, "vox_offset is nan"),
        ({"offset": 2.0**41}, "vox_offset is "),
        ({"size": 347}, "no Analyze header found"),
    ],
    ids=str,
)
def test_analyze_headers(tmp_path, changes, told):
    with pytest.raises(VolumeError, match=told):
        read(hdr(tmp_path, **changes), input_format="analyze")


@pytest.mark.parametrize(
    ("slope", "expected"), [(2.0, (2, 7)), (0.0, (1, 0)), (np.nan, (1, 0)), (np.inf, (1, 0))]
)
def test_analyze_scaling(tmp_path, slope, expected):
    volume = read(hdr(tmp_path, slope=slope))
    assert (volume.slope, volume.intercept) == expected


@pytest.mark.parametrize("dim", [(3, 2, 3, 4, 0, 0, 0, 0), (7, 2, 3, 4, 1, 1, 1, 1)])
def test_analyze_axes_that_are_taken(tmp_path, dim):
    assert read(hdr(tmp_path, dim=dim)).shape == (2, 3, 4)


@pytest.mark.parametrize(("dim", "taken"), [(0, False), (1, False), (7, True), (8, False)])
def test_nifti_axes(tmp_path, dim, taken):
    nib.save(nib.Nifti1Image(VALUES.T, np.eye(4)), tmp_path / "a.nii")
    content = bytearray((tmp_path / "a.nii").read_bytes())
    struct.pack_into("<h", content, 40, dim)
    (tmp_path / "a.nii").write_bytes(content)
    if taken:
        assert read(tmp_path / "a.nii").shape == (2, 3, 4)
        return
    with pytest.raises(
        VolumeError, match=r"axes found in the header; expected 1 to 7|at least two along each axis"
    ):
        read(tmp_path / "a.nii")


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_nifti_axes_have_nodes(tmp_path, axis):
    nib.save(nib.Nifti1Image(VALUES.T, np.eye(4)), tmp_path / "a.nii")
    content = bytearray((tmp_path / "a.nii").read_bytes())
    struct.pack_into("<h", content, 40, 4)
    struct.pack_into("<h", content, 40 + 2 * axis, 0)
    (tmp_path / "a.nii").write_bytes(content)
    with pytest.raises(DamagedVolumeError, match=r"axes of \[.*\] nodes found; expected positive numbers"):
        read(tmp_path / "a.nii")


@pytest.mark.parametrize(
    ("unit", "scale", "is_told"),
    [(0, 1, True), (1, 1000, True), (2, 1, False), (3, 1e-3, False), (4, 1, True), (10, 1, False)],
)
def test_nifti_units(tmp_path, unit, scale, is_told):
    nib.save(nib.Nifti1Image(VALUES.T, np.eye(4)), tmp_path / "a.nii")
    content = bytearray((tmp_path / "a.nii").read_bytes())
    content[123] = unit
    (tmp_path / "a.nii").write_bytes(content)
    volume = read(tmp_path / "a.nii")
    np.testing.assert_allclose(volume.spacing, [scale] * 3)
    assert bool(volume.sentences) == is_told
    given = read(tmp_path / "a.nii", spacing=(2, 3, 4))
    assert given.spacing == ((2, 3, 4) if is_told else volume.spacing)
    assert [notice.code for notice in given.warnings] == ["W-OPTION-UNUSED"] * (not is_told)


def test_npz_entries_are_named_where_one_is_to_be_chosen(tmp_path):
    np.savez(tmp_path / "a.npz", one=VALUES, flat=VALUES[0], two=VALUES + 1)
    with pytest.raises(AmbiguousVolumeError, match=r"2 volumes found \(0: one, 1: two\)"):
        read(tmp_path / "a.npz")
    np.testing.assert_array_equal(read(tmp_path / "a.npz", volume_index=1).values, VALUES + 1)
    (entry,) = list_volumes(str(tmp_path / "a.npz"), ReadSettings())
    assert entry.size == (2, 3, 4)


@pytest.mark.parametrize("packer", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_npz_entries_that_numpy_does_not_write(tmp_path, packer):
    np.save(tmp_path / "a.npy", VALUES)
    with zipfile.ZipFile(tmp_path / "a.npz", "w", packer) as archive:
        archive.write(tmp_path / "a.npy", "a.npy")
    with pytest.raises(UnsupportedFormatError, match=r"no numeric array with three axes.*savez"):
        read(tmp_path / "a.npz")


def test_an_npz_of_too_many_entries(tmp_path, monkeypatch):
    from dmc_cli.volume_io import numpy_file

    monkeypatch.setattr(numpy_file, "MAX_ENTRIES", 2)
    for count in (2, 3):
        np.savez(tmp_path / f"{count}.npz", VALUES, *([np.zeros(2)] * (count - 1)))
    assert read(tmp_path / "2.npz").shape == (2, 3, 4)
    with pytest.raises(DamagedVolumeError, match="3 entries found; expected at most 2"):
        read(tmp_path / "3.npz")


def no_slice(folder, **changes):
    for k, position in enumerate(axial()):
        save(make_slice(position, k, **changes), folder / f"{k}")
    return folder


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"SamplesPerPixel": 3}, "a colour image"),
        ({"PhotometricInterpretation": "PALETTE COLOR"}, "an image of kind PALETTE COLOR"),
        ({"BitsAllocated": 12}, "an image of 12 bits a pixel"),
        ({"ImagePositionPatient": None}, "no position or orientation"),
        ({"ImageOrientationPatient": None}, "no position or orientation"),
        ({"PixelSpacing": None}, "no pixel spacing"),
        ({"Rows": 0}, "no image"),
    ],
    ids=str,
)
def test_dicom_files_that_are_no_slices_tell_why(tmp_path, changes, told):
    with pytest.raises(VolumeError) as caught:
        read(no_slice(tmp_path, **changes))
    assert told in str(caught.value)


@pytest.mark.parametrize(
    "orientation", [(2, 0, 0, 0, 1, 0), (1, 0, 0, 0, 2, 0), (1, 0, 0, 0.5, 0.8660254, 0)]
)
def test_dicom_orientations_are_two_perpendicular_directions(tmp_path, orientation):
    with pytest.raises(DamagedVolumeError, match="expected two perpendicular directions"):
        read(no_slice(tmp_path, ImageOrientationPatient=list(orientation)))


@pytest.mark.parametrize("shift", [0.019, 0.021, 0.24, 0.26])
def test_slices_beside_the_line(tmp_path, shift):
    """Of pixels of 0.5 mm: told from a twentieth on, refused from a half."""
    positions = axial(5)
    positions[2] = (10.0 + shift, 20.0, 34.0)
    save_stack(tmp_path, positions, names="abcde")
    if shift > 0.25:
        with pytest.raises(UnsupportedFormatError, match=r"c lies 0\.260 mm beside the line"):
            read(tmp_path)
        return
    warnings = read(tmp_path).sentences
    assert [f"{shift:.3f} mm beside" in warning for warning in warnings] == [True] * (shift > 0.025)


def test_pixel_data_are_the_last_that_is_read():
    stop = _behind_pixels()
    assert [stop(tag, None, 0) for tag in (0x00280010, 0x7FE00010, 0xFFFCFFFC)] == [False, False, True]


def test_what_was_left_out_is_told_in_numbers():
    assert left_out([], "file", "files") == []
    assert left_out(["a"], "file", "files") == ["1 file was left out: a"]
    assert left_out(list("abcd"), "file", "files") == ["4 files were left out: a, b, c and 1 more"]
    assert shortened(list("abc"), "; ") == "a; b; c"


@pytest.mark.parametrize("free", [47, 48, None])
def test_values_that_do_not_fit_are_refused_before_they_are_allocated(monkeypatch, free):
    monkeypatch.setattr(allocation, "available_bytes", lambda: free)
    if free == 47:
        with pytest.raises(MemoryBudgetError, match=r"2 x 3 x 4 values of int16"):
            allocation.allocate_values("a", (2, 3, 4), ">i2")
        return
    made = allocation.allocate_values("a", (2, 3, 4), ">i2")
    assert (made.shape, made.dtype) == ((4, 3, 2), np.dtype("i2"))


@pytest.mark.parametrize("error", [MemoryError, ValueError])
def test_what_the_system_does_not_give_is_refused_too(monkeypatch, error):
    def empty(shape, dtype):
        raise error

    monkeypatch.setattr(allocation, "available_bytes", lambda: None)
    monkeypatch.setattr(allocation.np, "empty", empty)
    told = r"a: 3 MiB needed for 1024 x 512 x 3 values of int16; 0 MiB of memory are free"
    with pytest.raises(MemoryBudgetError, match=told):
        allocation.allocate_values("a", (1024, 512, 3), ">i2")


def test_a_forecast_is_asked_instead(monkeypatch):
    asked = []
    monkeypatch.setattr(allocation, "available_bytes", lambda: 0)
    with allocation.forecasting(lambda shape, size: asked.append((shape, size))):
        allocation.allocate_values("a", (2, 3, 4), "i2")
    assert asked == [((2, 3, 4), 48)]
    with pytest.raises(MemoryBudgetError):
        allocation.allocate_values("a", (2, 3, 4), "i2")


def test_raw_sizes_to_the_byte(tmp_path):
    settings = {"shape": (2, 3, 4), "dtype": "int16", "skip_bytes": 3}
    for size, taken in ((50, False), (51, True), (52, False)):
        (tmp_path / "a.raw").write_bytes(bytes(size))
        if taken:
            assert read(tmp_path / "a.raw", **settings).shape == (2, 3, 4)
            continue
        with pytest.raises(DamagedVolumeError, match=rf"{size} bytes found, 51 expected") as caught:
            read(tmp_path / "a.raw", **settings)
        assert ("--skip-bytes 4" in str(caught.value)) == (size == 52)


def test_an_encrypted_zip_is_to_be_unpacked(tmp_path):
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for k, position in enumerate(axial(3)):
            archive.write(save(make_slice(position, k), tmp_path / "in" / f"{k}"), f"{k}")
    content = bytearray(path.read_bytes())
    place = content.index(b"PK\1\2")
    content[place + 8] |= 1
    path.write_bytes(content)
    with pytest.raises(VolumeError, match="the zip is encrypted; unpack it"):
        read(path)


def test_slices_of_a_gray_and_a_colour_tiff(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    tifffile.imwrite(tmp_path / "0.tif", plane_values(0).astype("u1"))
    colours = np.zeros((4, 5, 3), "u1")
    colours[..., 0] = 255
    tifffile.imwrite(tmp_path / "1.tif", colours, photometric="rgb")
    with pytest.raises(UnsupportedFormatError, match=r"1\.tif has colours .*expected grey slices"):
        read(tmp_path)
