"""Decode streams of bytes: raw, gzip and zlib, bzip2, xz, zstd, decimal text, hexadecimal digits.

Each generator yields the bytes in pieces of bounded size and simply ends where the file ends; who
reads knows how many bytes were promised. Nothing is decoded beyond what is taken.
"""

from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any, BinaryIO

import numpy as np
from isal import isal_zlib

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.volume_io.layout import Encoding

CHUNK = 1 << 20
"""Bytes that are read or decoded at a time: large enough to be fast, small enough to stay in the cache."""

GZIP_MAGIC = b"\x1f\x8b"
BZIP2_MAGIC = b"BZh"
XZ_MAGIC = b"\xfd7zXZ\0"
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"

MOST_DICTIONARY = 1 << 27
"""Bytes that xz may take for its dictionary."""

DEFLATE_RATIO = 1040
"""Bytes that a deflated byte unpacks to, at most: the limit is 1032; what claims more is a bomb."""

BZIP2_RATIO = 1_200_000
"""The same of bzip2: one block of 46 bytes holds up to 45 MB of one value."""

XZ_RATIO, ZSTD_RATIO = 10_000, 50_000
"""The same of xz, and of zstd, whose blocks of one value take 4 bytes for 128 KiB."""

LARGEST_RATIO: dict[Encoding, float] = {
    "raw": 1,
    "gzip": DEFLATE_RATIO,
    "bzip2": BZIP2_RATIO,
    "xz": XZ_RATIO,
    "zstd": ZSTD_RATIO,
    "text": 4.5,
    "hex": 0.5,
}
"""Decoded bytes a stored byte, at most: text needs a digit and a separator for up to 8 bytes (the last one
no separator). A file that is shorter than its promised size allows is refused before memory is taken."""


_MISSING = 'backports.zstd is not installed; pip install "dmc-cli[zstd]" or pip install backports.zstd'


class DecodedStream:
    """The decoded bytes of one file, taken piece by piece into memory that exists already."""

    def __init__(self, name: str, file: BinaryIO, encoding: Encoding, dtype: np.dtype[Any]) -> None:
        """Read `file` from where it stands; `dtype` is what text is converted to.

        Raises:
            UnsupportedFormatError: The package that decodes it is missing.
        """
        if encoding == "zstd" and not _knows_zstd():
            raise UnsupportedFormatError(f"{name}: values packed by zstd found, but {_MISSING}")
        self._name = name
        self._chunks = _decoders[encoding](file, dtype)
        self._rest = memoryview(b"")

    def fill(self, target: memoryview) -> int:
        """Put the next bytes into `target`; fewer than its length only where the stream ends.

        Raises:
            DamagedVolumeError: The stream cannot be decoded.
        """
        filled = 0
        while filled < len(target):
            if not self._next():
                break
            taken = min(len(self._rest), len(target) - filled)
            target[filled : filled + taken] = self._rest[:taken]
            self._rest = self._rest[taken:]
            filled += taken
        return filled

    def read(self, count: int) -> bytes:
        """Return the next bytes; fewer than `count` only where the stream ends.

        Raises:
            DamagedVolumeError: The stream cannot be decoded.
        """
        pieces = []  # a header is far shorter than the longest that is looked for
        while count > 0 and self._next():
            pieces.append(self._rest[:count])
            self._rest = self._rest[count:]
            count -= len(pieces[-1])
        return b"".join(pieces)

    def skip(self, count: int) -> int:
        """Drop the next bytes; returns how many there were, at most `count`."""
        skipped = 0
        while skipped < count and self._next():
            taken = min(len(self._rest), count - skipped)
            self._rest = self._rest[taken:]
            skipped += taken
        return skipped

    def check_end(self) -> None:
        """Take one more piece, so that a checksum that follows the last value is compared."""
        self._next()

    def _next(self) -> bool:
        """Have bytes in hand; False at the end of the stream."""
        while not len(self._rest):
            try:
                piece = next(self._chunks, None)
            except (ValueError, OSError, EOFError, OverflowError) as error:
                raise DamagedVolumeError(
                    f"{self._name}: the values cannot be decoded ({error}); get the file again"
                ) from error
            except Exception as error:
                # zlib.error and isal's own error share no base class but Exception
                raise DamagedVolumeError(
                    f"{self._name}: the compressed values are damaged ({error}); get the file again"
                ) from error
            if piece is None:
                return False
            self._rest = memoryview(piece)
        return True


def _raw_chunks(file: BinaryIO, _: np.dtype[Any]) -> Iterator[bytes]:
    while piece := file.read(CHUNK):
        yield piece


def new_inflater(wbits: int) -> Any:
    """Return a decompressor of isal for one gzip (31) or zlib (15) stream: twice as fast as Python's own."""
    return isal_zlib.decompressobj(wbits=wbits)


def _new_bunzipper() -> Any:
    import bz2

    return bz2.BZ2Decompressor()


def _new_unxz() -> Any:
    import lzma

    return lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=MOST_DICTIONARY)


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


def _new_unzstd() -> Any:
    try:
        from compression import zstd  # from Python 3.14 on
    except ImportError:
        from backports import zstd
    return zstd.ZstdDecompressor()


def _gzip_chunks(file: BinaryIO, _: np.dtype[Any]) -> Iterator[bytes]:
    """Decompress gzip members or one zlib stream, piece by piece; bytes behind the last are ignored."""
    pending = file.read(CHUNK)
    first = True
    while pending and (first or pending.startswith(GZIP_MAGIC)):
        first = False
        inflater = new_inflater(31 if pending.startswith(GZIP_MAGIC) else 15)
        while not inflater.eof:
            piece = inflater.decompress(pending, CHUNK)
            pending = inflater.unconsumed_tail
            if piece:
                yield piece
            if not pending and not inflater.eof:
                pending = file.read(CHUNK)
                if not pending:
                    return
        pending = inflater.unused_data or file.read(CHUNK)
        if len(pending) < len(GZIP_MAGIC):
            pending += file.read(CHUNK)


def _chunks_by(
    new_unpacker: Callable[[], Any], begins: bytes
) -> Callable[[BinaryIO, np.dtype[Any]], Iterator[bytes]]:
    """Return a generator of what streams that begin so unpack to; bytes behind the last are ignored.

    Args:
        new_unpacker: Makes a decompressor of one stream, with the methods of Python's bz2.
        begins: The first bytes of a stream.
    """

    def chunks(file: BinaryIO, _: np.dtype[Any]) -> Iterator[bytes]:
        pending = file.read(CHUNK)
        first = True
        while pending and (first or pending.startswith(begins)):
            first = False
            unpacker = new_unpacker()
            while not unpacker.eof:
                if unpacker.needs_input and not pending:
                    pending = file.read(CHUNK)
                    if not pending:
                        return
                piece = unpacker.decompress(pending, CHUNK)
                pending = b""
                if piece:
                    yield piece
            pending = unpacker.unused_data or file.read(CHUNK)
            if len(pending) < len(begins):
                pending += file.read(CHUNK)

    return chunks


def _text_chunks(file: BinaryIO, dtype: np.dtype[Any]) -> Iterator[bytes]:
    """Parse decimal numbers between white space or commas, and yield them as bytes of `dtype`."""
    number: Callable[[str], Any] = float if dtype.kind == "f" else int
    rest = ""
    while piece := file.read(CHUNK // 4):
        text = rest + piece.decode("ascii").replace(",", " ")
        cut = max(text.rfind(" "), text.rfind("\n"), text.rfind("\t"))
        text, rest = text[: cut + 1], text[cut + 1 :]
        if len(rest) > 64:
            raise ValueError("a number of more than 64 characters")
        yield np.array([number(token) for token in text.split()], dtype).tobytes()
    if rest:
        yield np.array([number(token) for token in rest.split()], dtype).tobytes()


def _hex_chunks(file: BinaryIO, _: np.dtype[Any]) -> Iterator[bytes]:
    """Parse hexadecimal digits, two per byte, with white space anywhere."""
    rest = b""
    while piece := file.read(CHUNK):
        digits = rest + b"".join(piece.split())
        even = len(digits) & ~1
        rest = digits[even:]
        yield bytes.fromhex(digits[:even].decode("ascii"))


_decoders: dict[Encoding, Callable[[BinaryIO, np.dtype[Any]], Iterator[bytes]]] = {
    "raw": _raw_chunks,
    "gzip": _gzip_chunks,
    "bzip2": _chunks_by(_new_bunzipper, BZIP2_MAGIC),
    "xz": _chunks_by(_new_unxz, XZ_MAGIC),
    "zstd": _chunks_by(_new_unzstd, ZSTD_MAGIC),
    "text": _text_chunks,
    "hex": _hex_chunks,
}
