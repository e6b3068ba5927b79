"""Write the legacy format of VTK, version 4.2: lines of words, then numbers, binary in big endian or text.

Space and unit stand in the title, where 3D Slicer reads the space.
"""

from collections.abc import Iterator

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.mesh_io.mesh_file import NO_CORNER, MeshFile
from dmc_cli.mesh_io.text import chunks_of, face_lines, number_lines
from dmc_cli.mesh_io.vtk.tables import (
    NORMALS,
    Table,
    colors_of,
    corner_count,
    normals_of,
    points_of,
    values_of,
)

TYPES = {
    "i1": "char", "u1": "unsigned_char", "i2": "short", "u2": "unsigned_short", "i4": "int",
    "u4": "unsigned_int", "f4": "float", "f8": "double",
}  # fmt: skip
"""VTK's words for NumPy's types."""


def encode_legacy(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a legacy VTK file of polygons, with normals and values where the mesh has them."""
    tags = [f"{name}={value}" for name, value in mesh.tags.items()]
    yield (
        f"# vtk DataFile Version 4.2\n{' '.join(['written by dmc', *tags])}\n"
        f"{'ASCII' if ascii else 'BINARY'}\nDATASET POLYDATA\nPOINTS {len(mesh.points)} float\n"
    ).encode("ascii")
    yield from _numbers(points_of(mesh), ascii)
    yield f"POLYGONS {len(mesh.faces)} {len(mesh.faces) + corner_count(mesh)}\n".encode("ascii")
    for faces in chunks_of(mesh.faces):
        yield face_lines(faces) if ascii else _face_rows(faces)
    yield b"" if ascii else b"\n"
    colors = colors_of(mesh)
    if mesh.normals is not None or mesh.vertex_values or colors:
        yield f"POINT_DATA {len(mesh.points)}\n".encode("ascii")
        for table in normals_of(mesh):
            yield f"NORMALS {NORMALS} float\n".encode("ascii")
            yield from _numbers(table, ascii)
        yield from _fields([*colors, *values_of(mesh.vertex_values)], ascii)
    if mesh.face_values:
        yield f"CELL_DATA {len(mesh.faces)}\n".encode("ascii")
        yield from _fields(values_of(mesh.face_values), ascii)


def _fields(tables: list[Table], ascii: bool) -> Iterator[bytes]:
    """Yield tables as a field, which takes any number of columns."""
    if tables:
        yield f"FIELD FieldData {len(tables)}\n".encode("ascii")
    for table in tables:
        kind = TYPES[f"{table.dtype.kind}{table.dtype.itemsize}"]
        yield f"{_quoted(table.name)} {table.columns} {table.rows} {kind}\n".encode("ascii")
        yield from _numbers(table, ascii)


def _quoted(name: str) -> str:
    """Return a name as VTK writes it: what could be taken for something else by its number."""
    return "".join(f"%{ord(c):02X}" if c in '"%' else c for c in name)


def _numbers(table: Table, ascii: bool) -> Iterator[bytes]:
    """Yield the numbers of a table; binary ones end with a newline."""
    for chunk in table.chunks():
        yield number_lines(chunk) if ascii else _big_endian(chunk)
    if not ascii:
        yield b"\n"


def _face_rows(faces: AnyArray) -> bytes:
    """Return how many corners each face has, and the corners."""
    is_there = faces != NO_CORNER
    rows = np.column_stack([is_there.sum(axis=1, dtype=np.int32), faces])
    return _big_endian(rows[np.column_stack([np.ones(len(faces), bool), is_there])])


def _big_endian(array: AnyArray) -> bytes:
    return array.astype(array.dtype.newbyteorder(">")).tobytes()
