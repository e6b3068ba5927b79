"""Write all bytes to a standard stream, or raise."""

import errno
import io
import os
from typing import Any, BinaryIO, cast


def whole_writes(stream: BinaryIO) -> BinaryIO:
    """Return a standard stream that writes all bytes or raises.

    One without a buffer, which `python -u` makes, writes as many as there is room for, and raises nothing.
    """
    raw: object = stream
    return cast(BinaryIO, _WholeWrites(raw)) if isinstance(raw, io.RawIOBase) else stream


class _WholeWrites(io.BufferedIOBase):
    """Writes all bytes to a stream without a buffer, which stays open, and keeps none back."""

    def __init__(self, raw: io.RawIOBase) -> None:
        self._raw = raw

    def writable(self) -> bool:
        """Return whether bytes can be written: always."""
        return True

    def fileno(self) -> int:
        """Return the descriptor of the stream."""
        return self._raw.fileno()

    def write(self, data: Any) -> int:
        """Write all bytes, and return how many they are."""
        rest = memoryview(data).cast("B")
        size = len(rest)
        while rest:
            written = self._raw.write(rest)
            if written is None:
                raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
            rest = rest[written:]
        return size
