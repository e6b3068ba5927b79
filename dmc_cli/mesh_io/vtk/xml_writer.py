"""Write VTP, a surface of polygons, and VTU, a mesh of cells, in VTK's XML.

Binary numbers follow the XML as they lie in memory; where each array begins is known before. Space and unit
are texts among the fields of the file, where 3D Slicer reads the space.
"""

from collections.abc import Iterator, Mapping
from xml.sax.saxutils import quoteattr

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.text import number_lines
from dmc_cli.mesh_io.vtk.tables import (
    NORMALS,
    Table,
    colors_of,
    corners_of,
    ends_of,
    kinds_of,
    normals_of,
    points_of,
    values_of,
)

TYPES = {"i": "Int", "u": "UInt", "f": "Float"}
"""VTK's words for NumPy's kinds of numbers; the number of bits follows."""

Sections = Mapping[str, list[Table]]
"""What a piece has: elements, each with the tables in it."""


def encode_vtp(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a VTP file, with normals and values where the mesh has them."""
    counts = {"Points": len(mesh.points), "Verts": 0, "Lines": 0, "Strips": 0, "Polys": len(mesh.faces)}
    yield from _file("PolyData", counts, mesh, {"Polys": [corners_of(mesh), ends_of(mesh)]}, ascii)


def encode_vtu(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a VTU file, with normals and values where the mesh has them."""
    counts = {"Points": len(mesh.points), "Cells": len(mesh.faces)}
    cells = {"Cells": [corners_of(mesh), ends_of(mesh), kinds_of(mesh)]}
    yield from _file("UnstructuredGrid", counts, mesh, cells, ascii)


def _file(kind: str, counts: dict[str, int], mesh: MeshFile, faces: Sections, ascii: bool) -> Iterator[bytes]:
    """Yield a file with one piece."""
    sections = {
        f"PointData Normals={quoteattr(NORMALS)}" if mesh.normals is not None else "PointData": [
            *normals_of(mesh),
            *colors_of(mesh),
            *values_of(mesh.vertex_values),
        ],
        "CellData": values_of(mesh.face_values),
        "Points": [points_of(mesh)],
        **faces,
    }
    told = " ".join(f'NumberOf{name}="{count}"' for name, count in counts.items())
    yield (
        '<?xml version="1.0"?>\n<!-- written by dmc -->\n'
        f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
        f"<{kind}>\n{_fields(mesh)}<Piece {told}>\n"
    ).encode("ascii")
    offset = 0
    for name, tables in sections.items():
        yield f"<{name}>\n".encode("ascii")
        for table in tables:
            if ascii:
                yield f'{_opening(table)} format="ascii">\n'.encode("ascii")
                yield from map(number_lines, table.chunks())
                yield b"</DataArray>\n"
            else:
                yield f'{_opening(table)} format="appended" offset="{offset}"/>\n'.encode("ascii")
                offset += 8 + table.size
        yield f"</{name.split()[0]}>\n".encode("ascii")
    yield f"</Piece>\n</{kind}>\n".encode("ascii")
    if not ascii:
        yield b'<AppendedData encoding="raw">\n_'
        for table in (table for tables in sections.values() for table in tables):
            yield table.size.to_bytes(8, "little")
            yield from map(_little_endian, table.chunks())
        yield b"\n</AppendedData>\n"
    yield b"</VTKFile>\n"


def _opening(table: Table) -> str:
    """Return the beginning of the element of a table."""
    kind = f"{TYPES[table.dtype.kind]}{8 * table.dtype.itemsize}"
    columns = f' NumberOfComponents="{table.columns}"' if table.columns > 1 else ""
    return f'<DataArray type="{kind}" Name={quoteattr(table.name)}{columns}'


def _fields(mesh: MeshFile) -> str:
    """Return the element that holds the space and a unit that is not mm; texts are numbers that end in 0."""
    arrays = [
        f'<Array type="String" Name="{name}" NumberOfTuples="1" format="ascii">'
        f"{' '.join(map(str, text.encode('ascii')))} 0</Array>\n"
        for name, text in mesh.tags.items()
    ]
    return f"<FieldData>\n{''.join(arrays)}</FieldData>\n" if arrays else ""


def _little_endian(array: AnyArray) -> bytes:
    return np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
