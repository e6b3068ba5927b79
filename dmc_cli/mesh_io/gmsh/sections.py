"""Take a file of Gmsh apart: its sections, and the numbers in one.

A file announces how many numbers it has; no more is ever reserved than there are.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dmc_cli.array_types import AnyArray, Float64Array, IntArray
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.kept_property import kept_property
from dmc_cli.mesh_io.numbers import parse_numbers, whole_numbers

SIZES = (4, 8)
"""Bytes of a number that counts, in binary files."""

Version = Literal["2.2", "4.0", "4.1"]

LONGEST_NUMBER = 19
"""Digits of a number that counts."""


@dataclass(frozen=True)
class Layout:
    """How the numbers of a file are kept.

    Attributes:
        version: Of the format: 2.2, 4.0 or 4.1; others are near one of them.
        order: The order of bytes, < or >; empty in text.
        size: Bytes of a number that counts.
    """

    version: Version
    order: str
    size: int

    @property
    def types(self) -> dict[str, np.dtype[np.generic]]:
        """Return the types of integers, of numbers that count and of reals."""
        names = {"integer": "i4", "size": f"u{self.size}", "real": "f8"}
        return {kind: np.dtype(self.order + name) for kind, name in names.items()}


class Section:
    """The content of a section, taken from its start on: lines, then numbers.

    Attributes:
        path: The file, for messages.
        name: Of the section.
        layout: How numbers are kept.
    """

    def __init__(self, path: str, name: str, data: bytes, layout: Layout) -> None:
        self.path, self.name, self.layout = path, name, layout
        self._data = data
        self._place = 0  # in the bytes, and in text in the numbers once one is taken

    def line(self) -> str:
        """Return the next line, without blanks at its ends."""
        end = self._data.find(b"\n", self._place)
        if end < 0:
            raise self.damaged("it ends early")
        line = self._data[self._place : end]
        self._place = end + 1
        return line.decode("utf-8", "replace").strip()

    def whole(self) -> int:
        """Return the next line as a number that counts."""
        line = self.line()
        if not (line.isascii() and line.isdigit() and len(line) <= LONGEST_NUMBER):
            raise self.damaged(f"{line[:40]!r} was found where a number was expected")
        return int(line)

    def integers(self, count: int) -> IntArray:
        """Return some integers, int64."""
        return self._taken("integer", count)

    def sizes(self, count: int) -> IntArray:
        """Return some numbers that count, int64."""
        return self._taken("size", count)

    def reals(self, count: int, width: int) -> Float64Array:
        """Return rows of reals, (count, width)."""
        return self._taken("real", count * width).reshape(count, width)

    def rows(self, count: int, width: int) -> tuple[IntArray, Float64Array]:
        """Return rows of an integer, (count,) int64, and reals, (count, width)."""
        if not self.layout.order:
            found = self.reals(count, 1 + width)
            return whole_numbers(self.path, found[:, 0]).astype(np.int64), found[:, 1:]
        types = self.layout.types
        record = np.dtype([("number", types["integer"]), ("values", types["real"], (width,))])
        self._require(count * record.itemsize, len(self._data))
        records = np.frombuffer(self._data, record, count, self._place)
        self._place += count * record.itemsize
        return records["number"].astype(np.int64), records["values"].astype(np.float64)

    def remaining_text(self) -> bytes:
        """Return what follows, and be at the end."""
        text, self._place = self._data[self._place :], len(self._data)
        return text

    def end(self) -> None:
        """Raise MeshFileError unless all has been taken."""
        is_text = not self.layout.order
        numbers = self._numbers if is_text else np.zeros(0)
        left = len(numbers[self._place :]) if is_text else len(self._data[self._place :].strip())
        if left:
            raise self.damaged("it holds more than it announces")

    def damaged(self, what: str) -> MeshFileError:
        """Return an error of this section."""
        return MeshFileError(f"{self.path}: the section ${self.name} is damaged: {what}")

    @kept_property
    def _numbers(self) -> Float64Array:
        """Return the numbers of a text behind the lines that have been taken."""
        text = self._data[self._place :]
        self._place = 0
        return parse_numbers(self.path, text)

    def _taken(self, kind: str, count: int) -> AnyArray:
        """Return some numbers, int64 or float64."""
        is_real = kind == "real"
        if not self.layout.order:
            numbers = self._numbers
            self._require(count, len(numbers))
            found = numbers[self._place : self._place + count]
            self._place += count
            return found if is_real else whole_numbers(self.path, found)
        dtype = self.layout.types[kind]
        self._require(count * dtype.itemsize, len(self._data))
        found = np.frombuffer(self._data, dtype, count, self._place)
        self._place += count * dtype.itemsize
        return found.astype(np.float64 if is_real else np.int64)

    def _require(self, count: int, total: int) -> None:
        """Raise MeshFileError unless so much is left."""
        if not 0 <= count <= total - self._place:
            raise self.damaged(f"more is announced, {count}, than the {total - self._place} that are left")


def sections_of(path: str, data: bytes) -> list[Section]:
    """Return the sections of a file in their order.

    Raises:
        MeshFileError: The file is none of Gmsh, or damaged.
        UnsupportedFormatError: It has another version.
    """
    found = list(_split(path, data))
    heads = [content for name, content in found if name == "MeshFormat"]
    if len(heads) != 1:
        raise MeshFileError(
            f"{path}: {len(heads)} sections $MeshFormat were found; expected one; it is damaged, or no file"
            " of Gmsh since version 2"
        )
    layout = _layout(path, heads[0])
    return [Section(path, name, content, layout) for name, content in found]


def _split(path: str, data: bytes) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of the sections."""
    place = 0
    while place < len(data):
        line_end = data.find(b"\n", place)
        start = len(data) if line_end < 0 else line_end + 1
        name = data[place:start].strip()
        place = start
        if not name:
            continue
        if not name.startswith(b"$"):
            shown = name[:40].decode("ascii", "replace")
            raise MeshFileError(f"{path}: {shown!r} was found where a section was expected; it is damaged")
        last = b"$End" + name[1:]
        end = data.find(last, start)
        if end < 0:
            shown = name[1:41].decode("ascii", "replace")
            raise MeshFileError(f"{path}: the section ${shown} has no end; it is cut off, or damaged")
        yield name[1:].decode("utf-8", "replace"), data[start:end]
        place = end + len(last)


def _layout(path: str, head: bytes) -> Layout:
    """Return how numbers are kept."""
    line, _, rest = head.partition(b"\n")
    words = line.decode("ascii", "replace").split()
    if len(words) != 3 or words[1] not in ("0", "1") or words[2] not in map(str, SIZES):
        raise MeshFileError(
            f"{path}: the format is given as {' '.join(words)[:40]!r}; expected version, 0 or 1, and bytes"
            " of a number, 4 or 8; it is damaged"
        )
    version, is_binary, size = words[0], words[1] == "1", int(words[2])
    likes: dict[str, Version] = {"2": "2.2", "4": "4.1"}
    known = "4.0" if version == "4.0" else likes.get(version.partition(".")[0])
    if known is None:
        raise UnsupportedFormatError(
            f"{path}: version {version[:20]} was found; expected 2 or 4; write it so"
        )
    order = ""
    if is_binary:
        order = {b"\1\0\0\0": "<", b"\0\0\0\1": ">"}.get(rest[:4], "")
        if not order:
            raise MeshFileError(
                f"{path}: {rest[:4].hex()} was found where the number 1 was expected, by which the order of"
                " bytes is told; it is damaged"
            )
    return Layout(known, order, size)
