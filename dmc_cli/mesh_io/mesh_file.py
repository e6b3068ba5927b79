"""Hold a mesh as files have it, read or to be written: the one type of meshes on the host.

Faces have three or four corners, in rows of four. Whatever a vertex or a face has beside its place is a value
with a name; formats that cannot hold values say so when they are written.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dmc_cli.array_types import (
    AnyArray,
    BoolArray,
    ByteArray,
    Float32Array,
    Float64Array,
    FloatArray,
    Int32Array,
)
from dmc_cli.errors import CallError
from dmc_cli.notices import Notice
from dmc_cli.settings import OutputUnit
from dmc_cli.volume import Color, Space, VolumeGeometry

NO_CORNER = -1
"""The fourth corner of a triangle."""

LABELS = "labels"
"""The name of the face value that holds the label pair, the labels on both sides of a face, (F, 2) int32."""

UNCOLORED = (200, 200, 200)
"""The colour of groups that have none beside groups that have."""

VALUE_TYPES = tuple(np.dtype(name) for name in ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8"))
"""What values may be: the types that PLY has."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshFile:
    """A mesh of quads, triangles or both, in the coordinates of its file.

    Attributes:
        points: Positions, (V, 3) float32 or float64, in `space` and `unit`, of a size that float32 holds;
            files get float32.
        faces: Corners of each face, (F, 4) int32, vertex indices from 0, anticlockwise seen from where the
            normal points; a triangle has `NO_CORNER` as its fourth.
        normals: Unit normals of the vertices, (V, 3) float32, or None.
        space: The axes that the coordinates are in; none where the input told no orientation, and
            for grid coordinates.
        unit: The unit of the coordinates; of a file that tells none, and of grid coordinates, mm.
        vertex_values: Values of the vertices by their names, (V,) or (V, n), n at least 2, of one of
            `VALUE_TYPES`; NaN and infinity are values, too.
        face_values: Values of the faces likewise, one row per face; the label pair is `LABELS`.
        groups: Names of parts, each with its number of faces, in the order of the faces; or none.
        color: The colour of the whole mesh, red, green and blue up to 255, or None.
        colors: The colours of groups by name, of some or all.
        geometry: Of the volume in whose tkrRAS FreeSurfer and GIfTI files are to be, or were; the points
            are in RAS and mm all the same.
        warnings: What is told of the file that it was read from.
        triangle_count: Number of faces with three corners.

    Raises:
        CallError: The arrays are no mesh, or no format could hold them.
    """

    points: Float32Array | Float64Array
    faces: Int32Array
    normals: Float32Array | None = None
    space: Space = "none"
    unit: OutputUnit = "mm"
    vertex_values: Mapping[str, AnyArray] = field(default_factory=dict)
    face_values: Mapping[str, AnyArray] = field(default_factory=dict)
    groups: Mapping[str, int] = field(default_factory=dict)
    color: Color | None = None
    colors: Mapping[str, Color] = field(default_factory=dict)
    geometry: VolumeGeometry | None = None
    warnings: tuple[Notice, ...] = ()
    triangle_count: int = field(init=False)

    def __post_init__(self) -> None:
        """Refuse what no format could hold; readers have refused what a file has of it."""
        _check_rows("points", self.points, 3, np.float32, np.float64)
        _check_rows("faces", self.faces, 4, np.int32)
        _check_finite("points", self.points)
        count = len(self.points)
        object.__setattr__(self, "triangle_count", count_triangles(self.faces, count))
        if self.normals is not None:
            _check_rows("normals", self.normals, 3, np.float32)
            _check_finite("normals", self.normals)
            if len(self.normals) != count:
                raise CallError(
                    f"there are {len(self.normals)} normals for {count} vertices; expected one a vertex;"
                    " leave them out where vertices have gone"
                )
        if self.geometry is not None and (self.space, self.unit) != ("RAS", "mm"):
            raise CallError(
                f"a volume's geometry was given with points in {self.space} and {self.unit}; expected RAS and"
                " mm; turn them, or leave it out"
            )
        _check_values("vertex", self.vertex_values, count)
        _check_values("face", self.face_values, len(self.faces))
        if self.groups and sum(self.groups.values()) != len(self.faces):
            raise CallError(
                f"the groups have {sum(self.groups.values())} faces of {len(self.faces)}; expected each face"
                " in one of them; count them again"
            )

    @property
    def quad_count(self) -> int:
        """Return the number of faces with four corners."""
        return len(self.faces) - self.triangle_count

    @property
    def tags(self) -> dict[str, str]:
        """Return what names the space and the unit in a file's comments: nothing for none and for mm."""
        found: dict[str, str] = {} if self.space == "none" else {"SPACE": self.space}
        return found if self.unit == "mm" else found | {"UNIT": self.unit}


def grouped(meshes: Mapping[str, MeshFile]) -> MeshFile:
    """Return one mesh with a group for each of several in the same space and unit, and the values of all."""
    first = next(iter(meshes.values()))
    counts = [len(mesh.points) for mesh in meshes.values()]
    starts = np.cumsum([0, *counts[:-1]])
    normals = [mesh.normals for mesh in meshes.values() if mesh.normals is not None]
    faces = [
        np.where(mesh.faces == NO_CORNER, NO_CORNER, mesh.faces + np.int32(start))
        for mesh, start in zip(meshes.values(), starts, strict=True)
    ]
    return MeshFile(
        points=np.concatenate([mesh.points for mesh in meshes.values()]),
        faces=np.concatenate(faces),
        normals=np.concatenate(normals) if len(normals) == len(meshes) else None,
        space=first.space,
        unit=first.unit,
        geometry=first.geometry,
        vertex_values=_joined([mesh.vertex_values for mesh in meshes.values()]),
        face_values=_joined([mesh.face_values for mesh in meshes.values()]),
        groups={name: len(mesh.faces) for name, mesh in meshes.items()},
        colors={name: mesh.color for name, mesh in meshes.items() if mesh.color is not None},
    )


def _joined(tables: Sequence[Mapping[str, AnyArray]]) -> dict[str, AnyArray]:
    """Return the values that all tables have, one after the other."""
    return {
        name: np.concatenate([table[name] for table in tables])
        for name in tables[0]
        if all(name in table for table in tables)
    }


def parts_of(mesh: MeshFile, name: str) -> Iterator[tuple[str, MeshFile]]:
    """Yield each group with its own vertices, by its name; without groups the mesh by the name given."""
    if not mesh.groups:
        yield name, mesh
        return
    start = 0
    for group, count in mesh.groups.items():
        faces, rows = mesh.faces[start : start + count], slice(start, start + count)
        is_there = faces != NO_CORNER
        used = np.unique(faces[is_there])
        numbers = np.zeros(len(mesh.points), np.int32)
        numbers[used] = np.arange(len(used), dtype=np.int32)
        part = MeshFile(
            points=mesh.points[used],
            faces=np.where(is_there, numbers[faces], np.int32(NO_CORNER)),
            normals=None if mesh.normals is None else mesh.normals[used],
            space=mesh.space,
            unit=mesh.unit,
            vertex_values={value: array[used] for value, array in mesh.vertex_values.items()},
            face_values={value: array[rows] for value, array in mesh.face_values.items()},
            color=mesh.colors.get(group, mesh.color),
        )
        yield group, part
        start += count


def linear(color: Color) -> list[float]:
    """Return a colour as light, red, green and blue from 0 to 1, which it is not on a screen (sRGB)."""
    shares = [channel / 255 for channel in color]
    return [round(s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4, 6) for s in shares]


def on_screen(light: Sequence[float]) -> Color | None:
    """Return a colour as screens have it, up to 255, of light from 0 to 1; None if it is none."""
    if len(light) < 3 or not all(0 <= share <= 1 for share in light[:3]):
        return None
    shares = [s * 12.92 if s <= 0.0031308 else 1.055 * s ** (1 / 2.4) - 0.055 for s in light[:3]]
    red, green, blue = (round(255 * share) for share in shares)
    return red, green, blue


def vertex_colors(mesh: MeshFile) -> ByteArray | None:
    """Return the colour of each vertex, (V, 3) uint8, that of its first group; None without colours."""
    if mesh.color is None and not mesh.colors:
        return None
    found = np.full((len(mesh.points), 3), UNCOLORED if mesh.color is None else mesh.color, np.uint8)
    end = len(mesh.faces)
    for name, count in reversed([*mesh.groups.items()]):
        faces = mesh.faces[end - count : end]
        if name in mesh.colors:
            found[faces[faces != NO_CORNER]] = mesh.colors[name]
        end -= count
    return found


def _check_rows(name: str, array: AnyArray, columns: int, *dtypes: type[np.generic]) -> None:
    """Raise unless the array is a table of so many columns of one of these types."""
    _check_is_array(name, array)
    if array.ndim != 2 or array.shape[1] != columns or array.dtype not in dtypes:
        expected = " or ".join(str(np.dtype(dtype)) for dtype in dtypes)
        raise CallError(
            f"{name} are {array.dtype} of shape {array.shape}; expected {expected} of shape (n, {columns});"
            f" convert them, and give triangles -1 as their fourth corner"
        )


def _check_is_array(name: str, array: Any) -> None:
    """Raise unless it is a NumPy array."""
    if not isinstance(array, np.ndarray):
        raise CallError(
            f"{name} are of type {type(array).__name__}; expected a NumPy array; make one with numpy.array"
        )


def fits_float32(array: AnyArray) -> BoolArray:
    """Return which numbers are finite once they are rounded to float32."""
    with np.errstate(over="ignore", invalid="ignore"):  # a NaN may signal
        return np.isfinite(array.astype(np.float32, copy=False))


def _check_finite(name: str, array: FloatArray) -> None:
    """Raise on the first row with a number that is none in float32: no mesh format can hold it."""
    fits = fits_float32(array)
    if not fits.all():
        bad = int(np.flatnonzero(~fits.all(axis=1))[0])
        raise CallError(
            f"row {bad} of the {name} is not finite in float32: {array[bad]}; expected finite numbers; remove"
            " or move that vertex"
        )


def count_triangles(faces: Int32Array, count: int) -> int:
    """Return the number of faces with three corners; raise CallError on the first that names no vertex."""
    if not faces.size:
        return 0
    fourth = faces[:, 3]
    if faces[:, :3].min() >= 0 and fourth.min() >= NO_CORNER and faces.max() < count:
        return int(np.count_nonzero(fourth == NO_CORNER))
    is_triangle = fourth == NO_CORNER
    outside = (faces < 0) | (faces >= count)
    outside[is_triangle, 3] = False
    bad = int(np.flatnonzero(outside.any(axis=1))[0])
    raise CallError(
        f"face {bad} names a vertex outside 0 to {count - 1}: {faces[bad].tolist()}; expected vertex"
        " numbers from 0, and -1 only as the fourth corner of a triangle; number the vertices from 0"
    )


def _check_values(kind: str, values: Mapping[str, AnyArray], count: int) -> None:
    """Raise unless values have names that files can hold, a row an item, and a type that PLY has."""
    for name, array in values.items():
        if not name.isascii() or name.split() != [name]:
            raise CallError(f"a {kind} value is called {name!r}; expected one word in ASCII; rename it")
        _check_is_array(f"the {kind} values {name}", array)
        is_table = array.ndim == 1 or (array.ndim == 2 and array.shape[1] > 1)
        if not is_table or len(array) != count or array.dtype not in VALUE_TYPES:
            known = ", ".join(map(str, VALUE_TYPES))
            raise CallError(
                f"the {kind} value {name} is {array.dtype} of shape {array.shape}; expected ({count},) or"
                f" ({count}, n), n at least 2, of {known}; convert it, or leave it out"
            )
