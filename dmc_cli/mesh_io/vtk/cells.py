"""Make a mesh of what files of VTK call points, polygons, cells and data."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dmc_cli.array_types import AnyArray, BoolArray
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.parsed import make_mesh, unread, usable_values
from dmc_cli.mesh_io.vtk.tables import NORMALS, QUAD, TRIANGLE

POLYGON, PIXEL = 7, 8
"""VTK's numbers of two more kinds: a ring of any length; a quad whose corners stand row by row."""

SURFACES = (TRIANGLE, POLYGON, PIXEL, QUAD)

CURVED = {
    6: "triangle strip", 22: "triangle6", 23: "quad8", 28: "quad9", 30: "quad6", 34: "triangle7",
    36: "polygon2", 69: "triangle of higher order", 70: "quad of higher order",
    76: "Bezier triangle", 77: "Bezier quad",
}  # fmt: skip
"""Faces that no mesh of ours has, by VTK's numbers: strips, and those with curved sides."""

OTHERS = {
    1: "vertex", 2: "vertices", 3: "line", 4: "polyline", 10: "tetra", 11: "voxel", 12: "hexahedron",
    13: "wedge", 14: "pyramid", 21: "line3", 24: "tetra10", 25: "hexahedron20", 42: "polyhedron",
}  # fmt: skip
"""What is no face."""


@dataclass
class Found:
    """What a file holds.

    Attributes:
        points: Positions, (V, 3).
        ends: Where the corners of each cell end.
        corners: Those of all cells in a row.
        kinds: VTK's number of each cell's kind.
        point_data: Values of points by name.
        cell_data: Values of cells.
        told: What was found and is not read.
        comments: What tells space and unit.
    """

    points: AnyArray
    ends: AnyArray
    corners: AnyArray
    kinds: AnyArray
    point_data: dict[str, AnyArray] = field(default_factory=dict)
    cell_data: dict[str, AnyArray] = field(default_factory=dict)
    told: list[str] = field(default_factory=list)
    comments: bytes = b""


def mesh_of_cells(path: Path, found: Found) -> MeshFile:
    """Return the mesh of all faces, and tell the other cells.

    Raises:
        MeshFileError: The tables do not fit together.
        UnsupportedFormatError: A face is of a kind that no mesh of ours has.
    """
    _check(path, found)
    is_face = np.isin(found.kinds, SURFACES)
    told = []
    for kind in np.unique(found.kinds[~is_face]).tolist():
        count = int((found.kinds == kind).sum())
        if kind in CURVED:
            raise UnsupportedFormatError(
                f"{path}: {count} faces of the kind {CURVED[kind]} found; expected triangles and quads;"
                " triangulate other faces"
            )
        told.append(f"{count} cells of {OTHERS.get(kind, f'the kind {kind}')}")
    counts = np.diff(found.ends, prepend=0)
    corners = found.corners[np.repeat(is_face, counts)]
    counts = counts[is_face]
    corners = _rings(corners, counts, found.kinds[is_face] == PIXEL)
    normals = found.point_data.pop(NORMALS, None)
    if normals is not None and not _are_normals(normals):
        found.point_data[NORMALS] = normals
        normals = None
    vertex_values = usable_values(found.point_data, told)
    face_values = usable_values({name: array[is_face] for name, array in found.cell_data.items()}, told)
    return make_mesh(
        str(path),
        found.points,
        counts,
        corners,
        found.comments,
        normals=None if normals is None else normals.astype(np.float32),
        vertex_values=vertex_values,
        face_values=face_values,
        warnings=unread(path, [*found.told, *told]),
    )


def _check(path: Path, found: Found) -> None:
    """Raise MeshFileError unless the tables have rows for each other."""
    ends, cells = found.ends, len(found.kinds)
    is_rising = len(ends) == cells and (np.diff(ends, prepend=0) >= 0).all()
    if not is_rising or (ends[-1] if cells else 0) != len(found.corners):
        raise MeshFileError(
            f"{path}: {len(found.corners)} corners of {cells} cells were found, which do not fit the ends"
            " that are told; expected each cell's end, in their order; it is damaged"
        )
    data = [(name, array, len(found.points)) for name, array in found.point_data.items()]
    data += [(name, array, cells) for name, array in found.cell_data.items()]
    for name, array, count in data:
        if len(array) != count:
            raise MeshFileError(
                f"{path}: the values {name} have {len(array)} rows; expected {count}; it is damaged"
            )


def _rings(corners: AnyArray, counts: AnyArray, is_pixel: BoolArray) -> AnyArray:
    """Return the corners with those of pixels in the order of a ring."""
    if not is_pixel.any():
        return corners
    starts = (np.cumsum(counts) - counts)[is_pixel & (counts == 4)]
    corners = corners.copy()
    corners[starts + 2], corners[starts + 3] = corners[starts + 3], corners[starts + 2]
    return corners


def _are_normals(array: AnyArray) -> bool:
    return array.ndim == 2 and array.shape[1] == 3 and bool(np.isfinite(array.astype(np.float32)).all())
