"""Read what a compressed image says of itself in its first markers, before a decoder believes it.

JPEG and JPEG-LS: the frame header SOFn of ISO/IEC 10918-1, B.2.2, and SOF55 of ISO/IEC 14495-1. JPEG 2000
and HTJ2K: the segment of image and tile size of ISO/IEC 15444-1, A.5.1.
"""

import struct

JPEG_START = b"\xff\xd8"
JPEG_END = b"\xff\xd9"
JPEG_LS_FRAME = b"\xff\xf7"
JPEG_2000_START = b"\xff\x4f\xff\x51"

FRAME_HEADERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC} | {0xF7}
"""The codes of SOFn; the three left out are tables."""

_LONGEST_BOXES = 1 << 16
"""Where a codestream begins at the latest that stands in the boxes of a JP2 file."""


def image_size(stream: bytes) -> tuple[int, int, int] | None:
    """Return the columns, rows and components of a compressed image; None where it does not say."""
    try:
        if stream[:2] == JPEG_START:
            return _jpeg_size(stream)
        begin = stream.find(JPEG_2000_START, 0, _LONGEST_BOXES)
        return None if begin < 0 else _jpeg_2000_size(stream, begin)
    except (struct.error, IndexError):
        return None


def lacks_end(stream: bytes) -> bool:
    """Return whether a JPEG-LS image has no end marker.

    CharLS may then look for one more bit for ten seconds. No marker can be part of packed pixels: after a
    byte of ones the next has a zero in front.
    """
    return stream[:2] == JPEG_START and JPEG_LS_FRAME in stream and JPEG_END not in stream


def _jpeg_size(stream: bytes) -> tuple[int, int, int] | None:
    """Return the size in the first frame header; segments before it are passed over."""
    position = 2
    while True:
        while stream[position] == 0xFF and stream[position + 1] == 0xFF:
            position += 1  # fill bytes
        if stream[position] != 0xFF:
            return None
        code = stream[position + 1]
        if code in FRAME_HEADERS:
            rows, columns, components = struct.unpack_from(">HHB", stream, position + 5)
            return columns, rows, components
        position += 2 + struct.unpack_from(">H", stream, position + 2)[0]


def _jpeg_2000_size(stream: bytes, begin: int) -> tuple[int, int, int]:
    """Return the size of the reference grid less its offset."""
    right, bottom, left, top = struct.unpack_from(">4I", stream, begin + 8)
    (components,) = struct.unpack_from(">H", stream, begin + 40)
    return right - left, bottom - top, components
