"""Unpack compressed pieces no further than they should, or find out before what they unpack to.

zlib, gzip, bzip2 and lzma tell nothing: such a piece is unpacked until it ends or passes its limit. zstd,
blosc and lz4 tell it in their headers, and libraries allocate what these tell.
"""

from collections.abc import Callable
from typing import Any

from dmc_cli.volume_io.decoding import BZIP2_RATIO, CHUNK, DEFLATE_RATIO, GZIP_MAGIC, new_inflater

Buffer = bytes | bytearray | memoryview

SLACK = 1 << 26
"""Bytes more than expected that do no harm: pieces that cannot unpack to more are not looked at."""

_RATIOS = {"zlib": DEFLATE_RATIO, "gzip": DEFLATE_RATIO, "bz2": BZIP2_RATIO, "lzma": 10_000}
"""Unpacked bytes a packed byte, at most, of what has to be unpacked to be known."""

_SEVERAL = {"gzip": GZIP_MAGIC, "bz2": b"BZh", "lzma": b"\xfd7zXZ"}
"""Packers whose streams may follow one another, and how each begins."""

_LZMA_MEMORY = 1 << 29
"""Bytes that lzma may take for its dictionary."""

_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_ZSTD_SKIPPED = range(0x184D2A50, 0x184D2A60)
"""Magic numbers of frames that hold no values, RFC 8878, 3.1.2."""

_ZSTD_BLOCK = 1 << 17
"""Most bytes of a block, RFC 8878, 3.1.1.2.3."""


def passes(codec: str, content: Buffer, expected: int) -> bool:
    """Return whether a piece of one of the known codecs unpacks to far more bytes than expected.

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


def unpacked(codec: str, content: Buffer, most: int, **options: Any) -> bytes:
    """Return what a piece of zlib, gzip, bz2 or lzma unpacks to.

    Args:
        codec: Which of them.
        content: The piece.
        most: Bytes that it may unpack to.
        options: Those of lzma.LZMADecompressor.

    Raises:
        ValueError: It unpacks to more, or has no end.
        Exception: It is damaged; each unpacker has an error of its own.
    """
    rest = memoryview(content).cast("B")
    pieces: list[bytes] = []
    while not pieces or bytes(rest[:5]).startswith(_SEVERAL.get(codec, b"none")):
        unpacker = _unpackers[codec](**options)
        most -= sum(map(len, pieces[-1:]))
        piece = unpacker.decompress(rest, most + 1)
        if len(piece) > most:
            raise ValueError("more bytes than expected")
        if not unpacker.eof:
            raise ValueError("the end is missing")
        pieces.append(piece)
        rest = memoryview(unpacker.unused_data)
    return b"".join(pieces)


def told_size(codec: str, content: Buffer) -> int:
    """Return how many bytes a piece of zstd, blosc or lz4 says that it unpacks to."""
    return _TOLD[codec](content)


def _streamed(new_unpacker: Callable[[], Any], content: Buffer, limit: int) -> bool:
    """Return whether more than `limit` bytes come out, stream after stream."""
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


def _new_unlzma(**options: Any) -> Any:
    import lzma

    is_raw = options.get("format") == lzma.FORMAT_RAW
    return lzma.LZMADecompressor(
        format=lzma.FORMAT_RAW if is_raw else lzma.FORMAT_AUTO,
        memlimit=None if is_raw else _LZMA_MEMORY,
        filters=options.get("filters") if is_raw else None,
    )


_unpackers: dict[str, Callable[..., Any]] = {
    "zlib": lambda: new_inflater(15),
    "gzip": lambda: new_inflater(31),
    "bz2": _new_bunzipper,
    "lzma": _new_unlzma,
}


def _zstd_size(content: Buffer) -> int:
    """Return the sum of what the frames tell (RFC 8878, 3.1.1.1), or of the most that their blocks hold."""
    total = position = 0
    while True:
        magic = content[position : position + 4]
        if int.from_bytes(magic, "little") in _ZSTD_SKIPPED:
            position += 8 + int.from_bytes(content[position + 4 : position + 8], "little")
        elif magic == _ZSTD_MAGIC:
            size, position = _zstd_frame(content, position + 4)
            total += size
        else:  # the end, or what a decoder refuses
            return total


def _zstd_frame(content: Buffer, position: int) -> tuple[int, int]:
    """Return what a frame unpacks to at most, and where it ends."""
    flags = content[position]
    single = flags >> 5 & 1
    position += 1 + (1 - single) + (0, 1, 2, 4)[flags & 3]
    width = (single, 2, 4, 8)[flags >> 6]
    told = int.from_bytes(content[position : position + width], "little") + (256 if width == 2 else 0)
    position += width
    held, last = 0, False
    while not last and position + 3 <= len(content):
        head = int.from_bytes(content[position : position + 3], "little")
        last, kind, size = bool(head & 1), head >> 1 & 3, head >> 3
        held += size if kind < 2 else _ZSTD_BLOCK
        position += 3 + (1 if kind == 1 else size)
    return told if width else held, position + 4 * (flags >> 2 & 1)


_TOLD: dict[str, Callable[[Buffer], int]] = {
    "zstd": _zstd_size,
    "blosc": lambda content: int.from_bytes(content[4:8], "little"),
    "lz4": lambda content: int.from_bytes(content[:4], "little"),
}
"""Codecs whose pieces tell the size: blosc in bytes 4 to 7 of its header, numcodecs' lz4 in front."""
