"""Take a stream, standard input or what is unpacked, as a file.

No more of it than its header asks for, and than the disk holds.
"""

import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from dmc_cli.errors import VolumeError
from dmc_cli.settings import STREAM

START_BYTES = 1 << 20
"""How much is read before its header is asked how long it is; no header is longer."""

PIECE_BYTES = 1 << 26
"""How much is copied before the disk is asked again."""

LEAST_FREE, MOST_FREE = 0.05, 1 << 30
"""What is left free: a part of the disk, but no more bytes than that."""


@contextmanager
def spooled(
    read: Callable[[int], bytes], file_name: str, name: str, promised: Callable[[Path], int | None]
) -> Iterator[Path]:
    """Give a temporary file with what a stream holds, in a folder of its own, gone at the end.

    Args:
        read: Takes a number of bytes; returns the next ones, fewer only at the end.
        file_name: What the file is called.
        name: The input, for messages.
        promised: Takes a file with its first bytes; tells the most bytes that are needed, or None.

    Raises:
        VolumeError: It cannot be read, or has no end.
    """
    with tempfile.TemporaryDirectory() as folder, Path(folder, file_name).open("wb") as file:
        path = Path(file.name)
        try:
            copied = file.write(read(START_BYTES))
            file.flush()
            most = promised(path) if copied == START_BYTES else copied
            while most is None or copied < most:
                check_disk(path, copied, name)
                count = PIECE_BYTES if most is None else min(PIECE_BYTES, most - copied)
                piece = read(count)
                if not piece:
                    break
                copied += file.write(piece)
            file.flush()
        except OSError as error:
            raise VolumeError(f"{_what(name)} cannot be read ({error}); give a file") from error
        yield path


def _what(name: str) -> str:
    """Return what a message calls the stream."""
    return f"{name}: standard input" if name == STREAM else f"{name}: what is packed there"


def check_disk(path: Path, copied: int, name: str = STREAM) -> None:
    """Raise VolumeError where the next piece would fill the disk."""
    disk = shutil.disk_usage(path.parent)
    if disk.free - PIECE_BYTES < min(LEAST_FREE * disk.total, MOST_FREE):
        raise VolumeError(
            f"{_what(name)} has no end after {copied >> 20} MiB, and {path.parent} has "
            f"{disk.free >> 20} MiB left; expected a volume; give a file"
        )
