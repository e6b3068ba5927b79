"""Values in pieces: where pieces meet, and how much a file of so many bytes may stand for."""

import bz2
import gzip
import math
import zlib

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io import decoding
from tests.volume_io.nrrd.test_reader import ENCODED, header, write
from tests.volume_io.reading import counting, read

VALUES = counting((4, 3, 2), "<i2") * 37
HALF = VALUES.tobytes()[:21], VALUES.tobytes()[21:]
STREAMS = {encoding: (encoding, ENCODED[encoding](VALUES.tobytes())) for encoding in ENCODED}
STREAMS |= {
    "zlib": ("gzip", zlib.compress(VALUES.tobytes())),
    "gzip of two": ("gzip", b"".join(map(gzip.compress, HALF)) + b"\0 behind"),
    "bzip2 of two": ("bzip2", b"".join(map(bz2.compress, HALF)) + b"\0 behind"),
    "hex in lines": ("hex", VALUES.tobytes().hex(" ", 1).encode() + b"\n"),
    "text with commas": ("ascii", ",\t".join(map(str, VALUES.ravel())).encode() + b"\n\n"),
    "text in lines": ("ascii", "\n".join(map(str, VALUES.ravel())).encode() + b"\n"),
    "text with tabs": ("ascii", "\t".join(map(str, VALUES.ravel())).encode() + b"\t"),
}


@pytest.mark.parametrize("piece", [4, 5, 7, 16, 19, 1 << 20])
@pytest.mark.parametrize("kind", STREAMS)
def test_the_pieces_that_are_read_do_not_show(tmp_path, monkeypatch, kind, piece):
    monkeypatch.setattr(decoding, "CHUNK", piece)
    encoding, content = STREAMS[kind]
    path = write(tmp_path / "a.nrrd", header(encoding=encoding), content)
    np.testing.assert_array_equal(read(path).values, VALUES)


@pytest.mark.parametrize("kind", ["gzip", "bzip2", "hex", "ascii", "zlib", "gzip of two", "bzip2 of two"])
def test_a_stream_in_pieces_that_was_cut_short_is_refused(tmp_path, monkeypatch, kind):
    monkeypatch.setattr(decoding, "CHUNK", 16)
    encoding, content = STREAMS[kind]
    for kept in (len(content) // 2, len(content) // 2 - 9):
        with pytest.raises(DamagedVolumeError, match=r"a\.nrrd: "):
            read(write(tmp_path / "a.nrrd", header(encoding=encoding), content[:kept]))


@pytest.mark.parametrize(
    ("behind", "taken"), [(b"", True), (b"\n" * 99, True), (b"1.5", False), (b"x", False)]
)
def test_what_follows_the_numbers(tmp_path, monkeypatch, behind, taken):
    """One more piece is looked at, in which there may be a checksum."""
    monkeypatch.setattr(decoding, "CHUNK", 16)
    content = b" ".join(b"%d" % n for n in VALUES.ravel()) + b" " + behind
    path = write(tmp_path / "a.nrrd", header(encoding="ascii"), content)
    if taken:
        np.testing.assert_array_equal(read(path).values, VALUES)
        return
    with pytest.raises(DamagedVolumeError, match="the values cannot be decoded"):
        read(path)


@pytest.mark.parametrize(
    ("encoding", "ratio"), [("raw", 1), ("gzip", 1040), ("bzip2", 1_200_000), ("ascii", 4.5), ("hex", 0.5)]
)
def test_a_file_of_few_bytes_promises_no_more_than_its_packer_can(tmp_path, encoding, ratio):
    """Said before anything is allocated; what may be is looked at."""
    held = 100
    (tmp_path / "values").write_bytes(bytes(held))
    for most, too_much in ((math.floor(held * ratio), False), (math.floor(held * ratio) + 1, True)):
        text = header(encoding=encoding, sizes="2 2 2", kind="uchar")
        text += f"byte skip: {most - 8}\ndata file: values\n"
        if not too_much and encoding == "raw":
            assert read(write(tmp_path / "a.nhdr", text)).values.sum() == 0
            continue
        with pytest.raises(DamagedVolumeError) as caught:
            read(write(tmp_path / "a.nhdr", text))
        expected = math.ceil(most / ratio)
        assert (f"{held} bytes found, {expected} expected" in str(caught.value)) == too_much


@pytest.mark.parametrize(("encoding", "free", "held"), [("gzip", 1 << 33, 10**7), ("bzip2", 1 << 30, 1000)])
def test_no_more_is_passed_over_than_seconds_take(tmp_path, encoding, free, held):
    with (tmp_path / "values").open("wb") as file:
        file.truncate(held)
    for skipped, told in ((free + 100 * held, "values"), (free + 100 * held + 1, "bytes to pass over found")):
        text = header(encoding=encoding) + f"byte skip: {skipped}\ndata file: values\n"
        with pytest.raises(DamagedVolumeError, match=told) as caught:
            read(write(tmp_path / "a.nhdr", text))
        assert ("to pass over" in str(caught.value)) == ("pass over" in told)


@pytest.mark.parametrize(("length", "taken"), [((1 << 20) - 1, True), (1 << 20, False)])
def test_a_line_to_skip_is_a_mebibyte_long_at_most(tmp_path, length, taken):
    text = header(extra="line skip: 1\n")
    path = write(tmp_path / "a.nrrd", text, b"x" * length + b"\n" + VALUES.tobytes())
    if taken:
        np.testing.assert_array_equal(read(path).values, VALUES)
        return
    with pytest.raises(DamagedVolumeError, match="fewer or longer lines"):
        read(path)
