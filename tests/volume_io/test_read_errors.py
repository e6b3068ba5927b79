"""Refusals of the system are reported: bad sectors, missing rights, looped links, names badly encoded."""

import builtins
import errno
import io
import os
import pathlib
from pathlib import Path

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, DmcError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import check_input, list_volumes, read_volume
from tests.fuzz.honest import HONEST
from tests.fuzz.test_fuzz import NEEDED
from tests.fuzz.trial import settings_for, target_of
from tests.volume_io.dicom.scanner import axial, plane_values, save_stack
from tests.volume_io.reading import counting, read


class BadDisk(io.FileIO):
    """A file of which what lies behind `good` bytes cannot be read."""

    def __init__(self, path, good):
        super().__init__(path)
        self.good = good

    def readinto(self, buffer):
        if self.tell() + len(buffer) > self.good:
            buffer = memoryview(buffer)[: max(self.good - self.tell(), 0)]
            if not len(buffer):
                raise OSError(errno.EIO, os.strerror(errno.EIO))
        return super().readinto(buffer)

    def readall(self):
        if os.fstat(self.fileno()).st_size > self.good:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return super().readall()

    read = io.RawIOBase.read


@pytest.fixture
def break_file(monkeypatch):
    """`break_file(path, good)` makes all but a file's first bytes unreadable; None forbids to open it."""
    real, broken = io.open, {}

    def opened(file, mode="r", buffering=-1, *rest, **options):
        path = None if isinstance(file, int) else os.path.realpath(file)
        if path not in broken or "b" not in mode:
            return real(file, mode, buffering, *rest, **options)
        if broken[path] is None:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        raw = BadDisk(path, broken[path])
        return raw if buffering == 0 else io.BufferedReader(raw)

    monkeypatch.setattr(io, "open", opened)
    monkeypatch.setattr(builtins, "open", opened)
    if hasattr(pathlib, "_NormalAccessor"):  # through which Python 3.10 opens paths
        monkeypatch.setattr(pathlib._NormalAccessor, "open", staticmethod(opened))
    return lambda path, good: broken.update({os.path.realpath(path): good})


UNREAD = (".zattrs", ".zmetadata", "a.raw")
"""Files that are not read, or not those of an array; and one that is mapped."""


def outcome_of(path, reader):
    """Return the error that reading ends in, or None; fail if it is not one that is documented."""
    try:
        list_volumes(str(target_of(path, reader)), settings_for(reader))
        read_volume(str(target_of(path, reader)), settings_for(reader))
    except DmcError as error:
        assert error.exit_status in (3, 4)
        return error
    return None


@pytest.mark.parametrize("reader", [reader for reader in HONEST if reader not in ("dicom", "compressed")])
def test_a_bad_disk_is_one_message_whatever_the_format(tmp_path, break_file, reader):
    for package in NEEDED.get(reader, ()):
        pytest.importorskip(package)
    for path in HONEST[reader](tmp_path):
        size = path.stat().st_size
        for good in (0, 10, min(200, size // 2), 2 * size // 3, size - 1, None):
            break_file(path, good)
            error = outcome_of(path, reader)
            if good is None or (good == 0 and path.name != ".zattrs"):
                assert error is not None or path.name in UNREAD, path
        break_file(path, 1 << 40)
        assert reader in ("nrrd", "numpy") or outcome_of(path, reader) is None


@pytest.fixture
def series(tmp_path):
    return save_stack(tmp_path / "in", axial(5), names="abcde")


@pytest.mark.parametrize("good", [None, 0, 100, 140, 300])
@pytest.mark.parametrize("name", ["a", "e"])
def test_a_slice_whose_header_cannot_be_read_is_told_and_the_others_are_kept(series, break_file, name, good):
    break_file(series / name, good)
    volume = read(series)
    assert volume.shape == (5, 4, 4)
    assert volume.sentences[0].startswith(f"a file was left out: {name}: ")
    assert "Input/output error" in volume.sentences[0] or "Permission denied" in volume.sentences[0]


def test_a_slice_in_the_middle_that_cannot_be_read_is_told_as_what_may_be_missing(series, break_file):
    break_file(series / "c", 0)
    with pytest.raises(
        AmbiguousVolumeError, match=r"missing slice.*1 file\(s\) left out: c: .*Input/output error"
    ):
        read(series)
    assert read(series, slice_gaps="keep").shape == (5, 4, 4)


def test_pixels_that_cannot_be_read_are_told_by_their_file(series, break_file):
    series = save_stack(series.with_name("large"), axial(5), names="abcde", values=counting((300, 300)))
    break_file(series / "c", (series / "c").stat().st_size - 20)
    with pytest.raises(VolumeError, match=r"^c: .*Input/output error"):
        read(series)


def test_a_folder_that_cannot_be_listed_is_told(series, monkeypatch):
    (series / "more").mkdir()
    real = os.scandir

    def refused(path):
        if Path(path).name == "more":
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        return real(path)

    monkeypatch.setattr(os, "scandir", refused)
    volume = read(series)
    assert volume.shape[2] == 5
    assert volume.sentences == ("1 file or folder (cannot be read (Permission denied)) was left out: more",)


def test_links_in_a_folder_of_slices(series, tmp_path):
    """Out of it they are followed when asked; in it always, each folder and file once."""
    outside = tmp_path / "usr"
    outside.mkdir()
    (series / "c").rename(outside / "c")
    (series / "b").rename(outside / "b")
    (series / "b").symlink_to(outside / "b")
    (series / "deep").symlink_to(outside)
    (series / "round").symlink_to(series)
    (series / "again").symlink_to("a")
    with pytest.raises(
        AmbiguousVolumeError, match=r"2 files or folders \(a link out of .*--allow-outside.*: b, deep"
    ):
        read(series)
    volume = read(series, allow_outside=True)
    np.testing.assert_array_equal(volume.values, [plane_values(k) for k in range(5)])
    assert volume.sentences == ()


def test_what_is_no_file_in_a_folder_of_slices(series):
    os.mkfifo(series / "pipe")
    (series / "zero").symlink_to("/dev/zero")
    (series / "one").symlink_to("two")
    (series / "two").symlink_to("one")
    (series / "nowhere").symlink_to("gone")
    volume = read(series, allow_outside=True)
    assert volume.shape[2] == 5
    assert set(volume.sentences) == {
        "1 file or folder (cannot be read (No such file or directory)) was left out: nowhere",
        "2 files or folders (cannot be read (Too many levels of symbolic links)) were left out: one, two",
        "2 files or folders (a pipe, a device or a socket) were left out: pipe, zero",
    }


def test_the_same_file_under_two_names_is_one_slice(series):
    os.link(series / "a", series / "f")
    (series / "empty").write_bytes(b"")
    volume = read(series)
    assert volume.shape[2] == 5
    assert volume.sentences == ()


def test_checking_an_input_tells_errors_too(tmp_path, break_file):
    (tmp_path / "a.volume").write_bytes(b"NRRD0004" + bytes(5000))
    break_file(tmp_path / "a.volume", 0)
    for look in (check_input, list_volumes, read_volume):
        with pytest.raises(VolumeError, match=r"cannot be read .*check"):
            look(str(tmp_path / "a.volume"), ReadSettings())


def test_a_message_for_what_no_reader_expects(tmp_path, monkeypatch):
    from dmc_cli.volume_io import numpy_file

    np.save(tmp_path / "a.npy", counting((3, 4, 5)))

    def failing(*_):
        raise OSError(errno.ESTALE, "Stale file handle")

    monkeypatch.setattr(numpy_file, "numpy_volume", failing)
    monkeypatch.setattr(numpy_file, "numpy_entries", failing)
    for look in (list_volumes, read_volume):
        with pytest.raises(
            VolumeError, match=r"a\.npy: cannot be read \(Stale file handle\); expected .*check"
        ) as caught:
            look(str(tmp_path / "a.npy"), ReadSettings())
        assert caught.value.exit_status == 3


UNLIKE = ("raw", "nrrd", "numpy", "dicom_meanings")
"""Readers whose honest files need options, are named by a header, or are several volumes."""


@pytest.mark.parametrize("reader", [reader for reader in HONEST if reader not in UNLIKE])
def test_names_that_are_no_utf_8(tmp_path, reader):
    for package in NEEDED.get(reader, ()):
        pytest.importorskip(package)
    plain, folder = tmp_path / "plain", tmp_path / os.fsdecode(b"sch\xf6n")
    plain.mkdir()
    path = folder / HONEST[reader](plain)[0].relative_to(plain)
    plain.rename(folder)
    if target_of(path, reader) == path:
        stem, suffix = path.name.split(".", 1)
        for sibling in folder.glob(f"{stem}.*"):
            sibling.rename(folder / (os.fsdecode(b"\xff") + sibling.name[len(stem) :]))
        path = folder / f"{os.fsdecode(bytes([255]))}.{suffix}"
    volume = read(target_of(path, reader))
    assert volume.path == str(target_of(path, reader))
    assert len(list_volumes(volume.path, ReadSettings())) == 1


def test_a_name_that_no_file_system_takes(tmp_path):
    for chosen in (None, "dicom", "nrrd", "zarr", "tiff", "numpy"):
        with pytest.raises(VolumeError):
            read(tmp_path / "\ud800", input_format=chosen)


@pytest.mark.parametrize("reader", ["tiff", "zarr"])
def test_what_the_system_says_is_told(tmp_path, reader, break_file):
    for package in NEEDED.get(reader, ()):
        pytest.importorskip(package)
    path = HONEST[reader](tmp_path)[0]
    break_file(path, 8)
    assert "Input/output error" in str(outcome_of(path, reader))
