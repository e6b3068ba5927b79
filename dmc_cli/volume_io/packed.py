"""Unpack a file that is packed as a whole by gzip, bzip2, xz or zstd, onto the disk and no further.

What a format's reader unpacks by itself is not unpacked here. As much is unpacked as the header asks for,
and never far more than files are packed in: what would be is refused.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.volume_io.decoding import (
    BZIP2_MAGIC,
    GZIP_MAGIC,
    XZ_MAGIC,
    ZSTD_MAGIC,
    DecodedStream,
)
from dmc_cli.volume_io.layout import Encoding
from dmc_cli.volume_io.stream import spooled

MAGICS: dict[Encoding, bytes] = {
    "gzip": GZIP_MAGIC,
    "bzip2": BZIP2_MAGIC,
    "xz": XZ_MAGIC,
    "zstd": ZSTD_MAGIC,
}
"""How each packing begins."""

SUFFIXES: dict[str, Encoding] = {".gz": "gzip", ".bz2": "bzip2", ".xz": "xz", ".zst": "zstd", ".zstd": "zstd"}

FREE_BYTES = 1 << 30
LARGEST_RATIO = 200
"""Bytes that any file may unpack to, and beyond them how many for each of its own."""

MISSING = 'backports.zstd is not installed; pip install "dmc-cli[zstd]" or pip install backports.zstd'


def packing_of(start: bytes) -> Encoding | None:
    """Return what a file that begins so is packed by, or None."""
    return next((packing for packing, magic in MAGICS.items() if start.startswith(magic)), None)


def inner_name(name: str) -> str:
    """Return a file's name without the suffix of a packing."""
    path = Path(name)
    return path.stem if path.suffix.lower() in SUFFIXES else path.name


def unpacked_stream(file: object, packing: Encoding, name: str) -> DecodedStream:
    """Return what a packed file that is open unpacks to, as a stream.

    Raises:
        UnsupportedFormatError: The package that unpacks it is missing.
    """
    if packing == "zstd" and not _knows_zstd():
        raise UnsupportedFormatError(f"{name}: a file packed by zstd found, but {MISSING}")
    return DecodedStream(name, file, packing, np.dtype(np.uint8))  # type: ignore[arg-type]


def _knows_zstd() -> bool:
    """Return whether Python itself, from 3.14 on, or a package unpacks zstd."""
    try:
        return find_spec("compression.zstd") is not None
    except ModuleNotFoundError:
        pass
    try:
        return find_spec("backports.zstd") is not None
    except ModuleNotFoundError:
        return False


@contextmanager
def unpacked_file(
    path: Path, packing: Encoding, name: str, promised: Callable[[Path], int | None]
) -> Iterator[Path]:
    """Give a temporary file with what a packed one holds, gone at the end.

    Args:
        path: The packed file.
        packing: What it is packed by.
        name: The input, for messages.
        promised: Takes a file with its first bytes; tells the most bytes that its header asks for, or None.

    Raises:
        DamagedVolumeError: It cannot be unpacked, or unpacks to far more than its size.
        VolumeError: The disk is too small for it.
    """
    size = path.stat().st_size
    most = FREE_BYTES + LARGEST_RATIO * size
    bomb = DamagedVolumeError(
        f"{name}: {size} bytes of {packing} found that unpack to more than {most}; expected at most "
        f"{LARGEST_RATIO} times their number; unpack the file yourself if that is right"
    )

    def asked(start: Path) -> int:
        needed = promised(start)
        if needed is not None and needed > most:
            raise bomb
        return most + 1 if needed is None else needed

    with path.open("rb") as file:
        stream = unpacked_stream(file, packing, name)
        with spooled(stream.read, inner_name(path.name), name, asked) as spool:
            if spool.stat().st_size > most:
                raise bomb
            yield spool
