"""PLY: a header that names elements and their properties, then their values as text or binary.

Faces have one list, their vertices; numbers before and after it are passed over. Faces of one size that
follow each other are read at once.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.numbers import parse_numbers
from dmc_cli.mesh_io.parsed import find_space, make_mesh
from dmc_cli.mesh_io.ply_properties import TYPES

Array = np.ndarray[Any, np.dtype[Any]]

ENCODINGS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}

WINDOW = 64
"""Faces that are looked at first for how many of one size follow each other; doubled while they do."""


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

    def lists(self) -> list[str]:
        """Names of the properties that are lists."""
        return [name for name, _, length in self.properties if length is not None]

    def record(self, order: str, corners: int = 0) -> np.dtype[Any]:
        """Return the layout of one item whose list has so many corners; text is an array of doubles."""
        fields: list[tuple[Any, ...]] = []
        for name, kind, length in self.properties:
            if length is None:
                fields.append((name, order + kind if order else "f8"))
            else:
                fields.append(("length of list", order + length if order else "f8"))
                fields.append((name, order + kind if order else "f8", (corners,)))
        return np.dtype(fields)


def read_ply(path: Path) -> MeshFile:
    """Read the points and faces of a PLY file; other elements and properties are passed over.

    Raises:
        MeshFileError: The header or the values are not what the format has, or the file ends early.
        UnsupportedFormatError: A layout that is not read, or a face with more than four corners.
    """
    data = path.read_bytes()
    elements, order, start = _parse_header(path, data)
    space = find_space(data[:start])
    body = memoryview(data)[start:]
    if not order:
        body = memoryview(parse_numbers(str(path), bytes(body)).tobytes())
    points, counts, corners = None, np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    position = 0
    for element in elements:
        if element.lists():
            position, sizes, items = _read_lists(path, element, order, body, position)
            if element.name == "face":
                counts, corners = sizes, items
        else:
            position, table = _read_table(path, element, order, body, position)
            if element.name == "vertex":
                points = np.column_stack([_column(path, table, axis) for axis in "xyz"])
    if points is None:
        raise MeshFileError(f"{path}: no element vertex was found; expected points with x, y and z")
    return make_mesh(str(path), points, counts, corners, space)


def _parse_header(path: Path, data: bytes) -> tuple[list[Element], str, int]:
    """Return the elements, NumPy's letter for the byte order (none for text), and where the values start."""
    header = re.match(rb"ply(.*?)end_header[^\n]*\n", data, re.DOTALL)
    if header is None:
        raise MeshFileError(f"{path}: a header from ply to end_header was expected; this is no PLY file")
    elements: list[Element] = []
    order = None
    for line in header[1].decode("ascii", "replace").splitlines()[1:]:
        try:
            match line.split():
                case ["format", name, "1.0"]:
                    order = ENCODINGS[name]
                case ["element", name, count]:
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
    return elements, order, header.end()


def _read_table(
    path: Path, element: Element, order: str, body: memoryview, position: int
) -> tuple[int, Array]:
    """Read an element without lists."""
    record = element.record(order)
    end = position + element.count * record.itemsize
    if end > len(body):
        _refuse_end(path, element)
    return end, np.frombuffer(body, dtype=record, count=element.count, offset=position)


def _read_lists(
    path: Path, element: Element, order: str, body: memoryview, position: int
) -> tuple[int, Array, Array]:
    """Read an element with one list: return where it ends, the lengths, and all items in a row."""
    names = element.lists()
    if len(names) > 1:
        raise UnsupportedFormatError(
            f"{path}: the element {element.name} has the lists {', '.join(names)}; expected one;"
            " write the mesh without texture coordinates"
        )
    lengths, items = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    left, window = element.count, WINDOW
    shortest = element.record(order)
    item_size = element.record(order, 1).itemsize - shortest.itemsize
    while left:
        if position + shortest.itemsize > len(body):
            _refuse_end(path, element)
        head = np.frombuffer(body, dtype=shortest, count=1, offset=position)
        most = (len(body) - position - shortest.itemsize) // item_size
        if not 0 <= head["length of list"][0] <= most:
            _refuse_end(path, element)
        length = int(head["length of list"][0])
        record = element.record(order, length)
        count = min(left, window, (len(body) - position) // record.itemsize)
        table = np.frombuffer(body, dtype=record, count=count, offset=position)
        same = table["length of list"] == length
        run = count if same.all() else int(np.argmin(same))
        lengths.append(np.full(run, length))
        items.append(table[names[0]][:run].astype(np.int64).ravel())
        position += run * record.itemsize
        left -= run
        window = 2 * window if run == count else WINDOW
    return position, np.concatenate(lengths), np.concatenate(items)


def _column(path: Path, table: Array, name: str) -> Array:
    """Return a property of the vertices as float64."""
    if name not in (table.dtype.names or ()):
        raise MeshFileError(f"{path}: the vertices have no property {name}; expected x, y and z")
    return np.asarray(table[name], dtype=np.float64)


def _refuse_end(path: Path, element: Element) -> NoReturn:
    raise MeshFileError(
        f"{path}: the file ends within the element {element.name}, of which {element.count} were expected;"
        " it is cut off"
    )
