"""Read DICOM whose data set is deflated (PS3.5, A.5) as if it were not, no further than is asked for.

pydicom unpacks such a file as a whole, whatever comes out of it.
"""

import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO, cast

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.decoding import CHUNK, DEFLATE_RATIO, new_inflater
from dmc_cli.volume_io.dicom.source import HEAD_BYTES, DicomFile

DEFLATED = "1.2.840.10008.1.2.1.99"
"""Deflated Explicit VR Little Endian."""

SLACK = 1 << 20
"""Bytes by which deflate may make a data set longer, and more."""


@dataclass(frozen=True, eq=False)
class DeflatedFile(DicomFile):
    """The data set of a deflated file as a file of its own, without preamble and meta elements.

    Attributes:
        packed: The file that it is in.
        begin: Where the deflated bytes begin there.
    """

    packed: DicomFile | None = None
    begin: int = 0

    def open(self, most: int | None = None) -> BinaryIO:
        """Open the data set: inflated as far as it is read, no more than `most` bytes of it."""
        assert self.packed is not None
        file = self.packed.open(None if most is None else self.begin + most + SLACK)
        return cast(BinaryIO, _InflatedStream(self.name, file, self.begin))

    def heads(self) -> Iterator[BinaryIO]:
        """Yield the beginning of the data set, then more of it."""
        for limit in HEAD_BYTES:
            with self.open(limit) as stream:
                start = stream.read(limit)
            yield io.BytesIO(start)
            if len(start) < limit:
                return


def inflated_file(packed: DicomFile, begin: int) -> DeflatedFile:
    """Return the data set that is deflated in a file from `begin` on; its size is the most that it can be."""
    size = (packed.size - begin) * DEFLATE_RATIO
    return DeflatedFile(packed.name, packed.path, size, packed.effort, packed=packed, begin=begin)


class _InflatedStream(io.RawIOBase):
    """A deflated part of a file, inflated while it is read; to seek backwards begins anew."""

    def __init__(self, name: str, file: BinaryIO, begin: int) -> None:
        self._name, self._begin, self._file = name, begin, file
        self._rewind()

    def close(self) -> None:
        self._file.close()
        super().close()

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a place counted from the start, or from here."""
        target = offset + (self._position if whence == io.SEEK_CUR else 0)
        if target < self._position:
            self._rewind()
        while self._position < target and self.read(min(CHUNK, target - self._position)):
            pass
        return self._position

    def readinto(self, buffer: object) -> int:
        """Fill a buffer; less only where the stream ends."""
        target = memoryview(buffer).cast("B")  # type: ignore[arg-type]
        filled = 0
        while filled < len(target):
            piece = self._inflate(len(target) - filled)
            if not piece:
                break
            target[filled : filled + len(piece)] = piece
            filled += len(piece)
        self._position += filled
        return filled

    def _rewind(self) -> None:
        self._file.seek(self._begin)
        self._inflater = new_inflater(-15)
        self._pending = b""
        self._position = 0

    def _inflate(self, most: int) -> bytes:
        """Return the next bytes, at most so many; none at the end."""
        while not self._inflater.eof:
            self._pending = self._pending or self._file.read(CHUNK)
            try:
                piece: bytes = self._inflater.decompress(self._pending, most)
            except Exception as error:
                # isal's own error has no base but Exception
                raise DamagedVolumeError(
                    f"{self._name}: the deflated data set is damaged ({error}); get the file again"
                ) from error
            ended = not self._pending
            self._pending = self._inflater.unconsumed_tail
            if piece or ended:
                return piece
        return b""
