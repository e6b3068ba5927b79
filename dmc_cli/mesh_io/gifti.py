"""Write and read GIfTI surfaces, as neuroimaging has them: points and triangles in XML, numbers in base64.

Coordinates are RAS in millimetres by the standard; a mesh in LPS is turned to it. FreeSurfer puts tkrRAS
there, with the volume that it is relative to (`volume/tkr.py`) in the points' metadata.
"""

import base64
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.parsed import make_mesh, unread
from dmc_cli.mesh_io.patient import UNREADABLE, checked_geometry, in_ras, patient_points, patient_triangles
from dmc_cli.mesh_io.text import number_lines
from dmc_cli.mesh_io.triangles import triangle_count
from dmc_cli.volume import VolumeGeometry

POINTS, TRIANGLES = 1008, 1009
"""NIfTI's numbers of what an array is: places of vertices, corners of triangles."""

ARRAY = (
    '<DataArray Intent="NIFTI_INTENT_{intent}" DataType="NIFTI_TYPE_{kind}" Dimensionality="2" Dim0="{rows}"'
    ' Dim1="3" ArrayIndexingOrder="RowMajorOrder" Encoding="{encoding}" Endian="LittleEndian"'
    ' ExternalFileName="" ExternalFileOffset="">\n{metadata}\n'
)
ENTRY = "<MD><Name><![CDATA[VolGeom{name}]]></Name><Value><![CDATA[{value:.15g}]]></Value></MD>\n"
SHAPE, SPACING, VECTORS = ("Width", "Height", "Depth"), ("Xsize", "Ysize", "Zsize"), ("X", "Y", "Z", "C")
"""FreeSurfer's names: nodes, distances, and with `_R`, `_A`, `_S` behind them directions and centre."""

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
    metadata = "<MetaData/>" if mesh.geometry is None else _metadata(mesh.geometry)
    is_scanner = mesh.space != "none" and mesh.geometry is None
    yield begin(intent="POINTSET", kind="FLOAT32", rows=len(mesh.points), metadata=metadata).encode("ascii")
    yield SPACE.format(space=SCANNER if is_scanner else UNKNOWN).encode("ascii") + b"<Data>"
    yield from map(write, patient_points(mesh))
    yield b"</Data>\n</DataArray>\n"
    count = triangle_count(mesh)
    begun = begin(intent="TRIANGLE", kind="INT32", rows=count, metadata="<MetaData/>")
    yield f"{begun}<Data>".encode("ascii")
    yield from map(write, patient_triangles(mesh))
    yield b"</Data>\n</DataArray>\n</GIFTI>\n"


def _metadata(geometry: VolumeGeometry) -> str:
    """Return the volume that tkrRAS is relative to, as FreeSurfer tells it."""
    numbers = [*zip(SHAPE, geometry.shape, strict=True), *zip(SPACING, geometry.spacing, strict=True)]
    for name, vector in zip(VECTORS, (*geometry.axes, geometry.centre), strict=True):
        numbers += [(f"{name}_{axis}", float(value)) for axis, value in zip("RAS", vector, strict=True)]
    entries = "".join(ENTRY.format(name=name, value=value) for name, value in numbers)
    return f"<MetaData>\n{entries}</MetaData>"


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
        metadata = {} if is_known else dict(arrays[POINTS].meta)
        geometry = _geometry(metadata)
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
    corners = np.asarray(triangles)
    if geometry is not None:
        points, corners = in_ras(np.asarray(points), corners, geometry)
    told = [f"{len(others)} arrays of values"] if others else []
    is_named = any(name.startswith("VolGeom") for name in metadata)
    told += [UNREADABLE] if is_named and geometry is None else []
    return make_mesh(
        str(path),
        points,
        np.full(len(corners), 3),
        corners.ravel(),
        b"SPACE=RAS\n" if is_known or geometry is not None else b"",
        geometry=geometry,
        warnings=unread(path, told),
    )


def _geometry(metadata: Mapping[str, str]) -> VolumeGeometry | None:
    """Return the volume that FreeSurfer tells beside points in tkrRAS; None without one."""
    try:
        shape, spacing = (
            np.array([float(metadata[f"VolGeom{name}"]) for name in names]) for names in (SHAPE, SPACING)
        )
        vectors = np.array([[float(metadata[f"VolGeom{name}_{axis}"]) for axis in "RAS"] for name in VECTORS])
    except (KeyError, ValueError):
        return None
    return checked_geometry(shape, spacing, vectors[:3], vectors[3])
