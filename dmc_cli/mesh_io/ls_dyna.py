"""Write and read keyword files of LS-DYNA: nodes and shells in fields of eight and sixteen characters.

Each group is a part; a triangle has its third node twice. Space and unit stand in comments.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dmc_cli.array_types import AnyArray, ByteArray
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.numbered import Part, check_numbers, numbered_parts
from dmc_cli.mesh_io.numbers import NEWLINE, parse_numbers, whole_numbers
from dmc_cli.mesh_io.parsed import make_mesh
from dmc_cli.mesh_io.text import chunks_of, right_aligned, spans

NARROW, WIDE = 8, 16
"""Characters of a number of a node, an element or a part, and of a coordinate."""

MOST = 99_999_999
"""The largest number of a node or an element."""

SECTION = re.compile(rb"^\*(\w+)[^\n]*\n((?:[^*\n][^\n]*\n|\n)*)", re.MULTILINE)
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
    """Read the nodes and shells of a keyword file in fields of fixed width; all parts are one mesh.

    Raises:
        MeshFileError: A field is no number, or a shell names a node that is not there.
    """
    data = path.read_bytes().replace(b"\r\n", b"\n") + b"\n"
    text = COMMENT.sub(b"", data)
    nodes, shells = [np.zeros((0, 4))], [np.zeros((0, 6))]
    for section in SECTION.finditer(text):
        if section[1].upper() == b"NODE":
            nodes.append(_table(path, section[2], (NARROW, WIDE, WIDE, WIDE)))
        elif section[1].upper() == b"ELEMENT_SHELL":
            shells.append(_table(path, section[2], (NARROW,) * 6))
    found, elements = np.concatenate(nodes), whole_numbers(str(path), np.concatenate(shells))
    numbers = whole_numbers(str(path), found[:, 0])
    order = np.argsort(numbers, kind="stable")
    corners = elements[:, 2:]
    places = np.minimum(np.searchsorted(numbers[order], corners), max(len(numbers) - 1, 0))
    if corners.size and (not len(numbers) or (numbers[order][places] != corners).any()):
        raise MeshFileError(f"{path}: a shell names a node that is not there; expected numbers of *NODE")
    indices = order[places] if corners.size else corners
    is_triangle = corners[:, 3] == corners[:, 2]
    counts = np.where(is_triangle, 3, 4)
    kept = np.ones(indices.shape, bool)
    kept[is_triangle, 3] = False
    return make_mesh(str(path), found[:, 1:], counts, indices[kept], data[:1024])


def _table(path: Path, text: bytes, widths: tuple[int, ...]) -> AnyArray:
    """Return the numbers in the first fields of each line, commas or not, as rows."""
    lines = [line for line in text.split(b"\n") if line.strip()]
    ends = np.cumsum(widths).tolist()
    starts = [0, *ends[:-1]]
    spaced = (
        line.replace(b",", b" ")
        if b"," in line
        else b" ".join(line[a:b] for a, b in zip(starts, ends, strict=True))
        for line in lines
    )
    numbers = [row.split()[: len(widths)] for row in spaced]
    if any(len(row) < len(widths) for row in numbers):
        raise MeshFileError(f"{path}: a line with fewer than {len(widths)} numbers was found; it is damaged")
    return parse_numbers(str(path), b" ".join(b" ".join(row) for row in numbers)).reshape(-1, len(widths))
