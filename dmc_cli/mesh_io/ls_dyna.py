"""Write and read keyword files of LS-DYNA: nodes and shells in fields of eight and sixteen characters.

Each group is a part; a triangle has its third node twice. Space and unit stand in comments.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dmc_cli.array_types import AnyArray, ByteArray
from dmc_cli.mesh_io.grouping import by_numbers
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.numbered import Part, check_numbers, node_places, numbered_parts
from dmc_cli.mesh_io.numbers import NEWLINE, field_rows, whole_numbers
from dmc_cli.mesh_io.parsed import make_mesh
from dmc_cli.mesh_io.text import chunks_of, right_aligned, spans

NARROW, WIDE = 8, 16
"""Characters of a number of a node, an element or a part, and of a coordinate."""

MOST = 99_999_999
"""The largest number of a node or an element."""

WHOLE = re.compile(r"\d{1,10}(?![\d.])")
COMMENT = re.compile(rb"^\$[^\n]*\n", re.MULTILINE)


def encode_ls_dyna(mesh: MeshFile, *, ascii: bool = True) -> Iterator[bytes]:
    """Yield the bytes of a keyword file, groups as parts; it is always text.

    Raises:
        WriteError: There are more nodes or elements than the fields have room for.
    """
    check_numbers(mesh, "LS-DYNA", MOST)
    tags = "".join(f"$ {name}={value}\n" for name, value in mesh.tags.items())
    yield f"*KEYWORD\n$ written by dmc\n{tags}".encode("ascii")
    parts = [part for part in numbered_parts(mesh) if len(part.faces)]
    for part in parts:
        yield f"*PART\n{part.name}\n{part.number:10}{0:10}{0:10}\n".encode("ascii")
    yield b"*NODE\n"
    for (start, stop), points in zip(
        spans(len(mesh.points)), chunks_of(mesh.points, np.float32), strict=True
    ):
        numbers = right_aligned(np.arange(start + 1, stop + 1)[:, None], NARROW)
        yield _lines(numbers, right_aligned(points, WIDE))
    yield b"*ELEMENT_SHELL\n"
    for part in parts:
        for corners in (3, 4):
            for rows in part.rows(corners):
                yield _shells(part, rows)
    yield b"*END\n"


def _shells(part: Part, rows: AnyArray) -> bytes:
    """Return rows of element, part and four nodes."""
    numbers = np.full((len(rows), 6), part.number, np.int32)
    numbers[:, 0] = rows[:, 0]
    numbers[:, 2:5], numbers[:, 5] = rows[:, 1:4], rows[:, -1]
    return _lines(right_aligned(numbers, NARROW))


def _lines(*fields: ByteArray) -> bytes:
    """Join the fields of each row to a line."""
    rows = [field.reshape(len(field), -1) for field in fields]
    return np.hstack([*rows, np.full((len(rows[0]), 1), NEWLINE, np.uint8)]).tobytes()


def read_ls_dyna(path: Path) -> MeshFile:
    """Read the nodes and shells of a keyword file in fields of fixed width; parts are groups.

    Raises:
        MeshFileError: A field is no number, a shell names a node that is not there, or two have one number.
    """
    data = path.read_bytes().replace(b"\r\n", b"\n") + b"\n"
    text = COMMENT.sub(b"", data)
    nodes, shells = [np.zeros((0, 4))], [np.zeros((0, 6))]
    names: dict[int, str] = {}
    for section in (b"\n" + text).split(b"\n*")[1:]:
        keyword, _, lines = section.partition(b"\n")
        word = keyword.upper().split(maxsplit=1)[:1]
        if word == [b"NODE"]:
            nodes.append(field_rows(str(path), lines, (NARROW, WIDE, WIDE, WIDE)))
        elif word == [b"ELEMENT_SHELL"]:
            shells.append(field_rows(str(path), lines, (NARROW,) * 6))
        elif word == [b"PART"]:
            names |= _part_names(lines)
    found, elements = np.concatenate(nodes), whole_numbers(str(path), np.concatenate(shells))
    numbers = whole_numbers(str(path), found[:, 0])
    corners = elements[:, 2:]
    indices = node_places(path, numbers, corners.ravel()).reshape(corners.shape)
    is_triangle = corners[:, 3] == corners[:, 2]
    counts = np.where(is_triangle, 3, 4)
    kept = np.ones(indices.shape, bool)
    kept[is_triangle, 3] = False
    parts = by_numbers(elements[:, 1], names, "part")
    return make_mesh(str(path), found[:, 1:], counts, indices[kept], data[:1024], parts)


def _part_names(text: bytes) -> dict[int, str]:
    """Return the names of parts by their numbers: a line of the name, then one that begins with a number."""
    lines = [line.decode("utf-8", "replace").strip() for line in text.splitlines()]
    numbers = (WHOLE.match(line) for line in lines[1::2])
    return {int(number[0]): name for name, number in zip(lines[::2], numbers, strict=False) if number}
