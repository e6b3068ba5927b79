"""Write and read GIfTI surfaces, as neuroimaging has them: points and triangles in XML, numbers in base64.

Coordinates are RAS in millimetres by the standard; a mesh in LPS is turned to it.
"""

import base64
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.parsed import make_mesh, unread
from dmc_cli.mesh_io.patient import in_ras
from dmc_cli.mesh_io.text import number_lines
from dmc_cli.mesh_io.triangles import triangle_chunks, triangle_count

POINTS, TRIANGLES = 1008, 1009
"""NIfTI's numbers of what an array is: places of vertices, corners of triangles."""

ARRAY = (
    '<DataArray Intent="NIFTI_INTENT_{intent}" DataType="NIFTI_TYPE_{kind}" Dimensionality="2" Dim0="{rows}"'
    ' Dim1="3" ArrayIndexingOrder="RowMajorOrder" Encoding="{encoding}" Endian="LittleEndian"'
    ' ExternalFileName="" ExternalFileOffset="">\n<MetaData/>\n'
)
SPACE = (
    "<CoordinateSystemTransformMatrix>\n<DataSpace>{space}</DataSpace>\n<TransformedSpace>{space}"
    "</TransformedSpace>\n<MatrixData>1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n</MatrixData>\n"
    "</CoordinateSystemTransformMatrix>\n"
)
SCANNER, UNKNOWN = "NIFTI_XFORM_SCANNER_ANAT", "NIFTI_XFORM_UNKNOWN"


def encode_gifti(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a GIfTI surface, quads split into triangles."""
    encoding = "ASCII" if ascii else "Base64Binary"
    write = number_lines if ascii else _base64
    begin = partial(ARRAY.format, encoding=encoding)
    yield (
        b'<?xml version="1.0" encoding="UTF-8"?>\n'
        b'<!DOCTYPE GIFTI SYSTEM "http://www.nitrc.org/frs/download.php/115/gifti.dtd">\n'
        b'<GIFTI Version="1.0" NumberOfDataArrays="2">\n<MetaData/>\n<LabelTable/>\n'
    )
    yield begin(intent="POINTSET", kind="FLOAT32", rows=len(mesh.points)).encode("ascii")
    yield SPACE.format(space=UNKNOWN if mesh.space == "none" else SCANNER).encode("ascii") + b"<Data>"
    yield from map(write, in_ras(mesh))
    yield b"</Data>\n</DataArray>\n"
    yield begin(intent="TRIANGLE", kind="INT32", rows=triangle_count(mesh)).encode("ascii") + b"<Data>"
    yield from map(write, triangle_chunks(mesh))
    yield b"</Data>\n</DataArray>\n</GIFTI>\n"


def _base64(rows: AnyArray) -> bytes:
    """Return rows of three numbers of four bytes in base64: what follows can be joined to it."""
    return base64.b64encode(rows.astype(rows.dtype.newbyteorder("<"), copy=False).tobytes())


def read_gifti(path: Path) -> MeshFile:
    """Read the points and triangles of a GIfTI surface, by nibabel.

    Raises:
        MeshFileError: The file is damaged, or holds no surface.
    """
    from nibabel.gifti import GiftiImage

    try:
        image: Any = GiftiImage.from_filename(path)
        arrays = {array.intent: array for array in image.darrays}
        points, triangles = arrays[POINTS].data, arrays[TRIANGLES].data
        others = [array for array in image.darrays if array.intent not in (POINTS, TRIANGLES)]
        is_known = arrays[POINTS].coordsys is not None and arrays[POINTS].coordsys.dataspace != 0
        shapes = (np.shape(points)[1:], np.shape(triangles)[1:])
    except KeyError as error:
        raise MeshFileError(
            f"{path}: no array of the intent {error} was found; expected points ({POINTS}) and triangles"
            f" ({TRIANGLES}); name a surface, such as .surf.gii"
        ) from error
    except Exception as error:
        raise MeshFileError(f"{path}: nibabel cannot read it: {error}") from error
    if shapes != ((3,), (3,)):
        raise MeshFileError(
            f"{path}: points and triangles of {shapes} numbers were found; expected three each"
        )
    told = [f"{len(others)} arrays of values"] if others else []
    return make_mesh(
        str(path),
        points,
        np.full(len(triangles), 3),
        np.asarray(triangles).ravel(),
        b"SPACE=RAS\n" if is_known else b"",
        warnings=unread(path, told),
    )
