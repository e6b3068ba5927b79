"""Files that are packed as a whole: any format by any of four packers, and no bomb among them."""

import bz2
import gzip
import io
import lzma
import sys

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io import decoding, packed, stream
from dmc_cli.volume_io.read import list_volumes, read_volume
from tests.fuzz.honest import HONEST
from tests.volume_io.reading import counting, read


def _zstd(content):
    numcodecs = pytest.importorskip("numcodecs")
    pytest.importorskip("backports.zstd" if sys.version_info < (3, 14) else "compression.zstd")
    return bytes(numcodecs.Zstd().encode(content))


PACKERS = {".gz": gzip.compress, ".bz2": bz2.compress, ".xz": lzma.compress, ".zst": _zstd}

SETTINGS = {"raw": {"shape": (8, 7, 6), "dtype": "int16"}}


def honest(reader, folder):
    """The first honest file of a reader."""
    for package in {"minc": ["h5py"], "tiff": ["tifffile"]}.get(reader, []):
        pytest.importorskip(package)
    return HONEST[reader](folder)[0]


@pytest.mark.parametrize("suffix", PACKERS)
@pytest.mark.parametrize(
    "reader", ["nifti", "nrrd", "meta", "mgh", "minc", "numpy", "tiff", "raw", "enhanced"]
)
def test_any_single_file_is_read_packed(tmp_path, reader, suffix):
    path = honest(reader, tmp_path)
    plain = read(path, **SETTINGS.get(reader, {}))
    path = path.rename(tmp_path / f"other{path.suffix}")
    whole = path.with_name(path.name + suffix)
    whole.write_bytes(PACKERS[suffix](path.read_bytes()))
    path.unlink()
    volume = read(whole, **SETTINGS.get(reader, {}))
    np.testing.assert_array_equal(volume.values, plain.values)
    np.testing.assert_array_equal(volume.affine, plain.affine)
    assert (volume.format, volume.space, volume.warnings) == (plain.format, plain.space, plain.warnings)
    assert volume.files == (whole,)
    (entry,) = list_volumes(str(whole), ReadSettings(**SETTINGS.get(reader, {})))
    assert entry.size == plain.shape


@pytest.mark.parametrize("suffix", PACKERS)
@pytest.mark.parametrize("name", ["a", "a.nrrd"])
def test_a_packed_file_is_known_by_its_content(tmp_path, suffix, name):
    """Whatever it is called."""
    plain = honest("nrrd", tmp_path).read_bytes()
    (tmp_path / name).write_bytes(PACKERS[suffix](plain))
    np.testing.assert_array_equal(read(tmp_path / name).values.ravel(), np.arange(6 * 7 * 8))


@pytest.mark.parametrize("suffix", PACKERS)
def test_standard_input_may_be_packed(monkeypatch, tmp_path, suffix):
    content = PACKERS[suffix](honest("nrrd", tmp_path).read_bytes())
    monkeypatch.setattr(sys, "stdin", type("Stdin", (), {"buffer": io.BytesIO(content)}))
    np.testing.assert_array_equal(read_volume("-", ReadSettings()).values.ravel(), np.arange(6 * 7 * 8))


def test_several_streams_are_one_file(tmp_path):
    content = honest("nrrd", tmp_path).read_bytes()
    for suffix, pack in PACKERS.items():
        path = tmp_path / f"two.nrrd{suffix}"
        path.write_bytes(pack(content[:100]) + pack(content[100:]))
        np.testing.assert_array_equal(read(path).values.ravel(), np.arange(6 * 7 * 8))


@pytest.mark.parametrize("suffix", PACKERS)
def test_a_packed_file_that_is_cut_or_changed_is_refused(tmp_path, suffix):
    content = PACKERS[suffix](honest("numpy", tmp_path).read_bytes())
    path = tmp_path / f"b.npy{suffix}"
    for damaged in (content[: len(content) // 2], content[:12], content[:8] + b"?" * 40):
        path.write_bytes(damaged)
        with pytest.raises((DamagedVolumeError, UnsupportedFormatError)) as caught:
            read(path)
        assert str(path) in str(caught.value)


def test_values_that_look_packed_are_raw_ones(tmp_path):
    content = b"BZh" + bytes(5 * 4 * 3 - 3)
    (tmp_path / "a.raw").write_bytes(content)
    volume = read(tmp_path / "a.raw", shape=(5, 4, 3), dtype="uint8")
    assert volume.values.tobytes() == content


@pytest.mark.parametrize("suffix", PACKERS)
def test_what_unpacks_to_far_more_than_files_are_packed_in_is_refused(tmp_path, monkeypatch, suffix):
    """Where the header tells no length, too; and nothing is left."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(packed, "FREE_BYTES", 1 << 20)
    monkeypatch.setattr(stream, "START_BYTES", 1 << 16)
    np.save(tmp_path / "a.npy", np.zeros((50, 300, 300), "u1"))
    zeros = (tmp_path / "a.npy").read_bytes()
    nrrd = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 300 300 50\nencoding: raw\n\n" + zeros
    for name, content in (("a.npy", zeros), ("a.nrrd", nrrd)):
        path = tmp_path / (name + suffix)
        path.write_bytes(PACKERS[suffix](content))
        with pytest.raises(DamagedVolumeError, match=r"bytes of \w+ found that unpack to more than 1\d+"):
            read(path)
    assert not [left for left in tmp_path.iterdir() if left.is_dir()]


def test_no_more_is_unpacked_than_the_header_asks_for(tmp_path, monkeypatch):
    monkeypatch.setattr(stream, "START_BYTES", 1 << 16)
    taken = []
    pieces = stream.check_disk
    monkeypatch.setattr(stream, "check_disk", lambda *of: (taken.append(of[1]), pieces(*of)))
    values = counting((10, 100, 100), "<u2")
    header = b"NRRD0004\ntype: ushort\ndimension: 3\nsizes: 100 100 10\nencoding: raw\nendian: little\n\n"
    path = tmp_path / "a.nrrd.gz"
    path.write_bytes(gzip.compress(header + values.tobytes() + bytes(1 << 27), 1))
    np.testing.assert_array_equal(read(path).values, values)
    assert max(taken) < 1 << 22


def test_a_file_packed_again_and_again_is_refused(tmp_path):
    content = honest("nrrd", tmp_path).read_bytes()
    path = tmp_path / "b.nrrd.gz"
    path.write_bytes(gzip.compress(gzip.compress(content)))
    assert read(path).shape == (8, 7, 6)
    path.write_bytes(gzip.compress(gzip.compress(gzip.compress(content))))
    with pytest.raises(UnsupportedFormatError, match="expected one packed once"):
        read(path)


def test_the_package_that_is_missing_is_named(tmp_path, monkeypatch):
    (tmp_path / "a.nrrd.zst").write_bytes(_zstd(honest("nrrd", tmp_path).read_bytes()))
    monkeypatch.setattr(decoding, "_knows_zstd", lambda: False)
    with pytest.raises(UnsupportedFormatError, match=r"pip install \"dmc-cli\[zstd\]\""):
        read(tmp_path / "a.nrrd.zst")
