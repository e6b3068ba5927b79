"""Write the format of Gmsh, version 4.1: sections between `$Name` and `$EndName`, binary or text.

Each group is a physical surface. Space and unit stand in a section of comments. Values are doubles; one of
two numbers an item, or of more than three, is several.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.numbered import Part, numbered_parts
from dmc_cli.mesh_io.text import chunks_of, join_lines, number_lines, spans

KINDS = {3: 2, 4: 3}
"""Gmsh's numbers of a triangle and a quad, by their corners."""

SURFACE = 2
"""The dimension of what elements and nodes lie on."""


def encode_gmsh(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a .msh file, with values and groups where the mesh has them."""
    tags = "".join(f"{name}={value}\n" for name, value in mesh.tags.items())
    yield f"$MeshFormat\n4.1 {0 if ascii else 1} 8\n".encode("ascii")
    yield b"" if ascii else np.array(1, "<i4").tobytes() + b"\n"
    yield f"$EndMeshFormat\n$Comments\nwritten by dmc\n{tags}$EndComments\n".encode("ascii")
    parts = numbered_parts(mesh)
    if mesh.groups:
        names = "".join(f'{SURFACE} {part.number} "{part.title}"\n' for part in parts)
        yield f"$PhysicalNames\n{len(parts)}\n{names}$EndPhysicalNames\n".encode()
    yield from _section("Entities", _entities(mesh, parts, ascii), ascii)
    yield from _section("Nodes", _nodes(mesh, ascii), ascii)
    yield from _section("Elements", _elements(mesh, parts, ascii), ascii)
    for name, column in _columns(mesh.vertex_values):
        yield from _section("NodeData", _data(name, column, _counted(len(column)), ascii), ascii)
    for name, column in _columns(mesh.face_values):
        yield from _section("ElementData", _data(name, column, _faces(parts), ascii), ascii)


def _section(name: str, pieces: Iterator[bytes], ascii: bool) -> Iterator[bytes]:
    """Yield a section with its name before and behind."""
    yield f"${name}\n".encode("ascii")
    yield from pieces
    yield f"{'' if ascii else chr(10)}$End{name}\n".encode("ascii")


def _integers(ascii: bool, *numbers: int, sizes: bool = False) -> bytes:
    """Return a row of integers; in binary files sizes take eight bytes, others four."""
    if ascii:
        return f"{' '.join(map(str, numbers))}\n".encode("ascii")
    return np.array(numbers, "<u8" if sizes else "<i4").tobytes()


def _reals(ascii: bool, rows: AnyArray) -> bytes:
    """Return rows of numbers as doubles."""
    return number_lines(rows) if ascii else rows.astype("<f8").tobytes()


def _entities(mesh: MeshFile, parts: list[Part], ascii: bool) -> Iterator[bytes]:
    """Yield the surfaces, one a part: box, physical group, no curve round it."""
    yield _integers(ascii, 0, 0, len(parts), 0, sizes=True)
    for part in parts:
        used = part.faces[part.faces >= 0]
        points = mesh.points[used] if used.size else np.zeros((1, 3))
        box = np.concatenate([points.min(axis=0), points.max(axis=0)]).astype(np.float32)
        yield _line(ascii, _integers(ascii, part.number), _reals(ascii, box[None]))
        groups = [part.number] if mesh.groups else []
        yield _integers(ascii, len(groups), sizes=True)
        yield _integers(ascii, *groups) if groups else b""
        yield _integers(ascii, 0, sizes=True)


def _line(ascii: bool, *pieces: bytes) -> bytes:
    """Join pieces, in text as one line."""
    return b" ".join(piece.rstrip(b"\n") for piece in pieces) + b"\n" if ascii else b"".join(pieces)


def _nodes(mesh: MeshFile, ascii: bool) -> Iterator[bytes]:
    """Yield the nodes: all numbers, then all places."""
    count = len(mesh.points)
    yield _integers(ascii, int(count > 0), count, int(count > 0), count, sizes=True)
    if not count:
        return
    counted = _integers(ascii, count, sizes=True)
    yield _line(ascii, _integers(ascii, SURFACE, 1, 0), counted)
    for numbers in _counted(count):
        yield number_lines(numbers) if ascii else numbers.astype("<u8").tobytes()
    for rows in chunks_of(mesh.points, np.float32):
        yield _reals(ascii, rows)


def _counted(count: int) -> Iterator[AnyArray]:
    """Yield the numbers from 1 in chunks."""
    for start, stop in spans(count):
        yield np.arange(start + 1, stop + 1)


def _elements(mesh: MeshFile, parts: list[Part], ascii: bool) -> Iterator[bytes]:
    """Yield the elements, numbered from 1, a block for triangles and one for quads of each part."""
    blocks = [(part, corners) for part in parts for corners in KINDS if part.count(corners)]
    count = len(mesh.faces)
    yield _integers(ascii, len(blocks), count, int(count > 0), count, sizes=True)
    number = 1
    for part, corners in blocks:
        counted = _integers(ascii, part.count(corners), sizes=True)
        yield _line(ascii, _integers(ascii, SURFACE, part.number, KINDS[corners]), counted)
        for rows in part.rows(corners):
            rows[:, 0] = np.arange(number, number + len(rows))
            number += len(rows)
            yield number_lines(rows) if ascii else rows.astype("<u8").tobytes()


def _columns(values: Mapping[str, AnyArray]) -> Iterator[tuple[str, AnyArray]]:
    """Yield values of one number an item or three; what has others is taken apart."""
    for name, array in values.items():
        if array.ndim == 1 or array.shape[1] == 3:
            yield name, array
        else:
            yield from ((f"{name}_{c}", array[:, c]) for c in range(array.shape[1]))


def _faces(parts: list[Part]) -> Iterator[AnyArray]:
    """Yield the numbers of the faces, from 1, in the order that elements stand in."""
    for part in parts:
        for corners in KINDS:
            for rows in part.rows(corners):
                yield rows[:, 0]


def _data(name: str, column: AnyArray, items: Iterator[AnyArray], ascii: bool) -> Iterator[bytes]:
    """Yield a value of nodes or elements: a name, a time of 0, its size, then a row an item.

    Args:
        name: Its name.
        column: The values.
        items: Which of them, from 1, nodes or elements 1, 2, ... have.
        ascii: Whether it is text.
    """
    width = 1 if column.ndim == 1 else column.shape[1]
    yield f'1\n"{name}"\n1\n0.0\n3\n0\n{width}\n{len(column)}\n'.encode("ascii")
    layout = np.dtype([("number", "<i4"), ("values", "<f8", (width,))])
    start = 1
    for found in items:
        numbers = np.arange(start, start + len(found))
        start += len(found)
        values = np.ascontiguousarray(column[found - 1])
        if ascii:
            yield join_lines([number_lines(numbers), number_lines(values)])
        else:
            rows = np.empty(len(found), layout)
            rows["number"], rows["values"] = numbers, values.reshape(len(found), width)
            yield rows.tobytes()
