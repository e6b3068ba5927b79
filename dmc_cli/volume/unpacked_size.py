"""How much a compressed piece unpacks to, found out before a library unpacks it as a whole.

zlib, gzip, bzip2 and lzma tell nothing: such a piece is unpacked bit by bit, and every bit is dropped. zstd,
blosc and lz4 tell it in their headers, and libraries allocate what these tell.
"""

from collections.abc import Callable
from typing import Any

from dmc_cli.volume.decoding import CHUNK, new_inflater

Buffer = bytes | memoryview

SLACK = 1 << 26
"""Bytes more than expected that do no harm: pieces that cannot unpack to more are not looked at."""

_RATIOS = {"zlib": 1040.0, "gzip": 1040.0, "bz2": 1_200_000.0, "lzma": 10_000.0}
"""Unpacked bytes a packed byte, at most, of what has to be unpacked to be known."""

_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_ZSTD_BLOCK = 1 << 17
"""Most bytes of a block, RFC 8878, 3.1.1.2.3."""


def passes(codec: str, content: Buffer, expected: int) -> bool:
    """Whether a piece of one of the known codecs unpacks to far more bytes than expected.

    False for a codec that is not known, and for a piece that is damaged: who unpacks it will tell.
    """
    limit = expected + SLACK
    try:
        if codec in _RATIOS:
            return len(content) * _RATIOS[codec] > limit and _streamed(_unpackers[codec], content, limit)
        return codec in _TOLD and _TOLD[codec](content) > limit
    except Exception:
        # each unpacker has an error of its own
        return False


def _streamed(new_unpacker: Callable[[], Any], content: Buffer, limit: int) -> bool:
    """Whether more than `limit` bytes come out, stream after stream."""
    total = 0
    while content:
        unpacker = new_unpacker()
        while not unpacker.eof:
            piece = unpacker.decompress(content, CHUNK)
            content = getattr(unpacker, "unconsumed_tail", b"")
            total += len(piece)
            if total > limit:
                return True
            if not piece and not content:
                return False
        content = unpacker.unused_data
    return False


def _new_bunzipper() -> Any:
    import bz2

    return bz2.BZ2Decompressor()


def _new_unlzma() -> Any:
    import lzma

    return lzma.LZMADecompressor()


_unpackers: dict[str, Callable[[], Any]] = {
    "zlib": lambda: new_inflater(15),
    "gzip": lambda: new_inflater(31),
    "bz2": _new_bunzipper,
    "lzma": _new_unlzma,
}


def _zstd_size(content: Buffer) -> int:
    """The size in the header of the first frame (RFC 8878, 3.1.1.1), else the most that its blocks hold."""
    if content[:4] != _ZSTD_MAGIC:
        return 0
    flags = content[4]
    single = flags >> 5 & 1
    position = 5 + (1 - single) + (0, 1, 2, 4)[flags & 3]
    width = (single, 2, 4, 8)[flags >> 6]
    if width:
        told = int.from_bytes(content[position : position + width], "little")
        return told + 256 if width == 2 else told
    total, last = 0, False
    while not last and position + 3 <= len(content):
        head = int.from_bytes(content[position : position + 3], "little")
        last, kind, size = bool(head & 1), head >> 1 & 3, head >> 3
        total += size if kind < 2 else _ZSTD_BLOCK
        position += 3 + (1 if kind == 1 else size)
    return total


_TOLD: dict[str, Callable[[Buffer], int]] = {
    "zstd": _zstd_size,
    "blosc": lambda content: int.from_bytes(content[4:8], "little"),
    "lz4": lambda content: int.from_bytes(content[:4], "little"),
}
"""Codecs whose pieces tell the size: blosc in bytes 4 to 7 of its header, numcodecs' lz4 in front."""
