"""Write PLY, the Stanford polygon format: binary little endian, or ASCII.

The face list is named `vertex_indices`, the one name that all readers know; values of vertices and faces are
further properties. The space stands in the comment that 3D Slicer reads.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from dmc_cli.array_types import AnyArray, Float32Array, Int32Array
from dmc_cli.errors import CallError
from dmc_cli.mesh_io.mesh_file import MeshFile, vertex_colors
from dmc_cli.mesh_io.ply.properties import CORNERS, NORMAL, POINT, property_names, type_name
from dmc_cli.mesh_io.text import chunks_of, face_lines, float_lines, join_lines, number_lines

COLOR = frozenset(("red", "green", "blue"))


def encode_ply(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a PLY file, with normals and values where the mesh has them.

    Raises:
        CallError: Two properties of an element would have one name.
    """
    mesh = _painted(mesh)
    yield _header(mesh, "ascii" if ascii else "binary_little_endian")
    for places, *values in zip(_places(mesh), *map(chunks_of, mesh.vertex_values.values()), strict=True):
        if ascii:
            yield join_lines([float_lines(places), *map(number_lines, values)])
        else:
            yield _vertex_rows(places, values)
    for faces, *values in zip(*map(chunks_of, (mesh.faces, *mesh.face_values.values())), strict=True):
        if ascii:
            yield join_lines([face_lines(faces), *map(number_lines, values)])
        else:
            yield _face_rows(faces, values, mesh.triangle_count > 0)


def _painted(mesh: MeshFile) -> MeshFile:
    """Return the mesh with its colours as values of vertices, if it has any and no values of such names."""
    colors = vertex_colors(mesh)
    if colors is None or not COLOR.isdisjoint(mesh.vertex_values):
        return mesh
    channels = {name: np.ascontiguousarray(colors[:, n]) for n, name in enumerate(("red", "green", "blue"))}
    return replace(mesh, vertex_values=channels | dict(mesh.vertex_values))


def _header(mesh: MeshFile, encoding: str) -> bytes:
    """Write the lines that tell what follows."""
    lines = ["ply", f"format {encoding} 1.0", "comment written by dmc"]
    if mesh.space != "none":
        lines.append(f"comment SPACE={mesh.space}")
    if mesh.unit != "mm":
        lines.append(f"comment UNIT={mesh.unit}")
    lines.append(f"element vertex {len(mesh.points)}")
    names = POINT if mesh.normals is None else POINT + NORMAL
    lines += _properties([("float", name) for name in names], mesh.vertex_values)
    lines.append(f"element face {len(mesh.faces)}")
    lines += _properties([("list uchar int", CORNERS)], mesh.face_values)
    lines.append("end_header\n")
    return "\n".join(lines).encode("ascii")


def _properties(properties: list[tuple[str, str]], values: Mapping[str, AnyArray]) -> list[str]:
    """Return the lines of an element's properties: types and names that are given, then those of values."""
    properties = properties + [
        (type_name(array), name) for value, array in values.items() for name in property_names(value, array)
    ]
    name, count = Counter(name for _, name in properties).most_common(1)[0]
    if count > 1:
        raise CallError(
            f"the values {', '.join(values)} would make {count} properties called {name}; expected a name of"
            " its own for each, other than those of positions, normals and corners; rename or remove one"
        )
    return [f"property {kind} {name}" for kind, name in properties]


def _places(mesh: MeshFile) -> Iterator[Float32Array]:
    """Yield position and normal side by side, in chunks, float32."""
    points = chunks_of(mesh.points, np.float32)
    if mesh.normals is None:
        return points
    return map(np.hstack, zip(points, chunks_of(mesh.normals), strict=True))


def _fields(columns: list[AnyArray]) -> list[tuple[str, str, tuple[int, ...]]]:
    """Return the layout of columns, little endian, packed."""
    return [(str(i), c.dtype.newbyteorder("<").str, c.shape[1:]) for i, c in enumerate(columns)]


def _vertex_rows(places: Float32Array, values: list[AnyArray]) -> bytes:
    """Return what belongs to each vertex side by side."""
    if not values:
        return places.astype("<f4", copy=False).tobytes()
    columns = [places, *values]
    rows = np.empty(len(places), _fields(columns))
    for i, column in enumerate(columns):
        rows[str(i)] = column
    return rows.tobytes()


def _face_rows(faces: Int32Array, values: list[AnyArray], has_triangles: bool) -> bytes:
    """Return how many corners each face has, the corners, without the fourth of triangles, and the values."""
    rows = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 4), *_fields(values)])
    rows["count"] = 4
    rows["corners"] = faces
    for i, value in enumerate(values):
        rows[str(i)] = value
    if not has_triangles:
        return rows.tobytes()
    is_triangle = faces[:, 3] < 0
    rows["count"][is_triangle] = 3
    kept = np.ones((len(rows), rows.itemsize), bool)
    kept[is_triangle, 13:17] = False  # a byte, then four corners of four
    return rows.view(np.uint8).reshape(kept.shape)[kept].tobytes()
