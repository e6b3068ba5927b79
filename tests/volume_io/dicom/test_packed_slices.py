"""Slices that are packed one by one: in a folder, a zip, a tar, beside others that are not."""

import re
import tarfile
import zipfile

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.dicom import packed_slices
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save
from tests.volume_io.reading import read
from tests.volume_io.test_packed import PACKERS

VALUES = [plane_values(k) for k in range(4)]


def packed(folder, suffix, names="s{}.dcm", which=range(4)):
    """A folder of slices, some of them packed."""
    for k, position in enumerate(axial(4)):
        path = save(make_slice(position, k), folder / names.format(k))
        if k in which:
            path.with_name(path.name + suffix).write_bytes(PACKERS[suffix](path.read_bytes()))
            path.unlink()
    return folder


@pytest.mark.parametrize("suffix", PACKERS)
@pytest.mark.parametrize("names", ["s{}.dcm", "a/b/IM{}", "{}/s.ima"])
def test_a_folder_of_packed_slices_is_read(tmp_path, suffix, names):
    folder = packed(tmp_path / "in", suffix, names)
    volume = read(folder)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert volume.warnings == ()
    assert volume.files == tuple(sorted(path for path in folder.rglob("*") if path.is_file()))
    (entry,) = list_volumes(str(folder), ReadSettings())
    assert entry.size == volume.shape


@pytest.mark.parametrize("suffix", PACKERS)
def test_slices_beside_packed_ones_are_read_with_them(tmp_path, suffix):
    np.testing.assert_array_equal(read(packed(tmp_path, suffix, which=(1, 3))).values, VALUES)


@pytest.mark.parametrize("which", [range(4), (1, 3), (0,)])
@pytest.mark.parametrize("kind", ["zip", "tar"])
def test_packed_slices_in_an_archive_are_read(tmp_path, kind, which):
    folder = packed(tmp_path / "in", ".gz", which=which)
    path = tmp_path / f"a.{kind}"
    with zipfile.ZipFile(path, "w") if kind == "zip" else tarfile.open(path, "w") as archive:
        for file in sorted(folder.iterdir()):
            (archive.write if kind == "zip" else archive.add)(file, file.name)
    volume = read(path)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert volume.files == (path,)


def test_packed_slices_in_the_order_of_their_names(tmp_path):
    volume = read(packed(tmp_path, ".gz"), slice_order="filename", spacing=(1, 1, 1))
    np.testing.assert_array_equal(volume.values, VALUES)


def test_a_packed_slice_that_is_cut_is_refused(tmp_path):
    path = packed(tmp_path, ".gz") / "s2.dcm.gz"
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises((DamagedVolumeError, AmbiguousVolumeError), match=r"s2\.dcm\.gz"):
        read(tmp_path)


def test_slices_that_unpack_to_far_more_are_refused(tmp_path, monkeypatch):
    """All together, and nothing is left of them."""
    monkeypatch.setattr(packed_slices, "FREE_BYTES", 0)
    monkeypatch.setattr(packed_slices, "PIECE", 1 << 12)
    folder = packed(tmp_path / "in", ".bz2")
    dataset = make_slice(axial(5)[4], 4)
    dataset.ImageComments = "x" * 10_000
    for k in range(5, 9):
        path = save(dataset, folder / f"s{k}.dcm")
        content = path.read_bytes() + bytes(1 << 20)
        path.with_name(path.name + ".bz2").write_bytes(PACKERS[".bz2"](content))
        path.unlink()
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    with pytest.raises(DamagedVolumeError, match="unpacks to more bytes than packed slices do"):
        read(folder)
    assert not list((tmp_path / "temporary").iterdir())


def test_packed_files_of_other_kinds_are_no_slices(tmp_path):
    folder = packed(tmp_path, ".gz")
    (folder / "notes.gz").write_bytes(PACKERS[".gz"](b"of use to people" * 100))
    volume = read(folder)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert volume.warnings == ()


@pytest.mark.parametrize("suffix", PACKERS)
@pytest.mark.parametrize("name", ["s3.dcm", "a.ima"])
def test_a_packed_slice_that_is_damaged_at_its_start_is_refused(tmp_path, suffix, name):
    path = packed(tmp_path, suffix, which=(3,)) / f"s3.dcm{suffix}"
    content = path.read_bytes()
    path.unlink()
    path.with_name(name + suffix).write_bytes(content[:8] + b"?" * len(content))
    with pytest.raises(DamagedVolumeError, match=re.escape(name + suffix)):
        read(tmp_path)


@pytest.mark.parametrize("which", [range(3), ()])
def test_a_packed_file_that_may_be_a_slice_or_not_is_told(tmp_path, which):
    """It is damaged at its start, and its name says nothing."""
    path = packed(tmp_path, ".gz", which=which) / "broken.gz"
    path.write_bytes(b"\x1f\x8b nothing")
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert [notice.code for notice in volume.warnings] == ["W-FILE-DAMAGED"]
    assert volume.sentences[0].startswith("a file was left out: broken.gz: what gzip packed is damaged")


def test_where_a_slice_is_missing_a_damaged_packed_file_is_named(tmp_path):
    folder = packed(tmp_path, ".gz")
    (folder / "s2.dcm.gz").unlink()
    (folder / "IM2.gz").write_bytes(b"\x1f\x8b nothing")
    with pytest.raises(AmbiguousVolumeError, match=r"missing slice found.*IM2\.gz"):
        read(folder)
