"""Outputs on disks without locks, under long names, behind links, in a process without threads."""

import errno
import fcntl
import os
import socket
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from dmc_cli.errors import WriteError
from dmc_cli.files import atomic
from dmc_cli.files.atomic import LONGEST_NAME, check_output, open_output, part_of, write_error, write_output
from dmc_cli.settings import STREAM


@pytest.fixture
def target(tmp_path):
    return tmp_path / "mesh.ply"


NO_LOCKS = [errno.EINVAL, errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP, None]


@pytest.fixture(params=NO_LOCKS, ids=lambda number: errno.errorcode.get(number, "windows"))
def no_locks(request, monkeypatch):
    def flock(descriptor, operation):
        raise OSError(request.param, os.strerror(request.param))

    if request.param is None:
        monkeypatch.setattr(atomic, "fcntl", None)
    else:
        monkeypatch.setattr(fcntl, "flock", flock)


def test_without_locks_an_output_is_written_all_the_same(target, no_locks):
    write_output(str(target), [b"first"], force=False)
    write_output(str(target), [b"second"], force=True)
    assert target.read_bytes() == b"second"
    assert os.listdir(target.parent) == ["mesh.ply"]


def test_without_locks_what_may_be_another_runs_is_left_alone(target, no_locks):
    part_of(target).write_bytes(b"another run's")
    names = set()
    for content in (b"one", b"two"):
        with open_output(str(target), force=True) as stream:
            stream.write(content)
            names |= set(os.listdir(target.parent))
        assert target.read_bytes() == content
        assert part_of(target).read_bytes() == b"another run's"
    assert sorted(os.listdir(target.parent)) == [".mesh.ply.dmc-part", "mesh.ply"]
    assert len(names) == 4  # each had a file of its own
    assert all(name.endswith(".dmc-part") for name in names - {"mesh.ply"})


def test_without_locks_two_runs_at_the_same_time_both_write_whole_files(target, no_locks):
    with open_output(str(target), force=True) as first:
        first.write(b"fir")
        with open_output(str(target), force=True) as second:
            second.write(b"second")
        assert target.read_bytes() == b"second"
        first.write(b"st")
    assert target.read_bytes() == b"first"
    assert os.listdir(target.parent) == ["mesh.ply"]


def test_without_locks_a_failure_leaves_nothing(target, no_locks):
    for taken in (False, True):
        if taken:
            part_of(target).write_bytes(b"another run's")
        with pytest.raises(KeyboardInterrupt), open_output(str(target), force=True) as stream:
            stream.write(b"half")
            raise KeyboardInterrupt
        assert os.listdir(target.parent) == [part_of(target).name] * taken


def test_a_lock_that_fails_for_another_reason_is_an_error(target, monkeypatch):
    def flock(descriptor, operation):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(fcntl, "flock", flock)
    before = len(os.listdir("/proc/self/fd"))
    with pytest.raises(WriteError, match="Input/output error"):
        write_output(str(target), [b""], force=False)
    assert len(os.listdir("/proc/self/fd")) == before


def test_a_file_being_written_lets_nobody_else_in(target):
    with (
        open_output(str(target), force=False),
        part_of(target).open("rb") as other,
        pytest.raises(BlockingIOError),
    ):
        fcntl.flock(other, fcntl.LOCK_SH | fcntl.LOCK_NB)


def test_no_descriptor_is_left_open(target):
    with part_of(target).open("wb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        before = os.listdir("/proc/self/fd")
        for _ in range(3):
            with pytest.raises(WriteError, match="another run"):
                write_output(str(target), [b""], force=False)
        assert len(os.listdir("/proc/self/fd")) == len(before)


def test_a_renamed_part_is_closed_again(target, monkeypatch):
    part_of(target).write_bytes(b"theirs")
    flock = fcntl.flock

    def rename_first(descriptor, operation):
        if not target.exists():
            part_of(target).rename(target)
        flock(descriptor, operation)

    monkeypatch.setattr(fcntl, "flock", rename_first)
    before = len(os.listdir("/proc/self/fd"))
    with pytest.raises(WriteError, match="exists already"):
        write_output(str(target), [b"ours"], force=False)
    assert len(os.listdir("/proc/self/fd")) == before


def test_a_part_that_meanwhile_is_another_runs_is_not_removed(target):
    """Somebody cleaned up, and another run began."""
    with pytest.raises(RuntimeError), open_output(str(target), force=False):
        part_of(target).unlink()
        part_of(target).write_bytes(b"theirs")
        raise RuntimeError
    assert part_of(target).read_bytes() == b"theirs"


def test_on_windows_a_part_that_cannot_be_renamed_is_removed(target, monkeypatch):
    monkeypatch.setattr(atomic, "fcntl", None)

    def replace(part, other):
        assert stream.closed  # Windows renames closed files only
        raise PermissionError(errno.EACCES, "The process cannot access the file")

    monkeypatch.setattr(Path, "replace", replace)
    with pytest.raises(WriteError, match="no permission"), open_output(str(target), force=False) as stream:
        stream.write(b"ours")
    assert os.listdir(target.parent) == []


@pytest.mark.parametrize("name", ["x" * 245, "x" * 246, "x" * LONGEST_NAME, "é" * 127, "\udcff" * 255])
def test_every_name_that_the_disk_takes_can_be_written(tmp_path, name):
    path = str(tmp_path / name)
    with open_output(path, force=False) as stream:
        stream.write(b"whole")
        assert os.listdir(tmp_path) == [part_of(tmp_path / name).name]
        with pytest.raises(WriteError, match="another run"):
            write_output(path, [b""], force=False)
    assert (tmp_path / name).read_bytes() == b"whole"
    assert os.listdir(tmp_path) == [name]


def test_a_short_name_shows_in_its_part_and_long_ones_have_parts_of_their_own(tmp_path):
    assert part_of(tmp_path / ("x" * 245)).name == "." + "x" * 245 + ".dmc-part"
    parts = {part_of(tmp_path / name).name for name in ("x" * 246, "x" * 247, "y" * 246)}
    assert len(parts) == 3
    assert all(len(part) < 60 and part.endswith(".dmc-part") for part in parts)


@pytest.mark.parametrize("name", ["x" * 256, "x" * 300, "é" * 128, "x" * 5000])
@pytest.mark.parametrize("force", [False, True])
def test_a_name_that_no_disk_takes_is_told_before_the_work(tmp_path, name, force):
    with pytest.raises(WriteError, match="the name is too long for this disk; choose a shorter one"):
        check_output(str(tmp_path / name), force=force)


@pytest.mark.parametrize("force", [False, True])
@pytest.mark.parametrize("place", ["output", "folder"])
def test_links_in_a_circle_are_told_before_the_work(tmp_path, force, place):
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    path = tmp_path / "a" / "mesh.ply" if place == "folder" else tmp_path / "a"
    with pytest.raises(WriteError, match=r"cannot be written: (links that lead in a circle|the folder)"):
        check_output(str(path), force=force)
    with pytest.raises(WriteError):
        write_output(str(path), [b""], force=force)
    assert sorted(os.listdir(tmp_path)) == ["a", "b"]


def test_a_link_to_what_is_not_there_yet_is_followed(tmp_path):
    (tmp_path / "link.ply").symlink_to("mesh.ply")
    write_output(str(tmp_path / "link.ply"), [b"new"], force=False)
    assert (tmp_path / "mesh.ply").read_bytes() == b"new"
    assert (tmp_path / "link.ply").is_symlink()


def test_a_null_character_is_told():
    with pytest.raises(WriteError, match=r"'a\\x00b' cannot be written: .*null"):
        check_output("a\0b", force=False)


def test_a_disk_that_fails_to_answer_is_told(target, monkeypatch):
    def is_dir(path):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(Path, "is_dir", is_dir)
    with pytest.raises(WriteError, match=r"mesh\.ply cannot be written: Input/output error; choose another"):
        check_output(str(target), force=False)


def test_permission_is_asked_to_make_and_to_rename_files_in_the_folder(target, monkeypatch):
    asked = []
    monkeypatch.setattr(os, "access", lambda path, mode: asked.append((Path(path), mode)) or True)
    check_output(str(target), force=False)
    assert asked == [(target.parent, os.W_OK | os.X_OK)]


def test_a_file_called_like_standard_output_is_no_matter(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / STREAM).mkdir()
    check_output(STREAM, force=False)


@pytest.mark.parametrize("kind", ["pipe", "socket"])
def test_pipes_and_sockets_are_never_replaced(tmp_path, kind):
    path = tmp_path / "there"
    got = []
    if kind == "pipe":
        os.mkfifo(path)
        reader = threading.Thread(target=lambda: got.append(path.read_bytes()))
        reader.start()
        assert write_output(str(path), [b"through"], force=False) == 7
        reader.join()
        assert got == [b"through"]
    else:
        with socket.socket(socket.AF_UNIX) as listening:
            listening.bind(str(path))
            with pytest.raises(WriteError, match="cannot be written"):
                write_output(str(path), [b"over"], force=True)
    assert os.listdir(tmp_path) == ["there"]
    assert not path.is_file()


@pytest.mark.parametrize("folder", ["/dev/fd", "/proc/self/fd"])
def test_a_pipe_without_a_name_is_written_by_its_number(folder):
    if not os.path.isdir(folder):
        pytest.skip(f"there is no {folder}")
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb") as reader:
        with os.fdopen(writing, "wb"):
            check_output(f"{folder}/{writing}", force=False)
            assert write_output(f"{folder}/{writing}", [b"all ", b"of"], force=False) == 6
        assert reader.read() == b"all of"


@pytest.mark.parametrize("path", [".", "./", "..", "/", "//"])
def test_a_folder_without_a_name_is_no_output(target, monkeypatch, path):
    monkeypatch.chdir(target.parent)
    with pytest.raises(WriteError, match=r"is a folder; expected .* for example \S*mesh.ply"):
        check_output(path, force=True)


def test_all_bytes_are_on_the_disk_before_the_file_has_its_name(target, monkeypatch):
    found = []

    def fsync(descriptor):
        found.append((os.fstat(descriptor).st_size, target.exists()))

    monkeypatch.setattr(os, "fsync", fsync)
    write_output(str(target), [b"abc", b"de"], force=False)
    assert found == [(5, False)]


@pytest.mark.parametrize("number", [errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EIO])
def test_a_disk_that_cannot_be_waited_for_is_no_error_unless_it_fails(target, monkeypatch, number):
    def fsync(descriptor):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", fsync)
    if number == errno.EIO:
        with pytest.raises(WriteError):
            write_output(str(target), [b"new"], force=False)
        assert os.listdir(target.parent) == []
    else:
        write_output(str(target), [b"new"], force=False)
        assert target.read_bytes() == b"new"


@pytest.mark.parametrize(
    ("number", "advice"),
    [
        (errno.ENOSPC, "the disk is full; free some space"),
        (errno.EDQUOT, "the disk quota is used up"),
        (errno.EFBIG, "size limit set for it; raise it"),
        (errno.EACCES, "no permission to write there"),
        (errno.EPERM, "no permission to write there"),
        (errno.EROFS, "the disk is read-only"),
        (errno.ELOOP, "links that lead in a circle"),
        (errno.ENAMETOOLONG, "the name is too long"),
        (errno.EPIPE, "the reader of the output is gone"),
        (errno.EIO, "Input/output error; choose another place"),
    ],
)
def test_each_reason_has_its_advice(number, advice):
    told = str(write_error("a.ply", OSError(number, os.strerror(number))))
    assert told.startswith("a.ply cannot be written: ")
    assert advice in told
    assert str(write_error(STREAM, OSError(number, ""))).startswith("standard output cannot be written: ")


def test_an_error_without_a_number_tells_itself():
    assert "odd; choose another place" in str(write_error("a.ply", OSError("odd")))


class Recorder:
    """A stream that writes down what it is asked, and fails on request."""

    def __init__(self, failing=None):
        self.events, self.failing = [], failing

    def write(self, chunk):
        self.events.append(("write", chunk))
        if chunk == self.failing:
            raise OSError(errno.ENOSPC, "No space left on device")
        self.events.append(("wrote", chunk))
        return len(chunk)

    def chunks(self, count):
        for number in range(count):
            chunk = b"%d" % number
            self.events.append(("make", chunk))
            yield chunk


@pytest.fixture
def recorder(monkeypatch):
    from contextlib import contextmanager

    stream = Recorder()

    @contextmanager
    def opened(path, *, force):
        yield stream

    monkeypatch.setattr(atomic, "open_output", opened)
    return stream


@pytest.mark.parametrize("failing", [0, 1, 2])
def test_whichever_chunk_fails_the_output_does(recorder, failing):
    recorder.failing = b"%d" % failing
    with pytest.raises(OSError, match="No space"):
        write_output("any", recorder.chunks(3), force=False)


def test_one_chunk_is_written_while_the_next_is_made_and_not_more(recorder):
    assert write_output("any", recorder.chunks(6), force=False) == 6
    order = {event: place for place, event in enumerate(recorder.events)}
    for number in range(4):
        assert order["wrote", b"%d" % number] < order["write", b"%d" % (number + 1)]
        assert order["wrote", b"%d" % number] < order["make", b"%d" % (number + 2)]


@pytest.mark.parametrize("first", [0, 1, 2])
def test_without_threads_chunks_are_written_at_once_and_each_of_them_once(target, monkeypatch, first):
    """Threads run out at the first chunk or at a later one, and there are some again afterwards."""
    submit, calls = ThreadPoolExecutor.submit, []

    def limited(pool, *words):
        calls.append(words)
        if len(calls) == first + 1:
            start = threading.Thread.start
            monkeypatch.setattr(threading.Thread, "start", no_thread)
            try:
                if first:
                    raise RuntimeError("can't start new thread")
                return submit(pool, *words)
            finally:
                monkeypatch.setattr(threading.Thread, "start", start)
        return submit(pool, *words)

    def no_thread(thread):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(ThreadPoolExecutor, "submit", limited)
    assert write_output(str(target), [b"a", b"bc", b"d", b"e"], force=False) == 5
    assert target.read_bytes() == b"abcde"
    assert len(calls) == first + 1


def test_standard_output_that_fails_at_the_end_is_told(monkeypatch):
    class Full:
        def write(self, chunk):
            return len(chunk)

        def flush(self):
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(atomic.sys, "stdout", type("Stdout", (), {"buffer": Full()}))
    with pytest.raises(WriteError, match="standard output cannot be written: the disk is full"):
        write_output(STREAM, [b"abc"], force=False)
