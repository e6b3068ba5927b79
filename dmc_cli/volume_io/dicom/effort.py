"""Bound what the headers of an input take in all: pydicom spends microseconds on each of their pieces.

A zip of a few hundred kilobytes holds millions of pieces, or gigabytes, of zeros. An honest header has a few
hundred elements, and its zip holds some bytes for each.
"""

import io
from typing import Any

from dmc_cli.errors import DamagedVolumeError

FREE_PIECES = 200_000
"""Pieces of headers that any input may have, one to three seconds' worth."""

BYTES_A_PIECE = 4
"""Beyond them, stored bytes per piece: a packed element takes more."""

MOST_PIECES = 4_000_000
"""Most pieces of one file: an enhanced image of 20 000 frames has fewer."""

FREE_BYTES = 1 << 30
"""Bytes of headers that any input may unpack to; beyond them `LARGEST_RATIO` a stored byte."""

LARGEST_RATIO = 100
"""Bytes of a slice a byte of its zip, on the average of an input whose headers are long."""


class TooMuchError(DamagedVolumeError):
    """A header, or all headers of an input, would take too long."""


class Effort:
    """What is left of pieces and bytes for the headers of an input that has so many stored bytes."""

    def __init__(self, stored: int) -> None:
        self._pieces = FREE_PIECES + stored // BYTES_A_PIECE
        self._bytes = FREE_BYTES + LARGEST_RATIO * stored

    def take_piece(self) -> None:
        """Count one piece.

        Raises:
            TooMuchError: None is left.
        """
        self._pieces -= 1
        if self._pieces < 0:
            raise TooMuchError("the headers have more pieces than images can have")

    def take_pieces(self, count: int) -> None:
        """Count pieces that were passed.

        Raises:
            TooMuchError: Not as many were left.
        """
        self._pieces -= count - 1
        self.take_piece()

    def take_bytes(self, count: int) -> None:
        """Count bytes that are unpacked.

        Raises:
            TooMuchError: Not as many are left.
        """
        self._bytes -= count
        if self._bytes < 0:
            raise TooMuchError("the headers unpack to more bytes than those of images")


class PiecewiseStream(io.RawIOBase):
    """A file that pydicom reads piece by piece, each counted, and never as a whole.

    pydicom unpacks a deflated file as a whole, whatever comes out of it.
    """

    def __init__(self, file: Any, effort: Effort) -> None:
        self._file = file
        self._effort = effort
        self._left = MOST_PIECES

    def read(self, size: int = -1) -> bytes:
        """Return so many bytes, or fewer at the end."""
        if size is None or size < 0:
            raise DamagedVolumeError("its meta elements cannot be read")
        self._left -= 1
        if self._left < 0:
            raise TooMuchError("the header has more pieces than an image's can have")
        self._effort.take_piece()
        content: bytes = self._file.read(size)
        return content

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Do as the file does."""
        place: int = self._file.seek(offset, whence)
        return place

    def tell(self) -> int:
        """Do as the file does."""
        place: int = self._file.tell()
        return place
