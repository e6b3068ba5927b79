"""Find the resolution that a PNG, BMP or JPEG 2000 image tells: dots a metre, as those formats have it.

That of a JPEG is one of print, in whole dots, and JPEG 2000's "display resolution" one of screens: neither is
looked at. JPEG 2000's boxes are those of ISO/IEC 15444-1, annex I.
"""

import struct
from typing import Any

from dmc_cli.volume_io.told_lengths import ToldLengths, resolution_lengths

_METRE = 1000.0
_PILLOW_INCHES = {"PNG": 1 / 0.0254, "BMP": 39.3701}
"""Inches a metre by which Pillow makes dots per inch of those per metre."""

_LARGEST_BOX = 1 << 16
"""Bytes of a JPEG 2000 file in which the boxes before the image are looked for."""


def image_lengths(image: Any) -> ToldLengths | None:
    """Return the lengths that an image of Pillow's tells by its resolution, or None."""
    inches, dots = _PILLOW_INCHES.get(str(image.format)), image.info.get("dpi")
    if inches is None or dots is None:
        return None
    x, y = (round(float(n) * inches) for n in dots)
    return resolution_lengths(x, y, _METRE, f"the {image.format}")


def jpeg_2000_lengths(content: bytes) -> ToldLengths | None:
    """Return the lengths of the resolution at which a JPEG 2000 image was captured, or None."""
    box = content[:_LARGEST_BOX]
    for name in (b"jp2h", b"res ", b"resc"):
        found = _box(box, name)
        if found is None:
            return None
        box = found
    if len(box) < 10:
        return None
    y_top, y_bottom, x_top, x_bottom, y_power, x_power = struct.unpack_from(">4H2b", box)
    if not x_bottom or not y_bottom:
        return None
    x, y = x_top / x_bottom * 10.0**x_power, y_top / y_bottom * 10.0**y_power
    return resolution_lengths(x, y, _METRE, "the JPEG 2000")


def _box(content: bytes, name: bytes) -> bytes | None:
    """Return what the first box of a name holds, one after the other being looked at, or None."""
    place = 0
    while place + 8 <= len(content):
        size, kind = struct.unpack_from(">I4s", content, place)
        if kind == name:
            return content[place + 8 : place + size] if size >= 8 else None
        if size < 8:  # the last one, or one of more than 4 GiB: the image
            return None
        place += size
    return None
