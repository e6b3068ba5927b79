"""Stacks of pages and of files, and what is refused."""

import sys
from importlib.util import find_spec

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.volume_io.tiff import reader as tiff, stack
from tests.volume_io.reading import counting, read

tifffile = pytest.importorskip("tifffile")

VALUES = counting((6, 16, 20), "<u2")


@pytest.mark.parametrize("options", [{}, {"compression": "zlib"}, {"bigtiff": True}, {"byteorder": ">"}])
@pytest.mark.parametrize("dtype", ["u1", "u2", "i2", "f4"])
def test_pages_are_slices(tmp_path, options, dtype):
    values = VALUES.astype(dtype)
    tifffile.imwrite(tmp_path / "a.tif", values, photometric="minisblack", **options)
    volume = read(tmp_path / "a.tif", spacing=(1, 2, 3))
    np.testing.assert_array_equal(volume.values, values)
    assert volume.values.dtype == np.dtype(dtype)
    assert volume.spacing == (1, 2, 3)
    assert volume.space == "none"


def test_without_spacing_there_is_a_warning(tmp_path):
    tifffile.imwrite(tmp_path / "a.tif", VALUES, photometric="minisblack")
    assert "--spacing" in read(tmp_path / "a.tif").sentences[0]


def test_a_folder_of_slices_in_the_order_of_their_numbers(tmp_path):
    for k, plane in enumerate(VALUES):
        tifffile.imwrite(tmp_path / f"s{k + 7}.tif", plane)
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert volume.files[3].name == "s10.tif"


def test_several_volumes_are_chosen_by_index(tmp_path):
    values = counting((2, 6, 16, 20), "<u2")
    tifffile.imwrite(tmp_path / "a.tif", values, imagej=True, metadata={"axes": "TZYX", "spacing": 1})
    with pytest.raises(AmbiguousVolumeError, match="--volume-index"):
        read(tmp_path / "a.tif")
    np.testing.assert_array_equal(read(tmp_path / "a.tif", volume_index=1).values, values[1])


def test_single_and_colour_images_are_refused(tmp_path):
    tifffile.imwrite(tmp_path / "one.tif", VALUES[0])
    tifffile.imwrite(tmp_path / "rgb.tif", np.zeros((16, 20, 3), "u1"), photometric="rgb")
    for name in ("one.tif", "rgb.tif"):
        with pytest.raises(UnsupportedFormatError, match="stack of grey slices"):
            read(tmp_path / name)


@pytest.mark.parametrize("kept", [4, 100, 3000])
def test_truncated_files_are_refused(tmp_path, kept):
    tifffile.imwrite(tmp_path / "a.tif", VALUES, photometric="minisblack", compression="zlib")
    (tmp_path / "a.tif").write_bytes((tmp_path / "a.tif").read_bytes()[:kept])
    with pytest.raises(VolumeError) as caught:
        read(tmp_path / "a.tif")
    assert caught.value.exit_status == 3


def test_slices_of_different_sizes_are_refused(tmp_path):
    for k in range(3):
        tifffile.imwrite(tmp_path / f"{k}.tif", VALUES[k][: 16 - k])
    with pytest.raises(DamagedVolumeError, match=r"1\.tif: .*as in 0\.tif"):
        read(tmp_path)


def test_what_reads_tiffs_may_be_missing(tmp_path, monkeypatch):
    tifffile.imwrite(tmp_path / "a.tif", VALUES, photometric="minisblack")
    monkeypatch.setitem(sys.modules, "tifffile", None)
    with pytest.raises(
        UnsupportedFormatError, match=r"a TIFF file found, but tifffile is not installed; pip in"
    ):
        read(tmp_path / "a.tif")


def test_a_folder_without_slices_is_told(tmp_path):
    (tmp_path / "notes.txt").write_text("no slice")
    with pytest.raises(VolumeError, match="no TIFF file found; expected a stack of slices; check the path"):
        read(tmp_path, input_format="tiff")


def test_slices_are_in_the_order_of_all_their_numbers(tmp_path):
    names = ["a.tif", "s2_b10.TIFF", "s2_b9.tif", "s10_b1.tif", "S1.tif"]
    for k, name in enumerate(names):
        tifffile.imwrite(tmp_path / name, VALUES[k])
    files = read(tmp_path).files
    assert [file.name for file in files] == ["S1.tif", "a.tif", "s2_b9.tif", "s2_b10.TIFF", "s10_b1.tif"]


@pytest.mark.parametrize("pages", ["in one file", "a file each"])
def test_what_no_compression_can_hold_is_refused(tmp_path, pages, monkeypatch):
    shape = (3, 64, 64) if pages == "in one file" else (64, 64)
    names = ["a.tif"] if pages == "in one file" else ["a.tif", "b.tif", "c.tif"]
    for name in names:
        tifffile.imwrite(tmp_path / name, np.zeros(shape, "u1"), photometric="minisblack", compression="zlib")
    path = tmp_path / "a.tif" if len(names) == 1 else tmp_path
    size = sum((tmp_path / name).stat().st_size for name in names)
    for ratio, taken in ((3 * 64 * 64 / size + 0.01, True), (3 * 64 * 64 / size - 0.01, False)):
        for module in (tiff, stack):
            monkeypatch.setattr(module, "LARGEST_RATIO", ratio)
        if taken:
            assert read(path).values.sum() == 0
            continue
        with pytest.raises(DamagedVolumeError, match=rf"{size} bytes found for "):
            read(path)


@pytest.mark.parametrize("stack", [True, False])
def test_pages_to_be_turned_for_display_are_told(tmp_path, stack):
    values = np.arange(3 * 4 * 5, dtype="u1").reshape(3, 4, 5)
    tag = [(274, "H", 1, 5, True)]
    if stack:
        tifffile.imwrite(tmp_path / "a.tif", values, extratags=tag, photometric="minisblack")
    else:
        for k, plane in enumerate(values):
            tifffile.imwrite(tmp_path / f"a{k}.tif", plane, extratags=tag)
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, values)
    assert "W-IMAGE-TURNED" in [notice.code for notice in volume.warnings]


@pytest.mark.parametrize("stack", [True, False])
def test_a_compression_that_needs_another_package_is_told(tmp_path, stack):
    """Not that the file is damaged, as if another copy helped."""
    if find_spec("imagecodecs"):
        pytest.skip("imagecodecs is installed")
    values = np.zeros((3, 40, 50), "u1")
    image = pytest.importorskip("PIL.Image")
    pages = [image.fromarray(plane) for plane in values]
    if stack:
        pages[0].save(tmp_path / "a.tif", save_all=True, append_images=pages[1:], compression="tiff_lzw")
    else:
        for k, page in enumerate(pages):
            page.save(tmp_path / f"a{k}.tif", compression="tiff_lzw")
    with pytest.raises(UnsupportedFormatError, match=r"compression LZW.*imagecodecs.*deflate"):
        read(tmp_path)
