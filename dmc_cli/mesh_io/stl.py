"""Write and read STL, the format of stereolithography: triangles by their corners' coordinates.

A record is a normal, three corners and two bytes that mean nothing. There are no vertices to share: those at
the same coordinates are one when a file is read. Space and unit stand in the header, where 3D Slicer reads
the space. A header must not begin with `solid`, as text does.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dmc_cli.array_types import AnyArray, Float32Array, Float64Array, Int32Array
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.numbers import SPACE, parse_numbers
from dmc_cli.mesh_io.parsed import make_mesh
from dmc_cli.mesh_io.text import framed_lines
from dmc_cli.mesh_io.triangles import triangle_chunks, triangle_count, unit_normals

HEADER = 80
"""Bytes before the number of triangles."""

RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

VERTEX = (b"      vertex ", b" ", b" ")
FACET = (
    *(b"  facet normal ", b" ", b" ", b"\n    outer loop\n" + VERTEX[0], *VERTEX[1:]),
    *(b"\n" + VERTEX[0], *VERTEX[1:], b"\n" + VERTEX[0], *VERTEX[1:], b"\n    endloop\n  endfacet\n"),
)
"""What stands between the twelve numbers of a triangle in a text."""

TEXT_PIECES = 4
"""Pieces that a chunk is turned to text in: a triangle takes two kilobytes on the way."""

NO_NUMBERS = re.compile(rb"facet[^\n]*|outer\s+loop|endloop|endfacet|vertex")

WORDS = (
    *(
        b"facet",
        b"normal",
        b"",
        b"",
        b"",
        b"outer",
        b"loop",
        b"vertex",
        b"",
        b"",
        b"",
        b"vertex",
        b"",
        b"",
        b"",
    ),
    *(b"vertex", b"", b"", b"", b"endloop", b"endfacet"),
)
"""What a triangle has in a text, word by word, numbers left empty."""

CORNERS = (8, 12, 16)
"""Where the numbers of its three corners begin."""

TEXT_CHUNK, LAST_WORD = 1 << 23, b"endfacet"
"""Characters that are read at a time, up to the end of a triangle."""


def encode_stl(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of an STL file, quads split into triangles."""
    tags = [f"{name}={value}" for name, value in mesh.tags.items()]
    if ascii:
        yield f"{' '.join(['solid dmc', *tags])}\n".encode("ascii")
    else:
        yield "".join(f"{line}\n" for line in ("written by dmc", *tags)).encode("ascii").ljust(HEADER)
        yield triangle_count(mesh).to_bytes(4, "little")
    for triangles in _pieces(mesh, TEXT_PIECES if ascii else 1):
        corners = mesh.points[triangles].astype(np.float32, copy=False)
        normals = unit_normals(corners)
        if ascii:
            yield framed_lines(np.hstack((normals, corners.reshape(-1, 9))), FACET)
        else:
            records = np.zeros(len(triangles), RECORD)
            records["normal"], records["corners"] = normals, corners
            yield records.tobytes()
    if ascii:
        yield b"endsolid dmc\n"


def _pieces(mesh: MeshFile, count: int) -> Iterator[Int32Array]:
    """Yield the triangles, each chunk in so many pieces."""
    for triangles in triangle_chunks(mesh):
        yield from (piece for piece in np.array_split(triangles, count) if len(piece))


def read_stl(path: Path) -> MeshFile:
    """Read the triangles of an STL file, binary or text; corners at the same coordinates are one vertex.

    Raises:
        MeshFileError: The file has neither as many bytes as it announces, nor is it text.
    """
    data = path.read_bytes()
    count = int.from_bytes(data[HEADER : HEADER + 4], "little")
    if len(data) == HEADER + 4 + count * RECORD.itemsize:
        corners = np.frombuffer(data, RECORD, count, HEADER + 4)["corners"]
    elif data.lstrip()[:5].lower() == b"solid":
        numbers = _text_numbers(str(path), data)
        if numbers.size % 9:
            raise MeshFileError(
                f"{path}: {numbers.size} coordinates of corners were found; expected nine a triangle; the"
                " file is cut off"
            )
        corners = numbers.reshape(-1, 3, 3)
    else:
        raise MeshFileError(
            f"{path}: {len(data)} bytes were found; expected {HEADER + 4 + count * RECORD.itemsize} for the"
            f" {count} triangles that it announces, or the word solid at its start; it is cut off, or no STL"
            " file"
        )
    points, indices = _merged(corners.reshape(-1, 3))
    header = data[:HEADER] if b"\n" not in data[:300] else data[: data.rindex(b"\n", 0, 300) + 1]
    return make_mesh(str(path), points, np.full(len(corners), 3), indices, header)


def _text_numbers(path: str, data: bytes) -> Float64Array:
    """Return the coordinates of the corners in a text, in a row.

    Where its words come as in every text of triangles they are counted; any other is searched for words.
    """
    text = _without_names(data.lower())
    found, start = [np.zeros(0)], 0
    while start < len(text):
        place = text.rfind(LAST_WORD, start, start + TEXT_CHUNK)
        end = len(text) if place < 0 else place + len(LAST_WORD)
        numbers = _regular_numbers(path, text[start:end])
        if numbers is None:
            return parse_numbers(path, NO_NUMBERS.sub(b" ", text))
        found.append(numbers)
        start = end
    return np.concatenate(found)


def _without_names(text: bytes) -> bytes:
    """Return a text without the lines that begin and end solids, which may have any words."""
    pieces, start = [], 0
    while (place := text.find(b"solid", start)) >= 0:
        pieces.append(text[start : place - 3 if text.endswith(b"end", 0, place) else place])
        start = text.find(b"\n", place)
        if start < 0:
            return b"".join(pieces)
    return b"".join([*pieces, text[start:]])


def _regular_numbers(path: str, text: bytes) -> Float64Array | None:
    """Return the corners' coordinates in whole triangles of a text; None if its words come otherwise."""
    characters = np.frombuffer(text + b"\n", np.uint8)
    is_word = characters > SPACE
    begins = np.flatnonzero(is_word[1:] & ~is_word[:-1]) + 1
    begins = np.concatenate([[0], begins]) if is_word[0] else begins
    if len(begins) % len(WORDS):
        return None
    words = begins.reshape(-1, len(WORDS))
    for place, word in enumerate(WORDS):
        letters = np.frombuffer(word + b" ", np.uint8)
        where = np.minimum(words[:, place, None] + np.arange(len(letters)), len(characters) - 1)
        read = characters[where]
        if word and not ((read[:, :-1] == letters[:-1]).all() and (read[:, -1] <= SPACE).all()):
            return None
    changes = np.zeros(len(characters), np.int8)
    for place in CORNERS:
        changes[words[:, place]], changes[words[:, place + 3]] = 1, -1
    return parse_numbers(path, characters[np.cumsum(changes, dtype=np.int8) > 0].tobytes())


def _merged(corners: AnyArray) -> tuple[Float32Array, AnyArray]:
    """Return points at different coordinates, in the order that they appear in, and that of each corner."""
    places = corners + corners.dtype.type(0)  # -0 is 0
    order = np.lexsort(places.T)
    is_new = np.ones(len(order), bool)
    is_new[1:] = (places[order[1:]] != places[order[:-1]]).any(axis=1)
    group = np.empty(len(order), np.int64)
    group[order] = np.cumsum(is_new) - 1
    first = order[is_new]  # the sort is stable: the first of its kind
    by_place = np.argsort(first, kind="stable")
    rank = np.empty_like(by_place)
    rank[by_place] = np.arange(len(by_place))
    return places[first[by_place]], rank[group]
