"""Files that claim, or unpack to, far more than they hold: refused within 2 s and 512 MiB."""

import bz2
import json
import struct
import zlib
from pathlib import Path

import numpy as np
import pydicom
import pytest
from pydicom import uid
from pydicom.encaps import encapsulate, generate_frames

from dmc_cli.errors import DamagedVolumeError
from tests.fuzz.trial import try_file
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save
from tests.volume_io.reading import read

HUGE = 3 << 30
"""Bytes that a bomb unpacks to."""


def deflated(begin=b""):
    """A raw deflate stream that begins honestly and goes on with zeros: gigabytes in megabytes."""
    packer = zlib.compressobj(9, wbits=-15)
    start = packer.compress(begin) + packer.flush(zlib.Z_FULL_FLUSH)
    # what follows a full flush stands for itself and can be repeated
    zeros = packer.compress(bytes(1 << 24)) + packer.flush(zlib.Z_FULL_FLUSH)
    return start + zeros * (HUGE >> 24) + b"\x03\0"


ZLIB_BOMB = b"\x78\xda" + deflated() + bytes(4)
GZIP_BOMB = b"\x1f\x8b\x08" + bytes(7) + deflated() + bytes(8)


def refused(path, reader):
    return try_file(Path(path), reader) == "DamagedVolumeError"


@pytest.mark.parametrize("place", ["private element", "pixel data", "behind"])
def test_deflated_dicom(tmp_path, place):
    for k, position in enumerate(axial(3)):
        path = save(make_slice(position, k, syntax=uid.DeflatedExplicitVRLittleEndian), tmp_path / f"{k}")
        content = path.read_bytes()
        begin = 144 + int.from_bytes(content[140:144], "little")
        dataset = zlib.decompress(content[begin:], -15)
        pixels = dataset.index(b"\xe0\x7f\x10\x00")
        start = {
            "private element": dataset[:pixels] + b"\x55\x70\x10\x00OB\0\0" + struct.pack("<I", HUGE),
            "pixel data": dataset[: pixels + 8] + struct.pack("<I", HUGE),
            "behind": dataset + b"\xfc\xff\xfc\xffOB\0\0" + struct.pack("<I", HUGE),
        }[place]
        path.write_bytes(content[:begin] + deflated(start))
    outcome = try_file(path, "dicom")
    # pixel data that are longer than any frames of the header are damage, too
    assert outcome == ("read" if place == "behind" else "DamagedVolumeError")


def test_deflated_dicom_whose_syntax_is_hidden_from_a_quick_look(tmp_path):
    """The file's meta elements in implicit form, which pydicom guesses."""
    for k in range(3):
        meta = b"".join(
            struct.pack("<HHI", 2, element, len(value)) + value
            for element, value in ((0x10, b"1.2.840.10008.1.2.1.99"), (0x102, b"x" * 70_000))
        )
        bomb = deflated()
        (tmp_path / f"{k}").write_bytes(bytes(128) + b"DICM" + meta + bomb)
    assert try_file(tmp_path / "0", "dicom") in ("DamagedVolumeError", "VolumeError")


def compressed_slices(folder, syntax):
    for k, position in enumerate(axial(3)):
        dataset = make_slice(position, k, values=plane_values(k, "<u2", (64, 64)))
        dataset.compress(syntax)
        yield save(dataset, folder / f"{k}")


@pytest.mark.parametrize(("columns", "rows"), [(40_000, 40_000), (64, 50_000_000), (2**31, 2**31), (32, 32)])
def test_a_jpeg_2000_stream_that_disagrees_with_its_header(tmp_path, columns, rows):
    pytest.importorskip("openjpeg")
    for path in compressed_slices(tmp_path, uid.JPEG2000Lossless):
        content = bytearray(path.read_bytes())
        size = content.index(b"\xff\x4f\xff\x51") + 8
        struct.pack_into(">II", content, size, columns, rows)
        struct.pack_into(">II", content, size + 16, columns, rows)  # one tile
        path.write_bytes(content)
    assert refused(path, "dicom")


@pytest.mark.parametrize(("columns", "rows"), [(65_000, 65_000), (64, 65_000), (32, 32)])
def test_a_jpeg_ls_stream_that_disagrees_with_its_header(tmp_path, columns, rows):
    pytest.importorskip("jpeg_ls")
    for path in compressed_slices(tmp_path, uid.JPEGLSLossless):
        content = bytearray(path.read_bytes())
        struct.pack_into(">HH", content, content.index(b"\xff\xf7") + 5, rows, columns)
        path.write_bytes(content)
    assert refused(path, "dicom")


@pytest.mark.parametrize("kept", [57, 400])
def test_a_jpeg_ls_stream_that_was_cut(tmp_path, kept):
    """Without an end marker the decoder may look for a bit of one for ten seconds."""
    pytest.importorskip("jpeg_ls")
    for path in compressed_slices(tmp_path, uid.JPEGLSLossless):
        dataset = pydicom.dcmread(path)
        stream = next(generate_frames(dataset.PixelData, number_of_frames=1))
        dataset.PixelData = encapsulate([stream[:kept]])
        save(dataset, path)
    assert refused(path, "dicom")


@pytest.mark.parametrize("pages", ["in one file", "a file each"])
def test_a_zlib_strip_of_a_tiff(tmp_path, pages):
    tifffile = pytest.importorskip("tifffile")
    path = tmp_path / "a.tif"
    shape = (3, 64, 64) if pages == "in one file" else (64, 64)
    for name in ("b.tif", "a.tif") if pages == "a file each" else ("a.tif",):
        tifffile.imwrite(tmp_path / name, np.zeros(shape, "u2"), compression="zlib", photometric="minisblack")
    with tifffile.TiffFile(path) as tiff:
        tags = tiff.pages[0].tags
        places = [tags[name].valueoffset for name in ("StripOffsets", "StripByteCounts")]
    content = bytearray(path.read_bytes())
    for place, number in zip(places, (len(content), len(ZLIB_BOMB)), strict=True):
        struct.pack_into("<I", content, place, number)
    path.write_bytes(content + ZLIB_BOMB)
    with pytest.raises(DamagedVolumeError, match="unpack to more than the"):
        read(path.parent if pages == "a file each" else path)
    assert refused(path, "tiff" if pages == "in one file" else "dicom")


STORE = {
    "zarr_format": 2,
    "shape": [6, 7, 8],
    "chunks": [6, 7, 8],
    "dtype": "<i2",
    "compressor": None,
    "fill_value": 0,
    "order": "C",
    "filters": None,
}


def store(folder, content, **changes):
    folder.mkdir()
    (folder / ".zarray").write_text(json.dumps(STORE | changes))
    (folder / "0.0.0").write_bytes(content)
    return folder / ".zarray"


def packed(name):
    """A chunk of gigabytes of zeros by one of Zarr's codecs."""
    import numcodecs

    if name in ("zlib", "gzip"):
        return ZLIB_BOMB if name == "zlib" else GZIP_BOMB
    if name == "bz2":
        return bz2.compress(bytes(1 << 26)) * (HUGE >> 26)
    return bytes(numcodecs.get_codec({"id": name}).encode(np.zeros(1 << 30, "u1")))


@pytest.mark.parametrize("codec", ["zlib", "gzip", "bz2", "zstd", "blosc", "lz4"])
def test_a_chunk_of_a_zarr_store(tmp_path, codec):
    pytest.importorskip("zarr", minversion="3")
    content = packed(codec)
    assert refused(store(tmp_path / "a.zarr", content, compressor={"id": codec}), "zarr")


@pytest.mark.parametrize(
    "changes",
    [
        {"shape": [3000, 1000, 1000]},
        {"chunks": [40_000, 1000, 1000]},
        {"shape": [1000, 1000, 1000], "chunks": [1000, 1000, 1000]},
        {"filters": [{"id": "pickle"}]},
        {"compressor": {"id": "pickle"}},
    ],
    ids=str,
)
def test_a_zarr_store_that_promises_too_much(tmp_path, changes):
    pytest.importorskip("zarr", minversion="3")
    assert refused(store(tmp_path / "a.zarr", bytes(672), **changes), "zarr")


def test_a_chunk_in_a_file_of_many_chunks(tmp_path):
    zarr = pytest.importorskip("zarr", minversion="3")
    google_crc32c = pytest.importorskip("google_crc32c")
    array = zarr.create_array(
        tmp_path / "a.zarr",
        shape=(6, 7, 8),
        shards=(6, 7, 8),
        chunks=(3, 7, 8),
        dtype="i2",
        compressors="auto",
    )
    array[...] = np.arange(6 * 7 * 8).reshape(6, 7, 8)
    (path,) = (file for file in (tmp_path / "a.zarr" / "c").rglob("*") if file.is_file())
    assert try_file(path, "zarr") == "read"
    content, bomb = path.read_bytes(), packed("zstd")
    table = struct.pack("<QQ", 0, len(bomb)) + content[-20:-4]
    path.write_bytes(bomb + table + struct.pack("<I", google_crc32c.value(table)))
    assert refused(path, "zarr")


def zip_of(entries):
    """A zip of deflated entries: name to raw stream and the bytes that it claims to unpack to."""
    body, directory = b"", b""
    for name, (stream, size) in entries.items():
        sizes = struct.pack("<LLL", 0, len(stream), size) + struct.pack("<HH", len(name), 0)
        fields = struct.pack("<HHHHH", 20, 0, 8, 0, 0) + sizes
        directory += (
            b"PK\1\2" + struct.pack("<H", 20) + fields + bytes(10) + struct.pack("<L", len(body)) + name
        )
        body += b"PK\3\4" + fields + name + stream
    end = struct.pack("<HHHHLLH", 0, 0, len(entries), len(entries), len(directory), len(body), 0)
    return body + directory + b"PK\5\6" + end


@pytest.mark.parametrize(
    "syntax", [uid.ExplicitVRLittleEndian, uid.RLELossless, uid.DeflatedExplicitVRLittleEndian]
)
def test_a_zip_whose_slices_go_on_with_zeros(tmp_path, syntax):
    entries = {}
    for k, position in enumerate(axial(3)):
        is_packed = syntax == uid.RLELossless
        dataset = make_slice(position, k, **({} if is_packed else {"syntax": syntax}))
        if is_packed:
            dataset.compress(syntax)
        content = save(dataset, tmp_path / f"{k}").read_bytes()
        entries[b"%d" % k] = (deflated(content), len(content) + HUGE)
    path = tmp_path / "a.zip"
    path.write_bytes(zip_of(entries))
    assert try_file(path, "zip") == "read"
