"""Write and read bulk data of Nastran: cards in fields of eight or, for coordinates, sixteen characters.

Each part has a property of its own number, whose name a comment tells. Space and unit stand in comments.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dmc_cli.array_types import AnyArray, ByteArray
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.meshio_file import PartNumbers, read_with_meshio
from dmc_cli.mesh_io.numbered import Part, check_numbers, numbered_parts
from dmc_cli.mesh_io.text import chunks_of, right_aligned, spans

CARDS = {3: b"CTRIA3  ", 4: b"CQUAD4  "}
"""The cards of triangles and quads, by their corners."""

NARROW, WIDE = 8, 16
"""Characters of a field."""

SHORTEST_CARD, REMARKS = 4, ("$", "//", "#")
"""What meshio takes for a card, and for none."""

PROPERTY = re.compile(rb"^\$ property (\d{1,10}): ([^\r\n]+)", re.MULTILINE)
"""A name as we tell it."""

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
    """Read the triangles and quads of bulk data, by meshio; properties are groups.

    Raises:
        MeshFileError: The file is damaged.
        UnsupportedFormatError: Faces of another kind, or nodes in a system of coordinates of their own.
    """
    _check_cards(path)
    return read_with_meshio(path, "nastran", PartNumbers("nastran:ref", "property", PROPERTY))


def _check_cards(path: Path) -> None:
    """Raise unless meshio reads the cards for what they are.

    It would look for ever for the first card of bulk data that end before, and takes nodes of any system of
    coordinates for those of the basic one.
    """
    has_begun, is_cut_off = False, False
    with path.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            if has_begun and len(line) >= SHORTEST_CARD and not line.startswith(REMARKS):
                is_cut_off = False
                if line.startswith("GRID") and _system(line) not in ("", "0"):
                    raise UnsupportedFormatError(
                        f"{path}: nodes in the system of coordinates {_system(line)[:20]} were found;"
                        " expected all in the basic one; write them so"
                    )
            elif not has_begun and line.strip().startswith("BEGIN BULK"):
                has_begun = is_cut_off = True
    if is_cut_off:
        raise MeshFileError(f"{path}: no card was found behind BEGIN BULK; expected nodes and elements")


def _system(card: str) -> str:
    """Return the system of coordinates that a node's card names, or nothing."""
    if "," in card:
        return [*card.split(","), "", ""][2].strip()
    width = WIDE if card.startswith("GRID*") else NARROW
    return card[NARROW + width : NARROW + 2 * width].strip()


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
