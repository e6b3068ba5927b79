"""Write and read XDMF 3, as ParaView, FEniCS and others have it: XML with the numbers as text in it.

Space and unit stand in comments. Triangles beside quads are cells of mixed kinds, in their order.
"""

from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.mesh_io.mesh_file import NO_CORNER, MeshFile
from dmc_cli.mesh_io.meshio_file import read_with_meshio
from dmc_cli.mesh_io.text import chunks_of, number_lines

TRIANGLE, QUAD = 4, 5
"""XDMF's numbers of the two kinds among mixed cells."""

TYPES = {"i": "Int", "u": "UInt", "f": "Float"}
SHAPES = {1: "Scalar", 3: "Vector"}
"""What XDMF calls values of one number and of three; it calls others a matrix."""


def encode_xdmf(mesh: MeshFile, *, ascii: bool = True) -> Iterator[bytes]:
    """Yield the bytes of an XDMF file, with values where the mesh has them; it is always text."""
    tags = "".join(f"<!--\n{name}={value}\n-->\n" for name, value in mesh.tags.items())
    yield (
        f'<?xml version="1.0" encoding="utf-8"?>\n<!-- written by dmc -->\n{tags}'
        '<Xdmf Version="3.0">\n<Domain>\n<Grid Name="mesh">\n<Geometry GeometryType="XYZ">\n'
    ).encode("ascii")
    yield from _item((len(mesh.points), 3), np.dtype(np.float32), chunks_of(mesh.points, np.float32))
    yield b"</Geometry>\n"
    yield from _topology(mesh)
    for center, values in (("Node", mesh.vertex_values), ("Cell", mesh.face_values)):
        for name, array in values.items():
            shape = SHAPES.get(1 if array.ndim == 1 else array.shape[1], "Matrix")
            told = f'<Attribute Name={quoteattr(name)} AttributeType="{shape}" Center="{center}">\n'
            yield told.encode("ascii")
            yield from _item(array.shape, array.dtype, chunks_of(array))
            yield b"</Attribute>\n"
    yield b"</Grid>\n</Domain>\n</Xdmf>\n"


def read_xdmf(path: Path) -> MeshFile:
    """Read the triangles and quads of an XDMF file with their values, by meshio.

    Raises:
        MeshFileError: The file is damaged, or keeps numbers in an HDF5 file that cannot be read.
        UnsupportedFormatError: Faces of another kind.
    """
    return read_with_meshio(path, "xdmf")


def _topology(mesh: MeshFile) -> Iterator[bytes]:
    """Yield the faces: rows of corners where all have as many, else each behind the number of its kind."""
    count, triangles = len(mesh.faces), mesh.triangle_count
    if triangles in (0, count):
        corners, kind = (3, "Triangle") if triangles else (4, "Quadrilateral")
        rows: Iterator[AnyArray] = (faces[:, :corners] for faces in chunks_of(mesh.faces))
        shape: tuple[int, ...] = (count, corners)
    else:
        kind, rows, shape = "Mixed", map(_mixed, chunks_of(mesh.faces)), (5 * count - triangles,)
    yield f'<Topology TopologyType="{kind}" NumberOfElements="{count}">\n'.encode("ascii")
    yield from _item(shape, np.dtype(np.int32), rows)
    yield b"</Topology>\n"


def _mixed(faces: AnyArray) -> AnyArray:
    """Return the numbers of kinds and corners of faces in a row."""
    is_triangle = faces[:, 3] == NO_CORNER
    kinds = np.where(is_triangle, TRIANGLE, QUAD).astype(np.int32)
    rows = np.column_stack([kinds, faces])
    numbers: AnyArray = rows[rows != NO_CORNER]
    return numbers


def _item(shape: tuple[int, ...], dtype: np.dtype[np.generic], chunks: Iterator[AnyArray]) -> Iterator[bytes]:
    """Yield an array as text."""
    sizes = " ".join(map(str, shape))
    kind, size = TYPES[dtype.kind], dtype.itemsize
    yield (f'<DataItem DataType="{kind}" Dimensions="{sizes}" Format="XML" Precision="{size}">\n').encode(
        "ascii"
    )
    for rows in chunks:
        yield number_lines(np.ascontiguousarray(rows))
    yield b"</DataItem>\n"
