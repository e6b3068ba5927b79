"""Standard input: read as far as its header asks for and the disk holds, with no files beside it."""

import io
import sys
from pathlib import Path

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io import stream
from dmc_cli.volume_io.read import read_volume
from tests.volume_io.reading import counting


class Endless(io.RawIOBase):
    """Standard input that never ends: a beginning, then zeros."""

    def __init__(self, start):
        self.start, self.taken = io.BytesIO(start), 0

    def read(self, size=-1):
        assert size >= 0
        self.taken += size
        return self.start.read(size).ljust(size, b"\0")


def from_stdin(monkeypatch, start, **settings):
    endless = Endless(start)
    monkeypatch.setattr(sys, "stdin", type("Stdin", (), {"buffer": endless}))
    return endless, lambda: read_volume("-", ReadSettings(**settings))


FORMATS = [None, "dicom", "tiff", "numpy", "zarr", "nifti", "nrrd", "meta", "analyze"]


@pytest.mark.parametrize("chosen", FORMATS)
def test_endless_zeros_on_standard_input_are_refused_at_once(monkeypatch, chosen):
    endless, reading = from_stdin(monkeypatch, b"", input_format=chosen)
    with pytest.raises(UnsupportedFormatError):
        reading()
    assert endless.taken == stream.START_BYTES


def test_endless_raw_values_are_refused_when_there_are_too_many(monkeypatch):
    endless, reading = from_stdin(monkeypatch, b"", input_format="raw", shape=(100, 100, 200), dtype="uint8")
    with pytest.raises(DamagedVolumeError, match="2000001 bytes found, 2000000 expected"):
        reading()
    assert endless.taken == 2_000_001


def test_a_header_tells_how_much_of_standard_input_is_read(monkeypatch):
    values = counting((100, 100, 100), "<i2")
    header = b"NRRD0004\ntype: short\ndimension: 3\nsizes: 100 100 100\nencoding: raw\nendian: little\n\n"
    endless, reading = from_stdin(monkeypatch, header + values.tobytes())
    np.testing.assert_array_equal(reading().values, values)
    assert endless.taken == len(header) + 2_000_000 + (1 << 20)


@pytest.mark.parametrize(("total", "kept"), [(20 << 20, 1 << 20), (1 << 42, 1 << 30)])
def test_standard_input_never_fills_the_disk(monkeypatch, total, kept):
    """A twentieth of it stays free, of a large one a gibibyte."""
    usage = type("Usage", (), {"total": total, "used": 0, "free": kept + stream.PIECE_BYTES})
    monkeypatch.setattr(stream.shutil, "disk_usage", lambda _: usage)
    stream.check_disk(Path("/tmp/a"), 1 << 20)
    endless, reading = from_stdin(monkeypatch, b"II*\0")
    monkeypatch.setattr(stream, "PIECE_BYTES", stream.PIECE_BYTES + 1)
    with pytest.raises(VolumeError, match=r"no end after 1 MiB.*give a file"):
        reading()
    assert endless.taken == stream.START_BYTES


def test_nothing_lies_beside_standard_input(monkeypatch, tmp_path):
    """Of files in the folder for temporary ones, which anybody may have written, none is its data."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "a.raw").write_bytes(counting((3, 4, 5), "<i2").tobytes())
    header = (
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nencoding: raw\nendian: little\ndata file: {}\n"
    )
    for named in ("a.raw", "../a.raw"):
        stdin = io.BytesIO(header.format(named).encode())
        monkeypatch.setattr(sys, "stdin", type("Stdin", (), {"buffer": stdin}))
        with pytest.raises(VolumeError, match=r"is not there|outside the header's folder"):
            read_volume("-", ReadSettings())
    assert [path.name for path in tmp_path.iterdir()] == ["a.raw"]


def test_a_short_stream_is_read_whole(monkeypatch, tmp_path):
    np.save(tmp_path / "a.npy", counting((3, 4, 5)))
    stdin = io.BytesIO((tmp_path / "a.npy").read_bytes())
    monkeypatch.setattr(sys, "stdin", type("Stdin", (), {"buffer": stdin}))
    volume = read_volume("-", ReadSettings())
    np.testing.assert_array_equal(volume.values, counting((3, 4, 5)))
    assert volume.files == ()


def test_a_stream_that_ends_early_or_fails_is_told(monkeypatch):
    monkeypatch.setattr(stream, "START_BYTES", 100)
    values = counting((10, 10, 10), "<i2")
    header = b"NRRD0004\ntype: short\ndimension: 3\nsizes: 10 10 10\nencoding: raw\nendian: little\n\n"
    whole = header + values.tobytes()

    class Failing(io.BytesIO):
        def read(self, size):
            if self.tell() > 1000:
                raise OSError("the other end is gone")
            return super().read(min(size, 700))

    for buffer, told in (
        (io.BytesIO(whole[:-1]), f"-: {len(whole) - 1} bytes found, {len(whole)} expected"),
        (Failing(whole), r"-: standard input cannot be read \(the other end is gone\); give a file"),
    ):
        monkeypatch.setattr(sys, "stdin", type("Stdin", (), {"buffer": buffer}))
        with pytest.raises(VolumeError, match=told):
            read_volume("-", ReadSettings())


@pytest.mark.parametrize("piece", [1, 7, 1 << 26])
def test_the_pieces_of_a_stream_do_not_show(monkeypatch, piece):
    monkeypatch.setattr(stream, "START_BYTES", 100)
    monkeypatch.setattr(stream, "PIECE_BYTES", piece)
    values = counting((4, 5, 6), "<i2")
    header = b"NRRD0004\ntype: short\ndimension: 3\nsizes: 6 5 4\nencoding: raw\nendian: little\n\n"
    buffer = io.BytesIO(header + values.tobytes())
    monkeypatch.setattr(sys, "stdin", type("Stdin", (), {"buffer": buffer}))
    np.testing.assert_array_equal(read_volume("-", ReadSettings()).values, values)
