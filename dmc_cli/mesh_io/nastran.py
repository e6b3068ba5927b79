"""Write and read bulk data of Nastran: cards in fields of eight or, for coordinates, sixteen characters.

Each part has a property of its own number, whose name a comment tells. Space and unit stand in comments.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dmc_cli.array_types import AnyArray, ByteArray
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.meshio_file import read_with_meshio
from dmc_cli.mesh_io.numbered import Part, check_numbers, numbered_parts
from dmc_cli.mesh_io.text import chunks_of, right_aligned, spans

CARDS = {3: b"CTRIA3  ", 4: b"CQUAD4  "}
"""The cards of triangles and quads, by their corners."""

NARROW, WIDE = 8, 16
"""Characters of a field."""

SHORTEST_CARD, REMARKS = 4, ("$", "//", "#")
"""What meshio takes for a card, and for none."""

MOST = 99_999_999
"""The largest number of a node or an element."""


def encode_nastran(mesh: MeshFile, *, ascii: bool = True) -> Iterator[bytes]:
    """Yield the bytes of bulk data, groups as properties; it is always text.

    Raises:
        WriteError: There are more nodes or elements than Nastran has numbers for.
    """
    check_numbers(mesh, "Nastran", MOST)
    tags = "".join(f"$ {name}={value}\n" for name, value in mesh.tags.items())
    parts = numbered_parts(mesh)
    names = "".join(f"$ property {part.number}: {part.name}\n" for part in parts)
    yield f"$ written by dmc\n{tags}{names}BEGIN BULK\n".encode("ascii")
    for (start, stop), points in zip(
        spans(len(mesh.points)), chunks_of(mesh.points, np.float32), strict=True
    ):
        yield _nodes(np.arange(start + 1, stop + 1), points)
    for part in parts:
        for corners, card in CARDS.items():
            for rows in part.rows(corners):
                yield _elements(card, part, rows)
    yield b"ENDDATA\n"


def read_nastran(path: Path) -> MeshFile:
    """Read the triangles and quads of bulk data, by meshio.

    Raises:
        MeshFileError: The file is damaged.
        UnsupportedFormatError: Faces of another kind.
    """
    _require_a_card(path)
    return read_with_meshio(path, "nastran")


def _require_a_card(path: Path) -> None:
    """Raise MeshFileError if bulk data are cut off before their first card: meshio would look for ever."""
    has_begun = False
    with path.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            if has_begun and len(line) >= SHORTEST_CARD and not line.startswith(REMARKS):
                return
            has_begun = has_begun or line.strip().startswith("BEGIN BULK")
    if has_begun:
        raise MeshFileError(f"{path}: no card was found behind BEGIN BULK; expected nodes and elements")


def _nodes(numbers: AnyArray, points: AnyArray) -> bytes:
    """Return cards of two lines: number, no coordinate system, x and y; then z."""
    fields = right_aligned(points, WIDE)
    _with_points(fields)
    count = len(points)
    first = [
        _words(b"GRID*   ", count),
        right_aligned(numbers[:, None], WIDE)[:, 0],
        _words(b" " * WIDE, count),
    ]
    second = [_words(b"*\n*       ", count), fields[:, 2], _words(b"\n", count)]
    return np.hstack([*first, fields[:, 0], fields[:, 1], *second]).tobytes()


def _with_points(fields: ByteArray) -> None:
    """Give numbers such as 1e-07 the decimal point by which Nastran tells reals from integers."""
    has_power, has_point = ((fields == ord(letter)).any(axis=2) for letter in "e.")
    for row, column in np.argwhere(has_power & ~has_point):
        text = fields[row, column].tobytes().strip().replace(b"e", b".0e").rjust(WIDE)
        fields[row, column] = np.frombuffer(text, np.uint8)


def _elements(card: bytes, part: Part, rows: AnyArray) -> bytes:
    """Return cards of one line: number, property, nodes."""
    fields = right_aligned(rows, NARROW)
    count = len(rows)
    number = _words(b"%8d" % part.number, count)
    corners = fields[:, 1:].reshape(count, -1)
    return np.hstack([_words(card, count), fields[:, 0], number, corners, _words(b"\n", count)]).tobytes()


def _words(word: bytes, count: int) -> ByteArray:
    """Return a word in so many rows."""
    return np.tile(np.frombuffer(word, np.uint8), (count, 1))
