"""Read the legacy format of VTK: polygons or cells, of versions up to 5.1, in text or big endian.

A file is a row of sections, each a line of words with numbers behind it.
"""

import re
from collections.abc import Callable
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.numbers import SPACE, parse_numbers, whole_numbers
from dmc_cli.mesh_io.vtk.cells import POLYGON, Found, mesh_of_cells

TYPES = {
    "char": "i1", "signed_char": "i1", "unsigned_char": "u1", "short": "i2", "unsigned_short": "u2",
    "int": "i4", "unsigned_int": "u4", "long": "i8", "unsigned_long": "u8", "vtktypeint64": "i8",
    "vtkidtype": "i4", "float": "f4", "double": "f8",
}  # fmt: skip
"""NumPy's letters for VTK's types."""

KINDS = {"vertices": 2, "lines": 4, "polygons": POLYGON, "triangle_strips": 6}
"""VTK's numbers of what a file of polygons holds, in the order of its data."""

HEAD = re.compile(
    rb"# vtk DataFile Version (\d+)\.\d+[^\n]*\n([^\n]*)\n\s*(ASCII|BINARY)\s*\n", re.IGNORECASE
)
VECTORS = {"normals": 3, "vectors": 3, "tensors": 9}


def read_legacy(path: Path) -> MeshFile:
    """Read the faces, normals and values of a legacy VTK file; other cells are told.

    Raises:
        MeshFileError: The file is damaged.
        UnsupportedFormatError: It holds no mesh, or a face has more than four corners.
    """
    data = path.read_bytes()
    head = HEAD.match(data)
    if head is None:
        raise MeshFileError(
            f"{path}: '# vtk DataFile Version', a title and ASCII or BINARY were expected in the first lines;"
            " this is no legacy VTK file"
        )
    reader = _Reader(path, data, head.end(), int(head[1]), head[3].upper() == b"BINARY")
    found = reader.read()
    found.comments = head[2].rstrip() + b"\n"
    return mesh_of_cells(path, found)


class _Reader:
    """Goes through a file section by section."""

    def __init__(self, path: Path, data: bytes, position: int, version: int, is_binary: bool) -> None:
        self.path, self.data, self.position = path, data, position
        self.version, self.is_binary = version, is_binary
        self.points: AnyArray = np.zeros((0, 3))
        self.cells: dict[str, tuple[AnyArray, AnyArray]] = {}
        self.kinds: AnyArray = np.zeros(0, np.int64)
        self.values: dict[str, dict[str, AnyArray]] = {"point_data": {}, "cell_data": {}, "": {}}
        self.place, self.count = "", 0
        self.told: list[str] = []

    def read(self) -> Found:
        """Return what the file holds."""
        actions: dict[str, Callable[[list[str]], None]] = {
            "dataset": self._dataset,
            "points": self._points,
            **dict.fromkeys((*KINDS, "cells"), self._cells),
            "cell_types": self._cell_types,
            "point_data": self._begin_data,
            "cell_data": self._begin_data,
            "scalars": self._scalars,
            **dict.fromkeys(VECTORS, self._vectors),
            "color_scalars": self._colors,
            "texture_coordinates": self._texture,
            "lookup_table": self._lookup_table,
            "field": self._field,
            "metadata": self._metadata,
        }
        while words := self._words():
            action = actions.get(words[0].lower())
            if action is None:
                raise MeshFileError(
                    f"{self.path}: the line {' '.join(words)[:80]!r} was found where a section was expected"
                )
            try:
                action(words)
            except (MeshFileError, UnsupportedFormatError):
                raise
            except (IndexError, KeyError, ValueError) as error:
                raise MeshFileError(
                    f"{self.path}: the line {' '.join(words)[:80]!r} is not what VTK writes"
                ) from error
        return self._found()

    def _found(self) -> Found:
        """Return the cells of all sections in the order of their data."""
        names = [name for name in ("cells", *KINDS) if name in self.cells]
        starts = np.cumsum([0, *(len(self.cells[name][1]) for name in names)])
        ends = [self.cells[name][0] + start for name, start in zip(names, starts[:-1], strict=True)]
        kinds = [
            self.kinds if name == "cells" else np.full(len(self.cells[name][0]), KINDS[name])
            for name in names
        ]
        empty = np.zeros(0, np.int64)
        corners = [self.cells[name][1] for name in names]
        return Found(
            self.points,
            np.concatenate([empty, *ends]),
            np.concatenate([empty, *corners]),
            np.concatenate([empty, *kinds]),
            self.values["point_data"],
            self.values["cell_data"],
            self.told,
        )

    def _words(self) -> list[str]:
        """Return the words of the next line that has any; none at the end."""
        while self.position < len(self.data):
            end = self.data.find(b"\n", self.position)
            end = len(self.data) if end < 0 else end
            line = self.data[self.position : end]
            self.position = end + 1
            if line.strip():
                return line.decode("utf-8", "replace").split()
        return []

    def _numbers(self, count: int, kind: str) -> AnyArray:
        """Return the next numbers."""
        dtype = np.dtype(TYPES[kind.lower()])
        if count < 0 or count > len(self.data):
            raise MeshFileError(
                f"{self.path}: {count} numbers are announced, more than there are; it is cut off"
            )
        if self.is_binary:
            end = self.position + count * dtype.itemsize
            if end > len(self.data):
                raise MeshFileError(f"{self.path}: the file ends within {count} numbers; it is cut off")
            found = np.frombuffer(self.data, dtype.newbyteorder(">"), count, self.position)
            self.position = end
            return found.astype(dtype)
        values = self._text_numbers(count)
        with np.errstate(invalid="ignore", over="ignore"):
            return (
                whole_numbers(str(self.path), values).astype(dtype)
                if dtype.kind in "iu"
                else values.astype(dtype)
            )

    def _text_numbers(self, count: int) -> AnyArray:
        """Return the next numbers of a text: as many lines as hold them."""
        parts, left = [np.zeros(0)], count
        while left:
            guess = self.position + max(left * 8, 1 << 16)
            end = self.data.find(b"\n", guess)
            text = self.data[self.position : len(self.data) if end < 0 else end]
            is_word = np.frombuffer(text + b" ", np.uint8) > SPACE
            ends = np.flatnonzero(is_word[:-1] & ~is_word[1:]) + 1
            taken = min(left, len(ends))
            if not taken:
                raise MeshFileError(f"{self.path}: the file ends within {count} numbers; it is cut off")
            last = int(ends[taken - 1])
            parts.append(parse_numbers(str(self.path), text[:last]))
            self.position += last
            left -= taken
        return np.concatenate(parts)

    def _dataset(self, words: list[str]) -> None:
        if words[1].upper() not in ("POLYDATA", "UNSTRUCTURED_GRID"):
            raise UnsupportedFormatError(
                f"{self.path}: a dataset of the kind {words[1]} was found; expected POLYDATA or"
                " UNSTRUCTURED_GRID, which hold faces"
            )

    def _points(self, words: list[str]) -> None:
        self.points = self._numbers(3 * int(words[1]), words[2]).reshape(-1, 3)

    def _cells(self, words: list[str]) -> None:
        """Read ends and corners: before version 5 each cell's number of corners stands before them."""
        name, rows, size = words[0].lower(), int(words[1]), int(words[2])
        if self.version >= 5:
            kind = self._words()[1]
            starts = self._numbers(rows, kind).astype(np.int64)
            kind = self._words()[1]
            self.cells[name] = starts[1:], self._numbers(size, kind).astype(np.int64)
            return
        numbers = self._numbers(size, "int").astype(np.int64)
        self.cells[name] = _counted(self.path, numbers, rows)

    def _cell_types(self, words: list[str]) -> None:
        self.kinds = self._numbers(int(words[1]), "int").astype(np.int64)

    def _begin_data(self, words: list[str]) -> None:
        self.place, self.count = words[0].lower(), int(words[1])

    def _keep(self, name: str, array: AnyArray) -> None:
        self.values[self.place][unquote(name)] = array

    def _scalars(self, words: list[str]) -> None:
        columns = int(words[3]) if len(words) > 3 else 1
        before = self.position
        if self._words()[:1] != ["LOOKUP_TABLE"]:
            self.position = before
        self._keep(words[1], self._numbers(self.count * columns, words[2]).reshape(-1, columns))

    def _vectors(self, words: list[str]) -> None:
        columns = VECTORS[words[0].lower()]
        name = "Normals" if words[0].lower() == "normals" and self.place == "point_data" else words[1]
        self._keep(name, self._numbers(self.count * columns, words[2]).reshape(-1, columns))

    def _colors(self, words: list[str]) -> None:
        columns = int(words[2])
        kind = "unsigned_char" if self.is_binary else "float"
        self._keep(words[1], self._numbers(self.count * columns, kind).reshape(-1, columns))

    def _texture(self, words: list[str]) -> None:
        self._numbers(self.count * int(words[2]), words[3])
        self.told.append("texture coordinates")

    def _lookup_table(self, words: list[str]) -> None:
        self._numbers(4 * int(words[2]), "unsigned_char" if self.is_binary else "float")

    def _field(self, words: list[str]) -> None:
        for _ in range(int(words[2])):
            name, columns, rows, kind = self._words()
            if kind == "string":
                raise UnsupportedFormatError(
                    f"{self.path}: texts called {name} were found; expected numbers alone; write it as VTP"
                )
            array = self._numbers(int(columns) * int(rows), kind)
            self._keep(name, array.reshape(int(rows), int(columns)))
            before = self.position
            if self._words()[:1] == ["METADATA"]:
                self._metadata([])
            else:
                self.position = before

    def _metadata(self, words: list[str]) -> None:
        """Pass over what VTK keeps of an array: lines up to an empty one."""
        while self.position < len(self.data):
            end = self.data.find(b"\n", self.position)
            end = len(self.data) if end < 0 else end
            line = self.data[self.position : end]
            self.position = end + 1
            if not line.strip():
                return


def _counted(path: Path, numbers: AnyArray, rows: int) -> tuple[AnyArray, AnyArray]:
    """Return ends and corners of cells that each begin with their number of corners."""
    for count in (4, 3):
        if len(numbers) == rows * (count + 1) and (numbers[:: count + 1] == count).all():
            return np.arange(1, rows + 1) * count, numbers.reshape(-1, count + 1)[:, 1:].ravel()
    places = np.empty(rows, np.int64)
    place, listed = 0, numbers.tolist()
    for row in range(rows):
        if place >= len(listed) or listed[place] < 0:
            raise MeshFileError(
                f"{path}: {rows} cells are announced, which {len(listed)} numbers do not hold"
            )
        places[row] = place
        place += listed[place] + 1
    if place != len(listed):
        raise MeshFileError(f"{path}: {rows} cells take {place} numbers; {len(listed)} are announced")
    is_count = np.zeros(len(numbers), bool)
    is_count[places] = True
    return np.cumsum(numbers[places]), numbers[~is_count]
