"""Read the triangles and quads of a file by meshio, with their values."""

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_formats import known_suffixes
from dmc_cli.mesh_io.grouping import Grouping, by_numbers
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.parsed import FACES, make_mesh, other_cells, unread, usable_values

HEAD = 2048
"""Characters of a file that may name the space and the unit in a comment."""


@dataclass(frozen=True)
class PartNumbers:
    """Where the numbers of the faces' parts are, and the names of these.

    Attributes:
        value: How meshio calls the numbers.
        word: What a part without a name is called, with its number behind.
        names: Finds the number and the name of a part in the file.
        none: The number of faces in no part.
    """

    value: str
    word: str
    names: re.Pattern[bytes]
    none: int | None = None

    def grouping(self, path: Path, parts: AnyArray) -> Grouping:
        """Return the groups of faces with such numbers."""
        found = self.names.findall(path.read_bytes())
        names = {int(number): name.decode("utf-8", "replace").strip() for number, name in found}
        grouping = by_numbers(parts, names, self.word)
        numbers = np.where(parts == self.none, -1, grouping.numbers) if self.none is not None else None
        return grouping if numbers is None else Grouping(names=grouping.names, numbers=numbers)


TEXTS = {"medit", "nastran"}
"""Formats of text whose readers take the encoding from the locale, which a library may have set to ASCII."""

UNENDING = {".mdpa"}
"""Suffixes of formats whose reader waits for ever for what a damaged file lacks."""


def read_with_meshio(
    path: Path, file_format: str | None = None, parts: PartNumbers | None = None
) -> MeshFile:
    """Read the triangles and quads of any other format; triangles need not come where they were.

    Args:
        path: The file.
        file_format: How meshio calls its format; without it, the suffix tells.
        parts: What tells the groups of the faces, if something does.

    Raises:
        UnsupportedFormatError: There is no reader, or faces of another kind.
        MeshFileError: meshio cannot read it.
    """
    import warnings

    import meshio

    if path.suffix.lower() in UNENDING:
        raise UnsupportedFormatError(
            f"{path}: meshio's reader of {path.suffix.lower()} does not end where a file is cut off, so it is"
            " not called; expected another format; `meshio convert` makes one of a file that is whole"
        )
    if file_format is None and path.suffix.lower() not in meshio.extension_to_filetypes:
        raise UnsupportedFormatError(
            f"{path}: there is no reader for {path.suffix or 'a file without a suffix'}; expected"
            f" {', '.join(known_suffixes())} or a format of meshio such as .med, .vol, .su2"
        )
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            mesh = _read(path, file_format)
        points = np.zeros((len(mesh.points), 3))
        if len(points):
            points[:, : mesh.points.shape[1]] = mesh.points
        is_face = [block.type in FACES and len(block.data) > 0 for block in mesh.cells]
        blocks: list[Any] = [
            np.asarray(block.data) for block, chosen in zip(mesh.cells, is_face, strict=True) if chosen
        ]
        counts = [np.full(len(block), block.shape[1]) for block in blocks]
        corners = [block.ravel().astype(np.int64) for block in blocks]
        face_data = {
            name: np.concatenate([np.asarray(part) for part in compress(data, is_face)])
            for name, data in mesh.cell_data.items()
            if blocks
        }
    except Exception as error:
        told_by_meshio = str(error) or type(error).__name__
        raise MeshFileError(
            f"{path}: meshio cannot read it: {told_by_meshio}; it is damaged, or of a kind that is unknown"
            " to meshio"
        ) from error
    told = other_cells(path, [(block.type, len(block.data)) for block in mesh.cells])
    empty = np.zeros(0, dtype=np.int64)
    found = np.concatenate([empty, *counts]), np.concatenate([empty, *corners])
    vertex_values = _values(mesh.point_data, len(points), told)
    face_values = _values(face_data, len(found[0]), told)
    grouping = None if parts is None else _grouping(path, parts, mesh, face_data, told)
    with path.open("rb") as stream:
        head = stream.read(HEAD)
    return make_mesh(
        str(path),
        points,
        *found,
        head,
        grouping,
        vertex_values=vertex_values,
        face_values=face_values,
        warnings=unread(path, told),
    )


def _read(path: Path, file_format: str | None) -> Any:
    """Return what meshio reads, by the first of its readers that can.

    `meshio.read` would print why a reader cannot, and then end the program.
    """
    import meshio

    readers = meshio._helpers.reader_map
    if file_format in TEXTS:
        with path.open(encoding="utf-8", errors="replace") as text:
            return readers[file_format](text)
    names = [file_format] if file_format else meshio.extension_to_filetypes[path.suffix.lower()]
    for name in names[:-1]:
        with suppress(meshio.ReadError):
            return readers[name](str(path))
    return readers[names[-1]](str(path))


def _grouping(
    path: Path, parts: PartNumbers, mesh: Any, face_data: Mapping[str, Any], told: list[str]
) -> Grouping | None:
    """Return the groups of the faces if all elements tell theirs."""
    if parts.value not in mesh.cell_data:
        return None
    if [len(block) for block in mesh.cell_data[parts.value]] != [len(block.data) for block in mesh.cells]:
        told.append("numbers of parts, which some elements lack")
        return None
    return parts.grouping(path, face_data[parts.value]) if parts.value in face_data else None


def _values(data: Mapping[str, Any], count: int, told: list[str]) -> dict[str, AnyArray]:
    """Return what meshio reads as values; numbers of parts, whose names have a colon, are passed over."""
    arrays = {name: np.asarray(array) for name, array in data.items() if ":" not in name}
    told += [f"values {name}" for name, array in arrays.items() if len(array) != count]
    return usable_values({name: array for name, array in arrays.items() if len(array) == count}, told)
