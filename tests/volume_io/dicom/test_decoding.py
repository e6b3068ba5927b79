"""Decoders of pixels are given what they take; of anything else an error says what was found."""

import re
import struct

import numpy as np
import pytest
from pydicom import uid
from pydicom.encaps import encapsulate, encapsulate_extended, generate_frames

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.volume_io.dicom import decoding as dicom_decoding, pixels as dicom_pixels
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save, save_stack
from tests.volume_io.reading import read

EXPLICIT = uid.ExplicitVRLittleEndian


@pytest.mark.parametrize(
    "syntax",
    ["1.2.840.10008.1.2.9", "1.2.840.10008.1.02", "1.2.840.10008.1.a", "1." + "2" * 70, "x", "1.2\x01"],
)
def test_a_syntax_of_no_image_is_told(tmp_path, syntax):
    told = syntax.encode() + b"\0" * (len(syntax) % 2)
    known = b"\x02\0\x10\0UI" + (20).to_bytes(2, "little") + EXPLICIT.encode() + b"\0"
    for k, position in enumerate(axial()):
        path = save(make_slice(position, k), tmp_path / f"{k}")
        content = path.read_bytes()
        assert content.count(known) == 1
        content = content.replace(known, known[:6] + len(told).to_bytes(2, "little") + told)
        group = 132 + 8
        size = int.from_bytes(content[group : group + 4], "little") + len(told) - 20
        path.write_bytes(content[:group] + size.to_bytes(4, "little") + content[group + 4 :])
    with pytest.raises(
        UnsupportedFormatError,
        match=re.escape(f"transfer syntax {syntax!r} found; expected that of an image"),
    ):
        read(tmp_path)


def test_pixels_that_are_not_there_are_told(tmp_path, monkeypatch):
    """The element behind the header is another one: for us, and for pydicom."""
    for k, position in enumerate(axial()):
        path = save(make_slice(position, k), tmp_path / f"{k}")
        content = path.read_bytes()
        place = content.rindex(b"\xe0\x7f\x10\0OW")
        path.write_bytes(content[:place] + b"\xe1\x7f" + content[place + 2 :])
    with pytest.raises(DamagedVolumeError, match="no pixel data found where they should begin"):
        read(tmp_path)
    monkeypatch.setattr(dicom_pixels.sys, "byteorder", "big")
    with pytest.raises(DamagedVolumeError, match="the file ends before its pixel data are complete"):
        read(tmp_path)


def compressed(shape):
    dataset = make_slice((0, 0, 0), 0, values=plane_values(0, "<u2", shape))
    dataset.compress(uid.JPEG2000Lossless)
    return next(generate_frames(dataset.PixelData, number_of_frames=1))


@pytest.mark.parametrize("hidden", [False, True])
def test_frames_with_a_table_of_their_places(tmp_path, hidden):
    """What is decoded is looked at: not what stands in the frame's place, but where the table says it is."""
    pytest.importorskip("openjpeg")
    values = np.array([plane_values(k, "<u2", (64, 64)) for k in range(3)])
    dataset = make_slice((0, 0, 0), 0, values=values[0], NumberOfFrames=3, ImagePositionPatient=None)
    dataset.PixelData = values.tobytes()
    dataset.compress(uid.JPEG2000Lossless)
    frames = list(generate_frames(dataset.PixelData, number_of_frames=3))
    content, offsets, lengths = encapsulate_extended(frames)
    if hidden:
        other = compressed((128, 128))
        offsets = offsets[:-8] + struct.pack("<Q", len(encapsulate(frames, has_bot=False)) - 8)
        lengths = lengths[:-8] + struct.pack("<Q", len(other))
        content = encapsulate([*frames, other], has_bot=False)
    dataset.PixelData, dataset.ExtendedOffsetTable = content, offsets
    dataset.ExtendedOffsetTableLengths = lengths
    path = save(dataset, tmp_path / "a.dcm")
    if not hidden:
        np.testing.assert_array_equal(read(path).values, values)
        return
    with pytest.raises(DamagedVolumeError, match="a compressed image of 128 x 128 pixels of 1"):
        read(path)


@pytest.mark.parametrize("fragments", [4096 * 2 - 1, 4096 * 2, 4096 * 2 + 1])
def test_a_frame_has_so_many_fragments_at_most(fragments):
    header = type("Header", (), {"file": type("File", (), {"name": "a"})})
    pixels = type("Pixels", (), {"frames": 1})
    content = (b"\xfe\xff\0\xe0" + (2).to_bytes(4, "little") + b"ab") * fragments
    if fragments <= 4096 * 2:
        dicom_decoding._check_fragments(content, header, pixels)
        return
    with pytest.raises(DamagedVolumeError, match=r"a: more than 8192 fragments found for 1 frame\(s\)"):
        dicom_decoding._check_fragments(content, header, pixels)


def test_an_image_of_another_size_than_its_header_says_is_told(tmp_path):
    pytest.importorskip("openjpeg")
    for k, position in enumerate(axial(3)):
        dataset = make_slice(position, k, values=plane_values(k, "<u2", (64, 96)))
        dataset.compress(uid.JPEG2000Lossless)
        dataset.Rows, dataset.Columns = 96, 64
        save(dataset, tmp_path / f"{k}")
    told = r"a compressed image of 96 x 64 pixels of 1 component\(s\) found; expected 64 x 96 pixels"
    with pytest.raises(DamagedVolumeError, match=told):
        read(tmp_path)


def test_a_missing_decoder_names_its_package(tmp_path, monkeypatch):
    save_stack(tmp_path, axial())
    monkeypatch.setattr(dicom_pixels.sys, "byteorder", "big")
    monkeypatch.setattr("pydicom.pixels.decoders.base.Decoder.is_available", False)
    with pytest.raises(
        UnsupportedFormatError, match=r"but no package here decodes it; pip install \"dmc-cli"
    ):
        read(tmp_path)
