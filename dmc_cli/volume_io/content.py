"""Tell a file's format from its first bytes."""

import gzip
import zlib
from pathlib import Path

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_formats import format_of_start
from dmc_cli.volume_io.decoding import GZIP_MAGIC

START = 4096
"""Bytes of a file that are looked at, unpacked."""


def format_of_content(path: Path, name: str) -> str | None:
    """Return the format whose first bytes the file has, or None."""
    return format_of_start(first_bytes(path, name, START))


def first_bytes(path: Path, name: str, count: int) -> bytes:
    """Return the first `count` bytes of a file, unpacked where they are gzipped, or fewer where it ends.

    Raises:
        DamagedVolumeError: What is gzipped there is damaged.
    """
    with path.open("rb") as file:
        start = file.read(count)
    if not start.startswith(GZIP_MAGIC):
        return start
    try:
        with gzip.open(path) as stream:
            return stream.read(count)
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise DamagedVolumeError(
            f"{name}: the gzipped file is damaged at its start ({error}); get the file again"
        ) from error
