"""Tell a file's format from its first bytes."""

import gzip
import zlib
from collections.abc import Callable
from pathlib import Path

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.decoding import GZIP_MAGIC

MGH_TYPES = tuple(bytes((0, 0, 0, code)) for code in (0, 1, 3, 4, 10))

CONTENTS: tuple[tuple[str, Callable[[bytes], bool]], ...] = (
    ("dicom", lambda start: start[128:132] == b"DICM" or start.startswith(b"PK\x03\x04")),
    ("nrrd", lambda start: start.startswith(b"NRRD0")),
    ("nifti", lambda start: start[344:347] in (b"n+1", b"ni1") or start[4:7] in (b"n+2", b"ni2")),
    ("analyze", lambda start: start[:4] in (b"\x5c\x01\0\0", b"\0\0\x01\x5c")),
    ("mgh", lambda start: start[:4] == b"\0\0\0\1" and start[20:24] in MGH_TYPES and start[28] == 0),
    ("minc", lambda start: start[:4] in (b"CDF\x01", b"CDF\x02", b"\x89HDF")),
    ("numpy", lambda start: start.startswith(b"\x93NUMPY")),
    ("tiff", lambda start: start[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")),
    ("meta", lambda start: b"NDims" in start and b"DimSize" in start),
    # DICOM without its preamble begins with an element of group 2 or 8
    ("dicom", lambda start: start[:2] in (b"\x02\0", b"\x08\0")),
)
"""What the first bytes of a format look like, unpacked where they are gzipped."""


def format_of_content(path: Path, name: str) -> str | None:
    """Return the format whose first bytes the file has, or None."""
    return format_of_start(first_bytes(path, name, 4096))


def format_of_start(start: bytes) -> str | None:
    """Return the format that begins so, or None."""
    return next((found for found, test in CONTENTS if test(start)), None)


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
