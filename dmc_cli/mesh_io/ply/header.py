"""Read the header of PLY files: elements, their properties, and how the values are written."""

import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.ply.properties import TYPES

ENCODINGS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
"""NumPy's letters for the byte orders; text has none."""

LENGTH = "length of list"
"""The field of a record that tells how long its list is; no property can have this name."""


@dataclass
class Element:
    """One kind of thing in the file.

    Attributes:
        name: vertex, face, or another one.
        count: How many there are.
        properties: (name, type, type of the list's length or None) of each, in the file's order.
    """

    name: str
    count: int
    properties: list[tuple[str, str, str | None]] = field(default_factory=list)

    @property
    def list_name(self) -> str:
        """Return the property that is a list; an empty text without one."""
        return next((name for name, _, length in self.properties if length is not None), "")

    @property
    def types(self) -> dict[str, np.dtype[Any]]:
        """Return the types of the properties that are no lists, by their names."""
        return {name: np.dtype(kind) for name, kind, length in self.properties if length is None}

    def record(self, order: str, corners: int = 0) -> np.dtype[Any]:
        """Return the layout of one item whose list has so many entries; text is an array of doubles."""
        fields: list[tuple[Any, ...]] = []
        for name, kind, length in self.properties:
            if length is None:
                fields.append((name, order + kind if order else "f8"))
            else:
                fields.append((LENGTH, order + length if order else "f8"))
                fields.append((name, order + kind if order else "f8", (corners,)))
        return np.dtype(fields)


def parse_header(path: str, data: bytes) -> tuple[list[Element], str, int]:
    """Return the elements, NumPy's letter for the byte order (none for text), and where the values start.

    Raises:
        MeshFileError: The header is not what the format has.
        UnsupportedFormatError: An element has several lists.
    """
    header = re.match(rb"ply(.*?)end_header[^\n]*\n", data, re.DOTALL)
    if header is None:
        raise MeshFileError(f"{path}: a header from ply to end_header was expected; this is no PLY file")
    elements: list[Element] = []
    order = None
    for line in header[1].decode("ascii", "backslashreplace").splitlines()[1:]:
        try:
            match line.split():
                case ["format", name, "1.0"]:
                    order = ENCODINGS[name]
                case ["element", name, count] if int(count) >= 0:
                    elements.append(Element(name, int(count)))
                case ["property", "list", length, kind, name]:
                    elements[-1].properties.append((name, TYPES[kind], TYPES[length]))
                case ["property", kind, name]:
                    elements[-1].properties.append((name, TYPES[kind], None))
                case [] | ["comment", *_] | ["obj_info", *_]:
                    pass
                case _:
                    raise ValueError(line)
        except (KeyError, IndexError, ValueError):
            raise MeshFileError(
                f"{path}: the header has the line {line!r}, which PLY 1.0 does not know"
            ) from None
    if order is None:
        raise MeshFileError(f"{path}: the header names no format; expected {', '.join(ENCODINGS)}")
    for element in elements:
        _check_properties(path, element)
    return elements, order, header.end()


def _check_properties(path: str, element: Element) -> None:
    """Raise unless properties have names of their own and at most one is a list."""
    name, count = Counter([name for name, _, _ in element.properties] or [""]).most_common(1)[0]
    if count > 1:
        raise MeshFileError(
            f"{path}: the element {element.name} has {count} properties called {name}; expected one;"
            " rename the others"
        )
    lists = [name for name, _, length in element.properties if length is not None]
    if len(lists) > 1:
        raise UnsupportedFormatError(
            f"{path}: the element {element.name} has the lists {', '.join(lists)}; expected one;"
            " write the mesh without texture coordinates"
        )
