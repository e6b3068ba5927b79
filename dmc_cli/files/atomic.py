"""Write a file that appears complete or not at all.

The bytes go to one temporary file of a fixed name in the same folder, `.NAME.dmc-part`, which is
locked and at the end renamed to NAME, when the disk has it: neither a power cut nor a network disk that
tells late that it is full leaves a NAME with a hole. A run that is killed leaves at most that file; the
lock dies with the run, so the next run to the same output takes the file over. Where a file cannot be locked,
nobody can tell whether another run is at it: what is there is left alone, and the bytes go to a file of
another name. What exists already is only replaced where the caller says so, and only by the rename. `-` and
devices are written directly.
"""

import errno
import os
import stat
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from dmc_cli.errors import WriteError
from dmc_cli.files.streams import whole_writes
from dmc_cli.settings import STREAM
from dmc_cli.stop import check_stop

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

LONGEST_NAME = 255
"""Bytes of a file's name, at most, on all common disks."""

_CANNOT_LOCK = (errno.EINVAL, errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
"""What a disk that knows no locks, as some network disks do, answers."""

_REASONS = {
    errno.ENOSPC: "the disk is full; free some space, or write to another folder",
    errno.EDQUOT: "the disk quota is used up; free some space, or write to another folder",
    errno.EFBIG: "the file would pass the size limit set for it; raise it (ulimit -f), or write elsewhere",
    errno.EACCES: "no permission to write there; choose another folder, or change its permissions",
    errno.EPERM: "no permission to write there; choose another folder, or change its permissions",
    errno.EROFS: "the disk is read-only; choose another folder",
    errno.ELOOP: "links that lead in a circle are in its way; remove them, or choose another name",
    errno.ENAMETOOLONG: "the name is too long for this disk; choose a shorter one",
    errno.EPIPE: "the reader of the output is gone; keep it reading to the end",
}


def check_output(path: str, *, force: bool) -> None:
    """Find out before the work, as far as can be known then, whether `path` can be written.

    Raises:
        WriteError: The file exists and `force` is not set, its folder is missing or cannot be
            written, or the path is a folder.
    """
    if path == STREAM:
        return
    try:
        if not is_device(path):
            _check_place(path, _real(path), force=force)
    except WriteError:
        raise
    except OSError as error:
        raise write_error(path, error) from error
    except ValueError as error:  # a null character
        raise WriteError(f"{path!r} cannot be written: {error}; choose another name") from error


def _check_place(path: str, target: Path, *, force: bool) -> None:
    """Raise unless a file, links followed, can be written as far as its folder tells."""
    if target.is_dir():
        raise WriteError(
            f"{path} is a folder; expected the name of a file in it, for example {Path(path, 'mesh.ply')}"
        )
    folder = target.parent
    if not folder.is_dir():
        found = "is not a folder" if folder.exists() else "does not exist"
        raise WriteError(
            f"{path} cannot be written: the folder {folder} {found}; create it, or choose another"
        )
    if target.exists() and not force:
        raise WriteError(
            f"{path} exists already; expected a new name; choose another, or overwrite it with --force"
        )
    if len(os.fsencode(target.name)) > LONGEST_NAME:
        raise write_error(path, OSError(errno.ENAMETOOLONG, "File name too long"))
    if not os.access(folder, os.W_OK | os.X_OK):
        raise write_error(path, OSError(errno.EACCES, "Permission denied"))


def write_output(path: str, chunks: Iterable[bytes], *, force: bool) -> int:
    """Write chunks of bytes to a file, completely or not at all.

    Returns:
        The number of bytes.

    Raises:
        WriteError: As `check_output`, or the disk is full.
    """
    with open_output(path, force=force) as stream:
        return _fill(stream, chunks)


def write_with_companion(
    path: str, chunks: Iterable[bytes], companion: str, more: Iterable[bytes], *, force: bool
) -> int:
    """Write a file and another one that it names, both or none.

    The companion appears first, when all bytes of both are on the disk: nobody finds a file that names what
    is not there.

    Args:
        path: The file.
        chunks: Its bytes.
        companion: The other one; it is no stream and no device.
        more: Its bytes.
        force: Replace what exists, of both.

    Returns:
        The number of bytes of the file.

    Raises:
        WriteError: As `write_output`, of either; a companion that was not there before is not there then.
    """
    check_output(path, force=force)
    check_output(companion, force=force)
    is_new = not Path(companion).exists()
    try:
        with open_output(path, force=force) as stream:
            size = _fill(stream, chunks)
            stream.flush()
            _wait_for_disk(stream)
            write_output(companion, more, force=force)
    except BaseException:
        if is_new:
            Path(companion).unlink(missing_ok=True)
        raise
    return size


def _fill(stream: BinaryIO, chunks: Iterable[bytes]) -> int:
    """Write chunks to a stream; return the number of bytes.

    A thread writes one while the next one is made: the system call releases the interpreter's lock.
    """
    size = 0
    with ThreadPoolExecutor(max_workers=1) as writer:
        pending: Future[int] | None = None
        begin: Callable[..., Future[int]] = writer.submit
        for chunk in chunks:
            check_stop()
            if pending is not None:
                pending.result()
            try:
                pending = begin(stream.write, chunk)
            except RuntimeError:  # no thread can be started
                begin = _at_once
                pending = begin(stream.write, chunk)
            size += len(chunk)
        if pending is not None:
            pending.result()
    return size


def _at_once(function: Callable[[bytes], int], chunk: bytes) -> Future[int]:
    """Call a function as an executor does that has no threads."""
    done: Future[int] = Future()
    done.set_result(function(chunk))
    return done


@contextmanager
def open_output(path: str, *, force: bool) -> Iterator[BinaryIO]:
    """Open a binary stream whose bytes become the file `path` when the context ends without an error.

    Raises:
        WriteError: As `check_output`, or the disk is full, or another run is writing the same file.
    """
    check_output(path, force=force)
    try:
        if path == STREAM:
            output = whole_writes(sys.stdout.buffer)
            yield output
            output.flush()
        elif is_device(path):
            with Path(path).open("wb") as stream:
                yield stream
        else:
            with _part_file(path, force=force) as stream:
                yield stream
    except WriteError:
        raise
    except OSError as error:
        raise write_error(path, error) from error


def part_of(target: Path) -> Path:
    """Return the temporary file in which a file, links followed, grows."""
    name = f".{target.name}.dmc-part"
    if len(os.fsencode(name)) > LONGEST_NAME:
        name = f".{_digest(target)}.dmc-part"
    return target.with_name(name)


def _digest(target: Path) -> str:
    """Return what stands for a name that is too long to be made longer."""
    import hashlib

    return hashlib.sha256(os.fsencode(target.name)).hexdigest()[:32]


@contextmanager
def _part_file(path: str, *, force: bool) -> Iterator[BinaryIO]:
    """Open the temporary file of `path`, ours alone; rename it at the end, or remove it on any exception."""
    target = _real(path)
    descriptor, part = _open_part(target, path)
    with os.fdopen(descriptor, "wb") as stream:
        try:
            yield stream
            stream.flush()
            _wait_for_disk(stream)
            # another run may have finished in the meantime; under the lock this is certain
            check_output(path, force=force)
            if fcntl is None:
                stream.close()  # Windows renames closed files only
            part.replace(target)
        except BaseException:
            _remove_ours(part, stream)
            raise


def _wait_for_disk(stream: BinaryIO) -> None:
    """Return when the bytes of a file are on its disk, where the disk can tell."""
    try:
        os.fsync(stream.fileno())
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP):
            raise


def _open_part(target: Path, path: str) -> tuple[int, Path]:
    """Open a temporary file for an output, empty and ours alone; return its descriptor and its name."""
    part = part_of(target)
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    while True:
        try:
            descriptor, is_new = os.open(part, flags | os.O_EXCL, 0o666), True
        except FileExistsError:
            descriptor, is_new = os.open(part, flags, 0o666), False
        try:
            is_ours = _lock(descriptor) or is_new
            # the run that held the lock before may have renamed this very file to its output
            if is_ours and _is_same_file(descriptor, part):
                os.ftruncate(descriptor, 0)
                return descriptor, part
        except BlockingIOError as error:
            os.close(descriptor)
            raise WriteError(
                f"{path} is being written by another run; expected to be the only one; wait for it to end"
            ) from error
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)
        if not is_ours:
            import secrets

            part = target.with_name(f".{_digest(target)}-{secrets.token_hex(8)}.dmc-part")


def _lock(descriptor: int) -> bool:
    """Lock a file, and return whether files can be locked on its disk.

    Raises:
        BlockingIOError: Another run has locked it.
    """
    if fcntl is None:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError as error:
        if error.errno not in _CANNOT_LOCK:
            raise
        return False
    return True


def _remove_ours(part: Path, stream: BinaryIO) -> None:
    """Remove the temporary file, unless its name meanwhile belongs to another run."""
    if stream.closed or _is_same_file(stream.fileno(), part):
        if fcntl is None:
            with suppress(OSError):  # what it could not write is not wanted any more
                stream.close()  # Windows removes closed files only
        part.unlink(missing_ok=True)


def _is_same_file(descriptor: int, path: Path) -> bool:
    """Return whether an open file is the one that stands under a path."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def is_device(path: str) -> bool:
    """Return whether this is a device or a pipe, which is written directly and cannot be replaced.

    The path is asked as it is: a link such as `/dev/fd/3` to a pipe without a name leads to no other path.
    """
    try:
        mode = Path(path).stat().st_mode
    except OSError:
        return False
    return stat.S_ISCHR(mode) or stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)


def _real(path: str) -> Path:
    """Follow links: the file that a link names is replaced, not the link.

    Raises:
        OSError: The links lead in a circle.
    """
    try:
        real = Path(path).resolve()
    except RuntimeError as error:  # before Python 3.13
        raise OSError(errno.ELOOP, "Too many levels of symbolic links") from error
    if real.is_symlink():  # since then
        raise OSError(errno.ELOOP, "Too many levels of symbolic links")
    return real


def write_error(path: str, error: OSError) -> WriteError:
    """Say what went wrong with the output, and that nothing was left behind."""
    name = "standard output" if path == STREAM else path
    reason = _REASONS.get(error.errno or 0, f"{error.strerror or error}; choose another place")
    return WriteError(f"{name} cannot be written: {reason}")
