"""Unpack a file that is packed as a whole by gzip, bzip2, xz or zstd, onto the disk and no further.

What a format's reader unpacks by itself is not unpacked here. As much is unpacked as the header asks for,
and never far more than files are packed in: what would be is refused.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.decoding import (
    BZIP2_MAGIC,
    GZIP_MAGIC,
    XZ_MAGIC,
    ZSTD_MAGIC,
    DecodedStream,
)
from dmc_cli.volume_io.layout import FROM_END, Encoding, Layout, check_file
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


def packing_of(start: bytes) -> Encoding | None:
    """Return what a file that begins so is packed by, or None."""
    return next((packing for packing, magic in MAGICS.items() if start.startswith(magic)), None)


def file_packing(path: Path) -> Encoding | None:
    """Return what a file is packed by, as it begins, or None."""
    with path.open("rb") as file:
        return packing_of(file.read(max(map(len, MAGICS.values()))))


def inner_name(name: str) -> str:
    """Return a file's name without the suffix of a packing."""
    path = Path(name)
    return path.stem if path.suffix.lower() in SUFFIXES else path.name


def unpacked_stream(file: object, packing: Encoding, name: str) -> DecodedStream:
    """Return what a packed file that is open unpacks to, as a stream.

    Raises:
        UnsupportedFormatError: The package that unpacks it is missing.
    """
    return DecodedStream(name, file, packing, np.dtype(np.uint8))  # type: ignore[arg-type]


def packed_layout(layout: Layout, path: Path) -> Layout:
    """Return a layout with the packing that its files have, whatever its header says of it.

    Values may begin with whatever. So those in a file of their own are packed where its suffix says so, too,
    or where it is too short for them.

    Args:
        layout: As a reader gives it.
        path: The header's file.

    Raises:
        VolumeError: The first file is not there.
        DamagedVolumeError: The header counts lines, or from the end, in what is packed.
    """
    first = layout.files[0]
    label = layout.name if first.name == Path(layout.name).name else f"{layout.name} ({first.name})"
    size = check_file(first, label)
    packing = file_packing(first)
    if packing in (None, layout.encoding) or layout.encoding not in ("raw", *MAGICS):
        return layout
    is_told = SUFFIXES.get(first.suffix.lower()) == packing
    is_short = size * len(layout.files) < layout.volume_bytes * layout.volumes
    if layout.encoding == "raw" and not (first == path or is_told or is_short):
        return layout
    if layout.line_skip or layout.offset == FROM_END:
        raise DamagedVolumeError(
            f"{label}: values found that are packed by {packing}, and a header that skips lines of them or "
            "counts from their end; expected a number of bytes to skip; unpack the file"
        )
    return replace(layout, encoding=packing, start=0, offset=layout.offset + layout.start)


@contextmanager
def plain_file(path: Path, name: str, most: int | None = None) -> Iterator[Path]:
    """Give a file with what a path holds, its first `most` bytes or all: itself, or a temporary one.

    Raises:
        DamagedVolumeError: It is packed and cannot be unpacked.
        UnsupportedFormatError: The package that unpacks it is missing.
    """
    packing = file_packing(path)
    if packing is None:
        yield path
        return
    with unpacked_file(path, packing, name, lambda _: most) as plain:
        yield plain


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
