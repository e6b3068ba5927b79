"""Read PLY: a header that names elements and their properties, then their values as text or binary.

Faces have one list, their vertices. What else vertices and faces have is read as values; other elements are
passed over.
"""

from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, Float32Array, Float64Array
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.mesh_file import MeshFile, fits_float32
from dmc_cli.mesh_io.numbers import parse_numbers
from dmc_cli.mesh_io.parsed import make_mesh
from dmc_cli.mesh_io.ply.header import Element, parse_header
from dmc_cli.mesh_io.ply.items import Body, Items, read_items
from dmc_cli.mesh_io.ply.properties import NORMAL, POINT, as_values


def read_ply(path: Path) -> MeshFile:
    """Read the points, faces, normals and values of a PLY file.

    Raises:
        MeshFileError: The header or the values are not what the format has, or the file ends early.
        UnsupportedFormatError: A layout that is not read, or a face with more than four corners.
    """
    data = path.read_bytes()
    elements, order, start = parse_header(str(path), data)
    numbers = memoryview(data)[start:]
    if not order:
        numbers = memoryview(parse_numbers(str(path), bytes(numbers)).tobytes())
    found = _read_elements(Body(str(path), numbers, order), elements)
    if "vertex" not in found:
        raise MeshFileError(f"{path}: no element vertex was found; expected points with x, y and z")
    element, items = found["vertex"]
    points = np.column_stack([_coordinate(path, items.columns, axis) for axis in POINT])
    normals = _normals(items.columns)
    taken = POINT if normals is None else POINT + NORMAL
    vertex_values = _values(element, items, taken)
    counts, corners, face_values = np.zeros(0, np.int64), np.zeros(0, np.int64), {}
    if "face" in found:
        element, items = found["face"]
        counts, corners, face_values = items.lengths, items.entries, _values(element, items)
    return make_mesh(
        str(path),
        points,
        counts,
        corners,
        data[:start],
        normals=normals,
        vertex_values=vertex_values,
        face_values=face_values,
    )


def _read_elements(body: Body, elements: list[Element]) -> dict[str, tuple[Element, Items]]:
    """Return the elements with what they hold by their names; faces without corners are none."""
    found = {}
    position = 0
    for element in elements:
        items = read_items(body, element, position)
        position = items.end
        if element.name != "face" or element.list_name:
            found[element.name] = (element, items)
    return found


def _coordinate(path: Path, columns: dict[str, AnyArray], axis: str) -> Float64Array:
    """Return a coordinate of the vertices as float64."""
    if axis not in columns:
        raise MeshFileError(f"{path}: the vertices have no property {axis}; expected x, y and z")
    return _converted(columns[axis], np.dtype(np.float64))


def _normals(columns: dict[str, AnyArray]) -> Float32Array | None:
    """Return the normals if there are any and all are finite; others stay values."""
    if not set(NORMAL) <= set(columns):
        return None
    normals = np.column_stack([_converted(columns[axis], np.dtype(np.float32)) for axis in NORMAL])
    return normals if fits_float32(normals).all() else None


def _values(element: Element, items: Items, taken: tuple[str, ...] = ()) -> dict[str, AnyArray]:
    """Return the properties of an element, but those that are taken, as values."""
    return as_values(
        {
            name: _typed(items.columns[name], dtype)
            for name, dtype in element.types.items()
            if name not in taken
        }
    )


def _typed(column: AnyArray, dtype: np.dtype[Any]) -> AnyArray:
    """Return a property as its type, contiguous; numbers of a text that are none of it stay doubles."""
    typed = _converted(column, dtype)
    return typed if dtype.kind == "f" or (typed == column).all() else np.array(column)


def _converted(column: AnyArray, dtype: np.dtype[Any]) -> AnyArray:
    """Return a property as another type, contiguous, without a word on NaN and overflow."""
    with np.errstate(invalid="ignore", over="ignore"):
        return column.astype(dtype)
