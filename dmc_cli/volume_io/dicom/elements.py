"""Read single elements of a DICOM header, from the bytes that pydicom found, without its conversions.

A slice needs some twenty of hundreds of elements. Converting them here costs a tenth of pydicom's own
conversion and gives no warnings on values that break the standard's rules but are clear.
"""

import io
import math
import struct
import warnings
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.dicom.effort import Effort, PiecewiseStream
from dmc_cli.volume_io.dicom.makers import KINDS
from dmc_cli.volume_io.dicom.source import DicomFile

IMPLICIT = "1.2.840.10008.1.2"
EXPLICIT = "1.2.840.10008.1.2.1"
BIG_ENDIAN = "1.2.840.10008.1.2.2"
RLE = "1.2.840.10008.1.2.5"
"""Transfer syntaxes."""

PIXEL_DATA = 0x7FE00010
FLOAT_PIXEL_DATA = 0x7FE00008
DOUBLE_PIXEL_DATA = 0x7FE00009

PIECES_AN_ITEM = 5000
"""More pieces of a header than the item of any frame has."""

SHARED_BYTES = 64
"""Values that are no longer are converted once for all files that have them."""

FEW_BYTES = 1 << 16
"""A sequence of so few is not worth counting."""

_BINARY = {"US": "H", "SS": "h", "UL": "I", "SL": "i", "FD": "d", "FL": "f"}

_UNTOLD = {
    **dict.fromkeys((0x00189079, 0x00189082, 0x00189087, 0x00189089, 0x00189090, 0x00209153), "FD"),
    **dict.fromkeys((0x00209251, 0x00209255, 0x00209301, 0x00209302, 0x0020930D), "FD"),
    **dict.fromkeys((0x00209241, 0x00209245), "FL"),
    **dict.fromkeys((0x00209128, 0x00209157), "UL"),
    **dict.fromkeys((0x00209156, 0x00283002, 0x00620004, 0x0062000B, 0x0062000E), "US"),
    **dict.fromkeys((0x00540010, 0x00540020, 0x00540030, 0x00540060, 0x00540070, 0x00540080), "US"),
    **dict.fromkeys((0x00540050, 0x00540090, 0x00540100), "US"),
    **{tag: kind for tag, kind in KINDS.items() if kind in _BINARY},
}
"""Binary elements that are asked for their numbers: with implicit VR a file does not tell what they are."""


@dataclass(frozen=True, eq=False)
class Header:
    """A file's elements before its pixel data.

    Attributes:
        file: The file.
        dataset: pydicom's data set, unconverted.
        syntax: UID of the transfer syntax.
        pixel_start: Where the pixel data's element begins in the file, or None where there is none.
    """

    file: DicomFile
    dataset: Any
    syntax: str
    pixel_start: int | None


def text(dataset: Any, tag: int) -> str:
    """Return the first value of a text element, empty where it is absent; a tag is group << 16 | element."""
    values = texts(dataset, tag)
    return values[0] if values else ""


def texts(dataset: Any, tag: int) -> list[str]:
    """Return the values of a text element, none where it is absent."""
    value = _value(dataset, tag)
    if isinstance(value, bytes):
        return list((_texts if len(value) <= SHARED_BYTES else _texts.__wrapped__)(value))
    if value is None:
        return []
    if isinstance(value, (list, tuple)) or type(value).__name__ == "MultiValue":
        return [str(item).strip() for item in value]
    return [str(value).strip()]


@lru_cache(maxsize=1 << 12)
def _texts(value: bytes) -> tuple[str, ...]:
    """Return the texts that a value holds; of equal short values the same ones."""
    try:
        told = value.decode("utf-8")
    except UnicodeDecodeError:
        told = value.decode("latin-1")
    return tuple(item.strip(" \0") for item in told.split("\\")) if told else ()


def numbers(dataset: Any, tag: int, count: int | None = None) -> list[float] | None:
    """Return a decimal or binary element's numbers; None where the element is absent or empty.

    Raises:
        DamagedVolumeError: They are no finite numbers, or not `count` of them.
    """
    element = _element(dataset, tag)
    if element is None or element.value is None or len(_as_bytes_or_list(element.value)) == 0:
        return None
    value, kind = element.value, _binary_kind(element, tag)
    try:
        if isinstance(value, bytes):
            packed = kind and ("<" if element.is_little_endian else ">") + kind
            found = list((_numbers if len(value) <= SHARED_BYTES else _numbers.__wrapped__)(value, packed))
        else:
            found = [float(text) for text in texts(dataset, tag)]
    except (ValueError, OverflowError, struct.error) as error:
        raise DamagedVolumeError(f"element {tag:08x} holds {value!r:.60}; expected numbers") from error
    if not all(map(math.isfinite, found)) or (count is not None and len(found) != count):
        wanted = "finite numbers" if count is None else f"{count} finite numbers"
        raise DamagedVolumeError(f"element {tag:08x} holds {value!r:.60}; expected {wanted}")
    return found


@lru_cache(maxsize=1 << 12)
def _numbers(value: bytes, packed: str | None) -> tuple[float, ...]:
    """Return the numbers that a value holds, of text or packed as `struct` has it."""
    if packed:
        return tuple(float(number[0]) for number in struct.iter_unpack(packed, value))
    return tuple(map(float, _texts.__wrapped__(value)))


def label(dataset: Any, tag: int) -> str:
    """Return an element's texts in a line, or its numbers where it is a binary one; else nothing."""
    element = _element(dataset, tag)
    kind = None if element is None else _binary_kind(element, tag)
    try:
        value = numbers(dataset, tag) if kind else None
    except DamagedVolumeError:
        return ""
    # directions are computed for each slice, and differ in their last digits
    digits = 10 if value and len(value) == 1 and kind != "f" else 6
    # a zero has no sign here
    return (
        " ".join(f"{number + 0.0:.{digits}g}" for number in value) if value else "/".join(texts(dataset, tag))
    )


def integer(dataset: Any, tag: int, default: int | None = None, signed: bool = False) -> int | None:
    """Return the value of an integer element of 16 or 32 bits (PS3.5, 6.2: US, SS, UL, SL)."""
    element = _element(dataset, tag)
    value = None if element is None else element.value
    if isinstance(value, bytes):
        if len(value) not in (2, 4):
            return default
        return int.from_bytes(value, "little" if element.is_little_endian else "big", signed=signed)
    if isinstance(value, int):
        if signed and value >= 0x8000 and str(element.VR) == "US":
            return value - 0x10000
        return value
    return default


def tags(dataset: Any, tag: int) -> list[int]:
    """Return the elements that an element points at (PS3.5, 6.2: AT), none where it is absent."""
    found = words(dataset, tag) if isinstance(_value(dataset, tag), bytes) else None
    if found is not None:
        pairs = found[: len(found) // 2 * 2].reshape(-1, 2).tolist()
        return [group << 16 | element for group, element in pairs]
    value = _value(dataset, tag)
    return [] if value is None else [int(item) for item in (value if hasattr(value, "__len__") else [value])]


def words(dataset: Any, tag: int) -> AnyArray | None:
    """Return the 16-bit words of an element (PS3.5, 6.2: OW, US), or None where it is absent."""
    element = _element(dataset, tag)
    value = None if element is None else element.value
    if isinstance(value, bytes):
        order = "<" if element.is_little_endian else ">"
        return np.frombuffer(value[: len(value) // 2 * 2], f"{order}u2").astype(np.uint16)
    return None if value is None else np.atleast_1d(np.asarray(value)).astype(np.uint16)


def kind(dataset: Any, tag: int) -> str:
    """Return the type that a file tells of an element (VR), empty where it tells none."""
    element = _element(dataset, tag)
    return "" if element is None or element.VR is None else str(element.VR)


def content(dataset: Any, tag: int) -> bytes:
    """Return the bytes of an element, none where it is absent or is no element of bytes."""
    value = _value(dataset, tag)
    return value if isinstance(value, bytes) else b""


def items(dataset: Any, tag: int, most: int = 1) -> list[Any]:
    """Return a sequence's first items, `most` of them; empty where it is absent.

    Raises:
        DamagedVolumeError: It cannot be parsed.
    """
    element = _element(dataset, tag)
    if element is None:
        return []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if isinstance(element.value, bytes):
                _parse_items(dataset, tag, element, most)
            value = dataset[tag].value
    except Exception as error:
        # pydicom parses a sequence when it is asked for, and raises what that runs into
        raise DamagedVolumeError(
            f"sequence {tag:08x} cannot be read ({error}); get the file again"
        ) from error
    return list(value)[:most] if type(value).__name__ == "Sequence" else []


def _parse_items(dataset: Any, tag: int, element: Any, most: int) -> None:
    """Put the first items of a sequence that pydicom has not looked at yet in its place, no others."""
    from pydicom.dataelem import DataElement
    from pydicom.filereader import read_sequence_item

    stream: Any = io.BytesIO(element.value)
    if len(element.value) > FEW_BYTES:
        stream = PiecewiseStream(stream, Effort(PIECES_AN_ITEM * most))
    found: list[Any] = []
    while len(found) < most and stream.tell() < len(element.value):
        item = read_sequence_item(stream, element.is_implicit_VR, element.is_little_endian, "latin-1")
        if item is None:
            break
        found.append(item)
    dataset[tag] = DataElement(tag, "SQ", found)


def _binary_kind(element: Any, tag: int) -> str | None:
    """Return how the numbers of a binary element are packed, as `struct` has it; None for one of text."""
    told = "UN" if element.VR is None else str(element.VR)
    return _BINARY.get(_UNTOLD.get(tag, "") if told == "UN" else told)


def _element(dataset: Any, tag: int) -> Any:
    if dataset is None or tag not in dataset:
        return None
    try:
        return dataset.get_item(tag)
    except Exception as error:
        # pydicom looks at an element's type only now, and raises what that runs into
        raise DamagedVolumeError(f"element {tag:08x} cannot be read ({error}); get the file again") from error


def _value(dataset: Any, tag: int) -> Any:
    element = _element(dataset, tag)
    return None if element is None else element.value


def _as_bytes_or_list(value: Any) -> Any:
    return value if isinstance(value, (bytes, list, tuple, str)) else [value]
