"""Read VTP and VTU: the pieces of a file, joined."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.vtk.cells import POLYGON, Found, mesh_of_cells
from dmc_cli.mesh_io.vtk.xml_arrays import XmlFile

OTHER_KINDS = {"Verts": 2, "Lines": 4, "Strips": 6, "Polys": POLYGON}
"""VTK's numbers of what a piece of polygons holds, in the order of its data."""


def read_vtp(path: Path) -> MeshFile:
    """Read the polygons, normals and values of a VTP file.

    Raises:
        MeshFileError: The file is damaged, or of another kind.
        UnsupportedFormatError: A face has more than four corners, or a way to pack data is not known.
    """
    return _read(path, "PolyData")


def read_vtu(path: Path) -> MeshFile:
    """Read the triangles and quads, normals and values of a VTU file; other cells are told.

    Raises:
        MeshFileError: The file is damaged, or of another kind.
        UnsupportedFormatError: A face has more than four corners, or a way to pack data is not known.
    """
    return _read(path, "UnstructuredGrid")


def _read(path: Path, kind: str) -> MeshFile:
    file = XmlFile(path)
    grid = file.root.find(kind)
    if grid is None:
        raise MeshFileError(
            f"{path}: VTK's {file.root.get('type')} was found; expected {kind}; give the file the suffix of"
            " what it is"
        )
    pieces = [_piece(file, piece, kind) for piece in grid.findall("Piece")]
    if not pieces:
        raise MeshFileError(f"{path}: no element Piece was found; expected points and faces in one")
    found = _joined(pieces)
    found.comments = b"".join(_comments(file, grid))
    return mesh_of_cells(path, found)


def _comments(file: XmlFile, grid: Element) -> Iterator[bytes]:
    """Yield the texts among the fields of a file as comments name space and unit."""
    for element in [*file.root.findall("FieldData/*"), *grid.findall("FieldData/*")]:
        name = element.get("Name", "")
        if element.get("type") == "String" and name in ("SPACE", "UNIT"):
            text = file.array(element).astype(np.uint8).tobytes().split(b"\0")[0]
            yield name.encode() + b"=" + text + b"\n"


def _piece(file: XmlFile, piece: Element, kind: str) -> Found:
    """Return what a piece holds."""
    points = piece.find("Points/DataArray")
    places = np.zeros((0, 3)) if points is None else file.array(points)
    if places.ndim == 1 and not places.size:
        places = places.reshape(0, 3)
    if places.ndim != 2 or places.shape[1] != 3:
        raise MeshFileError(f"{file.path}: points of shape {places.shape} were found; expected x, y and z")
    cells = [_cells(file, piece, name, number) for name, number in OTHER_KINDS.items()]
    if kind != "PolyData":
        cells = [_cells(file, piece, "Cells", None)]
    ends, corners, kinds = _chained(cells)
    return Found(
        places, ends, corners, kinds, _data(file, piece, "PointData"), _data(file, piece, "CellData")
    )


def _cells(
    file: XmlFile, piece: Element, section: str, kind: int | None
) -> tuple[AnyArray, AnyArray, AnyArray]:
    """Return ends, corners and kinds of the cells of a section, all of one kind or as it says."""
    arrays = {
        element.get("Name", ""): file.array(element).ravel()
        for element in piece.findall(f"{section}/DataArray")
        if element.get("Name") in ("connectivity", "offsets", "types")
    }
    empty = np.zeros(0, np.int64)
    ends = arrays.get("offsets", empty).astype(np.int64)
    kinds = arrays.get("types", empty).astype(np.int64) if kind is None else np.full(len(ends), kind)
    return ends, arrays.get("connectivity", empty).astype(np.int64), kinds


def _chained(cells: list[tuple[AnyArray, AnyArray, AnyArray]]) -> tuple[AnyArray, AnyArray, AnyArray]:
    """Return the cells of several sections as those of one."""
    shifts = np.cumsum([0, *(len(corners) for _, corners, _ in cells)])
    ends = np.concatenate([found + shift for (found, _, _), shift in zip(cells, shifts[:-1], strict=True)])
    return ends, np.concatenate([c for _, c, _ in cells]), np.concatenate([k for _, _, k in cells])


def _data(file: XmlFile, piece: Element, section: str) -> dict[str, AnyArray]:
    """Return the values of points or cells by name."""
    elements = piece.findall(f"{section}/DataArray")
    return {
        element.get("Name", "values"): file.array(element)
        for element in elements
        if element.get("type") != "String"
    }


def _joined(pieces: list[Found]) -> Found:
    """Return several pieces as one, with the values that all have."""
    if len(pieces) == 1:
        return pieces[0]
    starts = np.cumsum([0, *(len(piece.points) for piece in pieces)])
    ends, corners, kinds = _chained(
        [
            (piece.ends, piece.corners + start, piece.kinds)
            for piece, start in zip(pieces, starts[:-1], strict=True)
        ]
    )
    data, told = [], []
    for tables in ([piece.point_data for piece in pieces], [piece.cell_data for piece in pieces]):
        shared = [
            name
            for name in tables[0]
            if len({table[name].shape[1:] if name in table else None for table in tables}) == 1
        ]
        data.append({name: np.concatenate([table[name] for table in tables]) for name in shared})
        told += [f"values {name} of some pieces" for name in {n for t in tables for n in t} - set(shared)]
    points = np.concatenate([piece.points for piece in pieces])
    return Found(points, ends, corners, kinds, data[0], data[1], sorted(told))
