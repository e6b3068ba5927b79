"""Compressed transfer syntaxes: the pixels, and what is said where no package decodes them."""

import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so
from pydicom import uid
from pydicom.encaps import encapsulate

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save
from tests.volume_io.reading import physical, read

DATA = Path(__file__).parents[2] / "data"

COMPRESSED = {
    "RLE": (uid.RLELossless, None),
    "JPEG-LS": (uid.JPEGLSLossless, "jpeg_ls"),
    "JPEG 2000": (uid.JPEG2000Lossless, "openjpeg"),
}


@pytest.mark.parametrize("name", COMPRESSED)
@pytest.mark.parametrize("signed", [False, True])
def test_compressed_transfer_syntaxes(tmp_path, name, signed):
    syntax, module = COMPRESSED[name]
    if module:
        pytest.importorskip(module)
    planes = [plane_values(k, "<i2" if signed else "<u2", (64, 80)) - 200 * signed for k in range(4)]
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k, values=planes[k])
        dataset.compress(syntax)
        save(dataset, tmp_path / f"{k}")
    np.testing.assert_array_equal(read(tmp_path).values, planes)


@pytest.mark.parametrize("syntax", [uid.HTJ2KLossless, uid.HTJ2KLosslessRPCL, uid.HTJ2K])
def test_high_throughput_jpeg_2000(tmp_path, syntax):
    pytest.importorskip("openjpeg")
    row, column = np.indices((24, 32))
    plane = ((61 * row + 37 * column) % 4096).astype("<u2")
    codestream = (DATA / "ramp.htj2k").read_bytes()
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k, values=plane, BitsStored=12, HighBit=11)
        dataset.PixelData = encapsulate([codestream])
        dataset["PixelData"].VR = "OB"
        dataset.file_meta.TransferSyntaxUID = syntax
        save(dataset, tmp_path / f"{k}")
    np.testing.assert_array_equal(read(tmp_path).values, [plane] * 4)


PIP_LINES = {
    uid.HTJ2KLossless: "pylibjpeg pylibjpeg-openjpeg",
    uid.JPEG2000Lossless: "pylibjpeg pylibjpeg-openjpeg",
    uid.JPEGLSLossless: "pyjpegls",
    uid.JPEGLosslessSV1: "python-gdcm",
    uid.JPEGBaseline8Bit: "python-gdcm",
}


@pytest.mark.parametrize("syntax", PIP_LINES, ids=lambda syntax: syntax.keyword)
def test_each_syntax_names_the_package_that_decodes_it(tmp_path, monkeypatch, syntax):
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k)
        dataset.compress(uid.RLELossless)
        dataset.file_meta.TransferSyntaxUID = syntax
        save(dataset, tmp_path / f"{k}")
    decoder = SimpleNamespace(is_available=False, UID=syntax)
    monkeypatch.setattr("pydicom.pixels.get_decoder", lambda _: decoder)
    with pytest.raises(UnsupportedFormatError) as caught:
        read(tmp_path)
    assert str(caught.value).endswith(f'pip install "dmc-cli[dicom]" or pip install {PIP_LINES[syntax]}')


def test_of_many_slices_that_no_package_decodes_the_first_is_named(tmp_path, monkeypatch):
    for k, position in enumerate(axial(12)):
        dataset = make_slice(position, k)
        dataset.compress(uid.RLELossless)
        save(dataset, tmp_path / f"{chr(ord('z') - k)}")

    def decoder_of(_):
        # the first is the slowest to find out
        time.sleep(0.05 if not asked else 0)
        asked.append(1)
        return SimpleNamespace(is_available=False, UID=uid.RLELossless)

    asked = []
    monkeypatch.setattr("pydicom.pixels.get_decoder", decoder_of)
    with pytest.raises(UnsupportedFormatError, match=r"^z: "):
        read(tmp_path, threads=4)


def test_of_many_damaged_slices_the_first_is_named(tmp_path):
    for k, position in enumerate(axial(12)):
        dataset = make_slice(position, k, values=plane_values(k, "<u2", (512, 512)))
        dataset.compress(uid.RLELossless)
        path = save(dataset, tmp_path / f"{chr(ord('z') - k)}")
        if k > 2:
            path.write_bytes(path.read_bytes().replace(b"\xfe\xff\x00\xe0", b"\xfe\xff\x00\xe1"))
    with pytest.raises(DamagedVolumeError, match=r"^w: "):
        read(tmp_path, threads=4)


def test_lossless_jpeg(tmp_path):
    pytest.importorskip("gdcm")
    values = np.random.default_rng(0).integers(-900, 900, (4, 32, 32)).astype(np.int16)
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    writer.UseCompressionOn()
    writer.SetCompressor("JPEG")
    for k in range(4):
        plane = sitk.GetImageFromArray(values[k])
        plane.SetMetaData("0020|000e", "1.2.3")
        plane.SetMetaData("0028|0030", "1\\1")
        plane.SetMetaData("0020|0032", f"0\\0\\{2 * k}")
        plane.SetMetaData("0020|0037", "1\\0\\0\\0\\1\\0")
        writer.SetFileName(str(tmp_path / f"{k}.dcm"))
        writer.Execute(plane)
    np.testing.assert_array_equal(physical(read(tmp_path)), values)


def test_real_slices_are_the_same_in_two_compressed_syntaxes(shared_data):
    pytest.importorskip("openjpeg")
    folder = shared_data / "dicom_compressed_4slices"
    one, two = read(folder / "j2k"), read(folder / "rle")
    np.testing.assert_array_equal(one.values, two.values)
    np.testing.assert_array_equal(one.affine, two.affine)
    np.testing.assert_array_equal(one.affine, read(folder / "uncompressed").affine)


@pytest.mark.parametrize("name", ["RLE", "big_endian", "jpeg_2k_lossless", "jpeg_ls_lossless"])
def test_one_enhanced_file_in_every_syntax(shared_data, name):
    if "jpeg" in name:
        pytest.importorskip("openjpeg" if "2k" in name else "jpeg_ls")
    folder = shared_data / "dicom_emri_syntaxes"
    plain, other = read(folder / "emri_small.dcm"), read(folder / f"emri_small_{name}.dcm")
    np.testing.assert_array_equal(plain.values, pydicom.dcmread(folder / "emri_small.dcm").pixel_array)
    np.testing.assert_array_equal(other.values, plain.values)
    assert plain.space == "none"
    assert "no positions" in plain.sentences[0]


def test_a_truncated_enhanced_file_is_refused(shared_data):
    pytest.importorskip("openjpeg")
    with pytest.raises(DamagedVolumeError, match=r"cannot be decoded \(the file ends before its pixel data"):
        read(shared_data / "dicom_emri_syntaxes/emri_small_jpeg_2k_lossless_too_short.dcm")


@pytest.mark.parametrize("name", ["JPEG-LS", "JPEG 2000"])
def test_a_damaged_stream_is_told_by_the_error_alone(tmp_path, capfd, name):
    syntax, module = COMPRESSED[name]
    pytest.importorskip(module)
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k, values=plane_values(k, "<u2", (64, 80)))
        dataset.compress(syntax)
        path = save(dataset, tmp_path / f"{k}")
    content = path.read_bytes()
    path.write_bytes(
        content[:-40] + bytes(40) if name == "JPEG-LS" else content.replace(b"\xff\x52", b"\xff\x00")
    )
    with pytest.raises(DamagedVolumeError, match="cannot be decoded"):
        read(tmp_path)
    assert capfd.readouterr() == ("", "")
