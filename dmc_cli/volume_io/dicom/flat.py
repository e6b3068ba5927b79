"""Find the wanted elements of a plain header without pydicom, a window of the file at a time.

Plain is little endian with one frame and, before its pixels, nothing that only pydicom takes apart: no
functional groups, no lookup table, no data of unknown type and length. Nearly every slice is plain. What is
not asked for is not read: private elements may be longer than all else.
"""

import struct
from dataclasses import dataclass
from functools import lru_cache
from typing import BinaryIO

from dmc_cli.volume_io.dicom.elements import FLOAT_PIXEL_DATA
from dmc_cli.volume_io.dicom.wanted import COMPLEX, WANTED

WINDOW = 1 << 13
"""How much of a file is read at a time; most headers are shorter."""

MOST_WINDOWS = 32
"""Longer headers are left to pydicom."""

MOST_BYTES = 1 << 16
"""A longer wanted element is, too."""

FEW_BYTES = 64
"""Elements that are no longer are shared by the files of a series, which agree in most of them."""

UNDEFINED = 0xFFFFFFFF
"""The length of an element that ends with a delimiter."""

ITEM, ITEM_END, SEQUENCE_END = 0xFFFEE000, 0xFFFEE00D, 0xFFFEE0DD
"""What a sequence of undefined length is made of (PS3.5, 7.5)."""

_LONG_FORM = frozenset(
    [b"OB", b"OD", b"OF", b"OL", b"OV", b"OW", b"SQ", b"SV", b"UC", b"UN", b"UR", b"UT", b"UV"]
)

_TAGS = {tag: tag for tag in WANTED}
"""The same number for all files."""

_EXPLICIT = struct.Struct("<HH2sH")
_IMPLICIT = struct.Struct("<HHI")
_LENGTH = struct.Struct("<I")


@dataclass(frozen=True, eq=False)
class FlatElement:
    """An element that was found without pydicom."""

    __slots__ = ("VR", "value")

    value: bytes
    VR: str | None

    @property
    def is_little_endian(self) -> bool:
        """Return what all such elements are."""
        return True


class FlatDataset(dict[int, FlatElement]):
    """The wanted elements of a plain header, looked up as in pydicom's data set."""

    get_item = dict.get


def _element(value: bytes, kind: bytes | None) -> FlatElement:
    return FlatElement(value, None if kind is None else kind.decode("ascii", "replace"))


_shared = lru_cache(maxsize=1 << 12)(_element)


class FlatScanner:
    """Goes through the elements of a file from a place on, none of them twice.

    Attributes:
        count: Elements that were passed.
    """

    def __init__(self, file: BinaryIO, begin: int) -> None:
        self._file = file
        self._left = MOST_WINDOWS
        self._at = self.count = 0
        self._move(begin)

    def begins_with(self, start: bytes) -> bool:
        """Return whether the bytes from the current place on begin so."""
        return self._data.startswith(start, self._at)

    def scan(self, explicit: bool) -> tuple[FlatDataset, int]:
        """Return the wanted elements before the end of group 2 or the pixel data, and where that is; else -1.

        Args:
            explicit: Whether elements tell their types.
        """
        found = FlatDataset()
        is_meta = self.begins_with(b"\x02\x00")
        while self._at + 12 <= len(self._data) or self._move(self._begin + self._at):
            tag, kind, begin, length = self._element(explicit)
            if (is_meta and tag >> 16 != 2) or tag >= FLOAT_PIXEL_DATA:
                return found, self._begin + self._at
            if kind is not None and not kind.isalpha():
                break
            if length == UNDEFINED:
                if tag in COMPLEX or not self._pass(begin, explicit, kind):
                    break
                continue
            self._at = begin + length
            if tag in COMPLEX:
                break
            known = _TAGS.get(tag)
            if known is not None:
                value = self._value(begin, length)
                if len(value) < length or length > MOST_BYTES:
                    break
                found[known] = _shared(value, kind) if length <= FEW_BYTES else _element(value, kind)
        return found, -1

    def _element(self, explicit: bool) -> tuple[int, bytes | None, int, int]:
        """Return the next element: its tag and type, where its value begins in the window, and its length."""
        at = self._at
        self.count += 1
        if not explicit:
            group, element, length = _IMPLICIT.unpack_from(self._data, at)
            return group << 16 | element, None, at + 8, length
        group, element, kind, length = _EXPLICIT.unpack_from(self._data, at)
        if kind in _LONG_FORM:
            return group << 16 | element, kind, at + 12, _LENGTH.unpack_from(self._data, at + 8)[0]
        return group << 16 | element, kind, at + 8, length

    def _pass(self, begin: int, explicit: bool, kind: bytes | None) -> bool:
        """Go behind a sequence or fragments of undefined length, nested ones and all; return whether one can.

        Args:
            begin: Where its first item begins in the window.
            explicit: Whether elements tell their types; those in data of unknown type do not.
            kind: Its type.
        """
        self._at = begin
        # what is open: items, and what they are in
        inside = [SEQUENCE_END]
        while inside and kind != b"UN" and self._is_within():
            tag, kind, begin, length = self._element(explicit)
            if tag >> 16 == 0xFFFE:
                begin, length, kind = self._at + 8, _LENGTH.unpack_from(self._data, self._at + 4)[0], None
                if tag != inside[-1] and (tag, inside[-1]) != (ITEM, SEQUENCE_END):
                    return False
            elif inside[-1] == SEQUENCE_END or (kind is not None and not kind.isalpha()):
                return False
            if tag in (ITEM_END, SEQUENCE_END):
                inside.pop()
                length = 0
            elif length == UNDEFINED:
                inside.append(ITEM_END if tag == ITEM else SEQUENCE_END)
                length = 0
            self._at = begin + length
        return not inside

    def _is_within(self) -> bool:
        """Return whether an element can be at the current place, reading the window there if need be."""
        return self._at + 12 <= len(self._data) or self._move(self._begin + self._at)

    def _move(self, begin: int) -> bool:
        """Read the window that begins at a place; return whether an element can be there."""
        self._begin, self._at, self._data = begin, 0, b""
        self._left -= 1
        if self._left >= 0:
            self._file.seek(begin)
            self._data = self._file.read(WINDOW)
        return len(self._data) >= 12

    def _value(self, begin: int, length: int) -> bytes:
        """Return a value, which may go on behind the window; of one that is too long only the beginning."""
        if begin + length <= len(self._data) or length > MOST_BYTES:
            return self._data[begin : begin + length]
        self._file.seek(self._begin + begin)
        return self._file.read(length)
