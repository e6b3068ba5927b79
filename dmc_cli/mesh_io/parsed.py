"""Make a mesh of what a file had, once that is checked."""

from collections.abc import Iterable, Mapping
from pathlib import PurePath
from typing import Any, get_args

import numpy as np

from dmc_cli.array_types import AnyArray, Int32Array
from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.grouping import Grouping
from dmc_cli.mesh_io.mesh_file import NO_CORNER, VALUE_TYPES, MeshFile, fits_float32
from dmc_cli.mesh_io.numbers import whole_numbers
from dmc_cli.notices import Notice
from dmc_cli.settings import OutputUnit
from dmc_cli.volume import FARTHEST_MM, Space

FACES = ("triangle", "quad")
OTHER_FACES = ("triangle", "quad", "polygon")
"""What faces are called that are read, and how the names of all faces begin."""


def make_mesh(
    path: str,
    points: AnyArray,
    counts: AnyArray,
    corners: AnyArray,
    comments: bytes = b"",
    grouping: Grouping | None = None,
    **more: Any,
) -> MeshFile:
    """Return a mesh after checking it.

    Args:
        path: The file, for messages.
        points: Positions, (V, 3).
        counts: Corners of each face, (F,).
        corners: Vertices of all faces in a row, whole numbers, as many as `counts` adds up to.
        comments: The file's comments, which may name axes and unit.
        grouping: The groups of the faces, which are put one after the other.
        more: Normals, values and warnings, as `MeshFile` has them.

    Raises:
        UnsupportedFormatError: A face has neither three nor four corners.
        MeshFileError: There are more or fewer corners, one is no vertex that is there, or a coordinate is no
            float32 number.
    """
    odd = np.flatnonzero((counts < 3) | (counts > 4))
    if odd.size:
        raise UnsupportedFormatError(
            f"{path}: face {odd[0]} has {int(counts[odd[0]])} corners; expected 3 or 4;"
            " triangulate larger faces"
        )
    if counts.sum() != corners.size:
        raise MeshFileError(
            f"{path}: {corners.size} corners of {len(counts)} faces were found; expected {int(counts.sum())},"
            " as many as the faces count; it is damaged"
        )
    points = np.ascontiguousarray(points, dtype=np.float64)
    bad = np.flatnonzero(~fits_float32(points).all(axis=1))
    if bad.size:
        raise MeshFileError(
            f"{path}: vertex {bad[0]} is at {points[bad[0]].tolist()}; expected finite numbers up to"
            f" {FARTHEST_MM:.2g}, which float32 holds"
        )
    corners = whole_numbers(path, corners)
    outside = np.flatnonzero((corners < 0) | (corners >= len(points)))
    if outside.size:
        raise MeshFileError(
            f"{path}: a face names vertex {int(corners[outside[0]])}; expected 0 to {len(points) - 1},"
            f" since the file has {len(points)} vertices"
        )
    faces = _rows_of_four(counts, corners)
    if grouping is not None:
        faces, more = grouping.arranged(faces, more)
    space, unit = find_space(comments), find_unit(comments)
    return MeshFile(points=points, faces=faces, space=space, unit=unit, **more)


def usable_values(arrays: Mapping[str, AnyArray], told: list[str]) -> dict[str, AnyArray]:
    """Return the arrays that a mesh can have as values; the names of others are added to what is told."""
    values = {}
    for name, found in arrays.items():
        array = found[:, 0] if found.ndim == 2 and found.shape[1] == 1 else found
        array = array.astype(np.int32) if _fits_int32(array) else array
        is_word = name.isascii() and name.split() == [name]
        if is_word and array.dtype in VALUE_TYPES and array.ndim in (1, 2) and array.size:
            values[name] = np.ascontiguousarray(array, array.dtype.newbyteorder("="))
        elif len(array):
            told.append(f"values {name}")
    return values


def _fits_int32(array: AnyArray) -> bool:
    """Return whether these are integers of 64 bits, which no mesh has, that would do with 32."""
    limits = np.iinfo(np.int32)
    is_long = array.dtype.kind in "iu" and array.dtype.itemsize == 8
    return is_long and bool((array >= limits.min).all() and (array <= limits.max).all())


def other_cells(path: object, cells: Iterable[tuple[str, int]]) -> list[str]:
    """Return what is told of the cells that are no triangles or quads.

    Args:
        path: The file, for messages.
        cells: Kind and number of the cells in each block.

    Raises:
        UnsupportedFormatError: There are faces of another kind: without them the mesh had holes.
    """
    others = [(kind, count) for kind, count in cells if count and kind not in FACES]
    for kind, count in others:
        if kind.startswith(OTHER_FACES):
            raise UnsupportedFormatError(
                f"{path}: {count} faces of the kind {kind} found; expected triangles and quads; triangulate"
                " other faces"
            )
    return [f"{count} cells of {kind}" for kind, count in others]


def unread(path: object, parts: list[str]) -> tuple[Notice, ...]:
    """Return what is told of parts of a mesh file that are not read."""
    if not parts:
        return ()
    return (
        Notice("W-MESH-UNREAD", f"{PurePath(str(path)).name}: not read and not used: {', '.join(parts)}"),
    )


def find_space(comments: bytes) -> Space:
    """Return the axes that comments of a mesh file name, as 3D Slicer writes and reads them."""
    if b"SPACE=RAS" in comments:
        return "RAS"
    return "LPS" if b"SPACE=LPS" in comments else "none"


def find_unit(comments: bytes) -> OutputUnit:
    """Return the unit of the coordinates that comments of a mesh file name, mm where they name none."""
    return next((unit for unit in get_args(OutputUnit) if f"UNIT={unit}\n".encode() in comments), "mm")


def _rows_of_four(counts: AnyArray, corners: AnyArray) -> Int32Array:
    """Return the faces as rows of four, `NO_CORNER` after the corners of a triangle."""
    if (counts == 4).all():
        return corners.astype(np.int32).reshape(-1, 4)
    starts = np.cumsum(counts) - counts
    faces = np.full((len(counts), 4), NO_CORNER, dtype=np.int32)
    for c in range(3):
        faces[:, c] = corners[starts + c]
    is_quad = counts == 4
    faces[is_quad, 3] = corners[starts[is_quad] + 3]
    return faces
