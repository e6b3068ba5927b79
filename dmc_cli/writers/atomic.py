"""A file that appears complete or not at all.

The bytes go to one temporary file of a fixed name in the same folder, `.NAME.dmc-part`, which is
locked and at the end renamed to NAME, when the disk has it: neither a power cut nor a network disk that
tells late that it is full leaves a NAME with a hole. A run that is killed leaves at most that file; the
lock dies with the run, so the next run to the same output takes the file over. What exists already is only
replaced where the caller says so, and only by the rename. `-` and devices are written directly.
"""

import errno
import os
import stat
import sys
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from dmc_cli.errors import WriteError
from dmc_cli.settings import STREAM

try:
    import fcntl
except ImportError:  # Windows: without a lock two runs to one output at the same time would collide
    fcntl = None  # type: ignore[assignment]

_REASONS = {
    errno.ENOSPC: "the disk is full; free some space, or write to another folder",
    errno.EDQUOT: "the disk quota is used up; free some space, or write to another folder",
    errno.EFBIG: "the file would pass the size limit set for it; raise it (ulimit -f), or write elsewhere",
    errno.EACCES: "no permission to write there; choose another folder, or change its permissions",
    errno.EPERM: "no permission to write there; choose another folder, or change its permissions",
    errno.EROFS: "the disk is read-only; choose another folder",
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
    target = _real(path)
    if target.is_dir():
        raise WriteError(
            f"{path} is a folder; expected the name of a file in it, for example {target.name}/mesh.ply"
        )
    folder = target.parent
    if not folder.is_dir():
        found = "is not a folder" if folder.exists() else "does not exist"
        raise WriteError(
            f"{path} cannot be written: the folder {folder} {found}; create it, or choose another"
        )
    if _is_device(target):
        return
    if target.exists() and not force:
        raise WriteError(
            f"{path} exists already; expected a new name; choose another, or overwrite it with --force"
        )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise write_error(path, OSError(errno.EACCES, "Permission denied"))


def write_output(path: str, chunks: Iterable[bytes], *, force: bool) -> int:
    """Write chunks of bytes to a file, completely or not at all.

    Returns:
        The number of bytes.

    Raises:
        WriteError: As `check_output`, or the disk is full.
    """
    size = 0
    # a thread writes one chunk while the next one is made; the system call releases the GIL
    with open_output(path, force=force) as stream, ThreadPoolExecutor(max_workers=1) as writer:
        pending: Future[int] | None = None
        for chunk in chunks:
            if pending is not None:
                pending.result()
            pending = writer.submit(stream.write, chunk)
            size += len(chunk)
        if pending is not None:
            pending.result()
    return size


@contextmanager
def open_output(path: str, *, force: bool) -> Iterator[BinaryIO]:
    """Open a binary stream whose bytes become the file `path` when the context ends without an error.

    Raises:
        WriteError: As `check_output`, or the disk is full, or another run is writing the same file.
    """
    check_output(path, force=force)
    try:
        if path == STREAM:
            yield sys.stdout.buffer
            sys.stdout.buffer.flush()
        elif _is_device(_real(path)):
            with _real(path).open("wb") as stream:
                yield stream
        else:
            with _part_file(path, force=force) as stream:
                yield stream
    except WriteError:
        raise
    except OSError as error:
        raise write_error(path, error) from error


@contextmanager
def _part_file(path: str, *, force: bool) -> Iterator[BinaryIO]:
    """Open the locked temporary file of `path`; rename it at the end, or remove it on any exception."""
    target = _real(path)
    part = target.with_name(f".{target.name}.dmc-part")
    with os.fdopen(_open_locked(part, path), "wb") as stream:
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


def _open_locked(part: Path, path: str) -> int:
    """Open the temporary file, empty and locked; one that a killed run left behind is taken over."""
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    while True:
        descriptor = os.open(part, flags, 0o666)
        try:
            if fcntl is not None:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # the run that held the lock before may have renamed this very file to its output
            if _is_same_file(descriptor, part):
                os.ftruncate(descriptor, 0)
                return descriptor
        except BlockingIOError as error:
            os.close(descriptor)
            raise WriteError(
                f"{path} is being written by another run; expected to be the only one; wait for it to end"
            ) from error
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)


def _remove_ours(part: Path, stream: BinaryIO) -> None:
    """Remove the temporary file, unless its name meanwhile belongs to another run."""
    if stream.closed or _is_same_file(stream.fileno(), part):
        part.unlink(missing_ok=True)


def _is_same_file(descriptor: int, path: Path) -> bool:
    """Whether an open file is the one that stands under a path."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _is_device(target: Path) -> bool:
    """Whether this is a device or a pipe, which is written directly and cannot be replaced."""
    try:
        mode = target.stat().st_mode
    except OSError:
        return False
    return stat.S_ISCHR(mode) or stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)


def _real(path: str) -> Path:
    """Follow links: the file that a link names is replaced, not the link."""
    return Path(path).resolve()


def write_error(path: str, error: OSError) -> WriteError:
    """Say what went wrong with the output, and that nothing was left behind."""
    name = "standard output" if path == STREAM else path
    reason = _REASONS.get(error.errno or 0, f"{error.strerror or error}; choose another place")
    return WriteError(f"{name} cannot be written: {reason}")
