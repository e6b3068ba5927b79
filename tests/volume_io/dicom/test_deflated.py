"""Deflated data sets: inflated while they are read, forwards and anew from the start."""

import io
import zlib

import numpy as np
import pytest
from pydicom import uid

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.dicom import deflated as dicom_deflated
from dmc_cli.volume_io.dicom.deflated import inflated_file
from dmc_cli.volume_io.dicom.effort import Effort
from dmc_cli.volume_io.dicom.source import DicomFile
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save
from tests.volume_io.reading import read

SYNTAX = uid.DeflatedExplicitVRLittleEndian
CONTENT = np.random.default_rng(0).integers(0, 9, 100_000, dtype="u1").tobytes()


@pytest.fixture
def file(tmp_path):
    packer = zlib.compressobj(9, wbits=-15)
    path = tmp_path / "a"
    path.write_bytes(b"begin" + packer.compress(CONTENT) + packer.flush())
    size = path.stat().st_size
    return inflated_file(DicomFile("a", path, size, Effort(size)), 5)


@pytest.mark.parametrize("piece", [1, 100, 1 << 20])
def test_a_stream_is_read_and_sought(file, monkeypatch, piece):
    monkeypatch.setattr(dicom_deflated, "CHUNK", max(piece, 64))
    with file.open() as stream:
        assert stream.read(piece) == CONTENT[:piece]
        assert stream.tell() == min(piece, len(CONTENT))
        assert stream.seek(50_000) == 50_000
        assert stream.read(7) == CONTENT[50_000:50_007]
        assert stream.seek(3, io.SEEK_CUR) == 50_010
        assert stream.read(7) == CONTENT[50_010:50_017]
        assert stream.seek(10) == 10
        assert stream.read(5) == CONTENT[10:15]
        assert stream.seek(15) == 15
        buffer = bytearray(200_000)
        assert stream.readinto(buffer) == len(CONTENT) - 15
        assert buffer[: len(CONTENT) - 15] == CONTENT[15:]
        assert stream.read(1) == b""
        assert stream.seek(10**9) == len(CONTENT)
    assert stream.closed
    assert stream._file.closed


def test_a_data_set_is_as_large_as_deflate_can_make_it(file):
    assert file.size == 1040 * (file.path.stat().st_size - 5)
    assert (file.name, file.path) == ("a", file.packed.path)


def test_the_first_look_is_followed_by_a_longer_one(file, monkeypatch):
    for lengths, looks in (
        ((10, 20), [10, 20]),
        ((200_000, 300_000), [100_000]),
        ((10, 200_000), [10, 100_000]),
    ):
        monkeypatch.setattr(dicom_deflated, "HEAD_BYTES", lengths)
        found = [head.read() for head in file.heads()]
        assert [len(head) for head in found] == looks
        assert all(CONTENT.startswith(head) for head in found)


def test_what_is_damaged_is_told(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"\xff" * 100)
    file = inflated_file(DicomFile("a", path, 100, Effort(100)), 0)
    with (
        file.open() as stream,
        pytest.raises(DamagedVolumeError, match="a: the deflated data set is damaged"),
    ):
        stream.read(1)


def test_slices_with_long_headers_and_a_damaged_one(tmp_path):
    for k, position in enumerate(axial()):
        dataset = make_slice(position, k, syntax=SYNTAX)
        dataset.add_new(0x00091001, "OB", CONTENT[: 70_000 + k])
        save(dataset, tmp_path / f"{k}")
    np.testing.assert_array_equal(read(tmp_path).values, [plane_values(k) for k in range(4)])
    content = (tmp_path / "3").read_bytes()
    (tmp_path / "3").write_bytes(content[:1000] + b"\xff" * 100 + content[1100:])
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, [plane_values(k) for k in range(3)])
    causes = ("the DICOM header cannot be read (3: the defl", "the file ends before its pixel data")
    assert volume.sentences[0].startswith(tuple(f"a file was left out: 3: {cause}" for cause in causes))
