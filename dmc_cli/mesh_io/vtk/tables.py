"""Tell what a mesh has as tables with names, as all formats of VTK have them, a chunk of rows at a time."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.mesh_io.mesh_file import NO_CORNER, MeshFile, vertex_colors
from dmc_cli.mesh_io.text import chunks_of

NORMALS = "Normals"
"""What VTK calls the normals of the vertices."""

COLORS = "RGB"
"""What ParaView calls colours of three bytes."""

TRIANGLE, QUAD = 5, 9
"""VTK's numbers of kinds of cells."""


@dataclass(frozen=True)
class Table:
    """Rows of numbers.

    Attributes:
        name: What the file calls it.
        dtype: The type of its numbers.
        rows: How many there are.
        columns: Numbers in a row.
        chunks: Yields the rows.
    """

    name: str
    dtype: np.dtype[Any]
    rows: int
    columns: int
    chunks: Callable[[], Iterator[AnyArray]]

    @property
    def size(self) -> int:
        """Return the bytes of all rows."""
        return self.rows * self.columns * self.dtype.itemsize


def points_of(mesh: MeshFile) -> Table:
    """Return the positions."""
    float32 = np.dtype(np.float32)
    return Table("Points", float32, len(mesh.points), 3, partial(chunks_of, mesh.points, np.float32))


def normals_of(mesh: MeshFile) -> list[Table]:
    """Return the normals, if there are any."""
    return [] if mesh.normals is None else [_table(NORMALS, mesh.normals)]


def colors_of(mesh: MeshFile) -> list[Table]:
    """Return the colours of the vertices, if there are any."""
    colors = vertex_colors(mesh)
    return [] if colors is None else [_table(COLORS, colors)]


def values_of(values: Mapping[str, AnyArray]) -> list[Table]:
    """Return values of vertices or faces."""
    return [_table(name, array) for name, array in values.items()]


def corner_count(mesh: MeshFile) -> int:
    """Return the corners of all faces together."""
    return 3 * mesh.triangle_count + 4 * mesh.quad_count


def corners_of(mesh: MeshFile) -> Table:
    """Return the corners of all faces in a row."""
    return Table("connectivity", np.dtype(np.int32), corner_count(mesh), 1, partial(_corners, mesh))


def ends_of(mesh: MeshFile) -> Table:
    """Return where the corners of each face end in that row."""
    return Table("offsets", np.dtype(np.int64), len(mesh.faces), 1, partial(_ends, mesh))


def kinds_of(mesh: MeshFile) -> Table:
    """Return VTK's number of each face's kind."""
    return Table("types", np.dtype(np.uint8), len(mesh.faces), 1, partial(_kinds, mesh))


def _table(name: str, array: AnyArray) -> Table:
    columns = 1 if array.ndim == 1 else array.shape[1]
    return Table(name, array.dtype, len(array), columns, partial(chunks_of, array))


def _corners(mesh: MeshFile) -> Iterator[AnyArray]:
    for faces in chunks_of(mesh.faces):
        yield faces[faces != NO_CORNER]


def _ends(mesh: MeshFile) -> Iterator[AnyArray]:
    end = 0
    for faces in chunks_of(mesh.faces):
        ends = end + np.cumsum(np.where(faces[:, 3] == NO_CORNER, 3, 4), dtype=np.int64)
        yield ends
        end = int(ends[-1])


def _kinds(mesh: MeshFile) -> Iterator[AnyArray]:
    for faces in chunks_of(mesh.faces):
        yield np.where(faces[:, 3] == NO_CORNER, TRIANGLE, QUAD).astype(np.uint8)
