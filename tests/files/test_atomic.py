"""Outputs are complete or not there at all, whatever goes wrong."""

import errno
import fcntl
import os
import resource
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from dmc_cli.errors import WriteError
from dmc_cli.files import atomic
from dmc_cli.files.atomic import check_output, open_output, write_output
from dmc_cli.settings import STREAM

SLOW_WRITER = """
import sys, time
from dmc_cli.files.atomic import write_output
def chunks():
    while True:
        yield b"x" * 1000
        print("wrote", flush=True)
        time.sleep(0.01)
write_output(sys.argv[1], chunks(), force=True)
"""


@pytest.fixture
def target(tmp_path):
    return tmp_path / "mesh.ply"


def part_of(target):
    return target.with_name(f".{target.name}.dmc-part")


def failing_chunks():
    yield b"half"
    raise RuntimeError("the encoder broke")


def test_the_file_holds_all_chunks_and_nothing_else_is_left(target):
    assert write_output(str(target), [b"ab", b"", b"cde"], force=False) == 5
    assert target.read_bytes() == b"abcde"
    assert os.listdir(target.parent) == ["mesh.ply"]


def test_a_new_file_has_the_permissions_that_the_user_asked_for(target):
    old = os.umask(0o027)
    try:
        write_output(str(target), [b"ab"], force=False)
    finally:
        os.umask(old)
    assert stat.S_IMODE(target.stat().st_mode) == 0o640


def test_an_existing_file_needs_force(target):
    target.write_bytes(b"old")
    with pytest.raises(WriteError, match=r"exists already; .* overwrite it with --force"):
        write_output(str(target), [b"new"], force=False)
    assert target.read_bytes() == b"old"
    write_output(str(target), [b"new"], force=True)
    assert target.read_bytes() == b"new"


def test_a_file_that_appears_during_the_run_is_not_overwritten(target):
    def chunks():
        yield b"ours"
        target.write_bytes(b"theirs")

    with pytest.raises(WriteError, match="exists already"):
        write_output(str(target), chunks(), force=False)
    assert target.read_bytes() == b"theirs"
    assert not part_of(target).exists()


def test_a_failure_leaves_the_old_file_and_no_other(target):
    target.write_bytes(b"old")
    with pytest.raises(RuntimeError, match="encoder"):
        write_output(str(target), failing_chunks(), force=True)
    assert target.read_bytes() == b"old"
    assert os.listdir(target.parent) == ["mesh.ply"]


def test_a_link_keeps_pointing_to_the_file_that_is_replaced(tmp_path, target):
    target.write_bytes(b"old")
    link = tmp_path / "link.ply"
    link.symlink_to(target)
    write_output(str(link), [b"new"], force=True)
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(WriteError, match=r"the folder .*missing does not exist; create it"):
        check_output(str(tmp_path / "missing" / "mesh.ply"), force=False)


def test_a_file_in_place_of_the_folder_is_named(target):
    target.write_bytes(b"")
    with pytest.raises(WriteError, match="is not a folder"):
        check_output(str(target / "mesh.ply"), force=False)


def test_a_folder_in_the_way_is_named(tmp_path):
    with pytest.raises(WriteError, match="is a folder; expected the name of a file"):
        write_output(str(tmp_path), [b""], force=True)


def test_a_refused_permission_is_told_plainly(target, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: False)
    with pytest.raises(WriteError, match="no permission to write there; choose another folder"):
        check_output(str(target), force=False)


def test_a_full_disk_is_named():
    with pytest.raises(WriteError, match=r"/dev/full cannot be written: the disk is full; free some space"):
        write_output("/dev/full", [b"x" * 100_000], force=False)


def test_a_device_needs_no_force():
    assert write_output("/dev/null", [b"abc"], force=False) == 3


def test_a_size_limit_is_named_and_nothing_is_left(target):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    target.write_bytes(b"old")
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, hard))
    try:
        with pytest.raises(WriteError, match="size limit"):
            write_output(str(target), [b"x" * 30_000] * 3, force=True)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert target.read_bytes() == b"old"
    assert os.listdir(target.parent) == ["mesh.ply"]


def test_a_name_too_long_for_the_disk_is_named(tmp_path):
    with pytest.raises(WriteError, match="name is too long"):
        write_output(str(tmp_path / ("x" * 252 + ".ply")), [b""], force=False)


def test_what_a_killed_run_left_is_taken_over(target):
    part_of(target).write_bytes(b"much longer than the new output")
    write_output(str(target), [b"new"], force=False)
    assert target.read_bytes() == b"new"
    assert os.listdir(target.parent) == ["mesh.ply"]


def test_a_link_in_the_place_of_the_temporary_file_is_not_followed(tmp_path, target):
    victim = tmp_path / "victim"
    victim.write_bytes(b"precious")
    part_of(target).symlink_to(victim)
    with pytest.raises(WriteError):
        write_output(str(target), [b"new"], force=False)
    assert victim.read_bytes() == b"precious"


def test_a_system_that_knows_no_links_writes_all_the_same(target, monkeypatch):
    monkeypatch.delattr(os, "O_NOFOLLOW")
    write_output(str(target), [b"new"], force=False)
    assert target.read_bytes() == b"new"


def test_two_runs_to_one_output_do_not_mix(target):
    with part_of(target).open("wb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(WriteError, match="being written by another run"):
            write_output(str(target), [b"new"], force=True)
    assert not target.exists()


def test_a_part_renamed_under_us_is_never_truncated(target, monkeypatch):
    """Another run renames its temporary file to the output between our opening and our locking it."""
    part_of(target).write_bytes(b"the other run's mesh")
    flock = fcntl.flock

    def rename_first(descriptor, operation):
        if part_of(target).exists() and not target.exists():
            part_of(target).rename(target)
        flock(descriptor, operation)

    monkeypatch.setattr(fcntl, "flock", rename_first)
    with pytest.raises(WriteError, match="exists already"), open_output(str(target), force=False) as stream:
        stream.write(b"ours")
    assert target.read_bytes() == b"the other run's mesh"
    assert not part_of(target).exists()


def test_a_killed_run_leaves_one_part_and_the_old_file(target):
    target.write_bytes(b"old")
    with subprocess.Popen([sys.executable, "-c", SLOW_WRITER, str(target)], stdout=subprocess.PIPE) as run:
        run.stdout.readline()
        time.sleep(0.05)
        run.send_signal(signal.SIGKILL)
    assert target.read_bytes() == b"old"
    assert sorted(os.listdir(target.parent)) == [".mesh.ply.dmc-part", "mesh.ply"]
    write_output(str(target), [b"new"], force=True)
    assert target.read_bytes() == b"new"
    assert os.listdir(target.parent) == ["mesh.ply"]


def test_a_disk_that_tells_late_that_it_is_full_leaves_the_old_file(target, monkeypatch):
    """As a network disk does; the file has no new name by then."""
    target.write_bytes(b"old")

    def full(descriptor):
        raise OSError(errno.EDQUOT, "Disk quota exceeded")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(WriteError, match="quota"):
        write_output(str(target), [b"new"], force=True)
    assert target.read_bytes() == b"old"
    assert os.listdir(target.parent) == ["mesh.ply"]


def test_a_disk_that_cannot_be_waited_for_is_written_all_the_same(target, monkeypatch):
    def unknown(descriptor):
        raise OSError(errno.EINVAL, "Invalid argument")

    monkeypatch.setattr(os, "fsync", unknown)
    write_output(str(target), [b"new"], force=True)
    assert target.read_bytes() == b"new"


def test_on_windows_a_part_that_is_not_wanted_is_removed(target, monkeypatch):
    monkeypatch.setattr(atomic, "fcntl", None)

    def unlink(part, *, missing_ok):
        assert stream.closed  # Windows removes closed files only
        os.remove(part)

    monkeypatch.setattr(Path, "unlink", unlink)
    with pytest.raises(KeyboardInterrupt), open_output(str(target), force=False) as stream:
        stream.write(b"ours")
        raise KeyboardInterrupt
    assert os.listdir(target.parent) == []


def test_standard_output_without_a_buffer_is_written_as_a_whole_or_missed(tmp_path, monkeypatch):
    """The system writes as much as there is room for and raises nothing; `python -u` hands that on."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    with (tmp_path / "out").open("wb", buffering=0) as raw:
        monkeypatch.setattr(sys, "stdout", SimpleNamespace(buffer=raw))
        write_output(STREAM, [b"01234", b"56789"], force=False)
        resource.setrlimit(resource.RLIMIT_FSIZE, (15, limits[1]))
        try:
            with pytest.raises(WriteError, match="standard output"):
                write_output(STREAM, [b"0123456789"], force=False)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert not raw.closed
    assert (tmp_path / "out").read_bytes() == b"012345678901234"
