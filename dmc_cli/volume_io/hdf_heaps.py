"""Look at the heaps of an HDF5 file, which hold its texts, before HDF5's library does.

In a damaged file it may never come to their end: an item without a number and without a length is where it
is again after it. Source: HDF5 File Format Specification, III.E, Global Heap.
"""

import os
from collections.abc import Iterator
from pathlib import Path

from dmc_cli.errors import DamagedVolumeError

LOOKED_AT = 1 << 24
"""Bytes at the beginning of a file, and at its end, in which heaps are looked for."""

HEAP = b"GCOL\x01\0\0\0"
"""How a heap begins: its name, version 1, three zeros."""

SIGNATURE = b"\x89HDF\r\n\x1a\n"

_ROW = 16
"""Bytes before the items of a heap, and before each item's own."""


def check_heaps(path: Path, name: str) -> None:
    """Refuse a file with a heap that has no end.

    Raises:
        DamagedVolumeError: It has one.
        OSError: The file cannot be read.
    """
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        start = file.read(LOOKED_AT)
        pieces = [start]
        if size > LOOKED_AT:
            file.seek(max(size - LOOKED_AT, LOOKED_AT))
            pieces.append(file.read(LOOKED_AT))
    width = _width_of_lengths(start)
    if any(not _ends(piece, at, width) for piece in pieces for at in _heaps(piece)):
        raise DamagedVolumeError(
            f"{name}: the HDF5 file cannot be read (a heap of texts without an end found); get it again"
        )


def _width_of_lengths(start: bytes) -> int:
    """Return the bytes of a length in a file."""
    if start[:8] != SIGNATURE or len(start) < 16:
        return 8
    width = start[14] if start[8] < 2 else start[10]
    return width if width in (2, 4, 8) else 8


def _heaps(piece: bytes) -> Iterator[int]:
    """Yield where heaps begin."""
    at = piece.find(HEAP)
    while at >= 0:
        yield at
        at = piece.find(HEAP, at + 1)


def _ends(piece: bytes, at: int, width: int) -> bool:
    """Return whether the items of a heap lead to its end, or out of what is looked at."""
    end = min(at + int.from_bytes(piece[at + 8 : at + 8 + width], "little"), len(piece))
    at += _ROW
    while at + _ROW <= end:
        number = int.from_bytes(piece[at : at + 2], "little")
        length = int.from_bytes(piece[at + 8 : at + 8 + width], "little")
        step = length if number == 0 else _ROW + -(-length // 8) * 8
        if step == 0:
            return False
        at += step
    return True
