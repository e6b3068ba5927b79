"""Write the halfedge structure and its colours: `.npz`, or `.txt` with the same tables to read.

Everything that follows from a halfedge's number is written out, so that a reader needs no convention: row
4f + c of `halfedges` is the halfedge at corner c of face f, with its origin, face, next and twin. Faces have
four rows, triangles as well: the fourth corner of a triangle in `quads` is -1, and so are origin, next and
twin in row 4f + 3, which is no halfedge; the next of row 4f + 2 is 4f then. The text has a line
`name rows columns type` before each table, then a line per row. Where the unit is not mm, a line
`# UNIT=um` stands before all, or there is an entry `unit`. Colours of faces are there where the method of
contouring has any. Entries of the zip archive carry no time, so that
the same mesh gives the same bytes.
"""

import math
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, ByteArray, Float32Array, Int32Array
from dmc_cli.errors import SettingsError
from dmc_cli.files import open_output, write_output
from dmc_cli.kept_property import kept_property
from dmc_cli.mesh_io.halfedge_numbers import next_halfedges, next_in_quads
from dmc_cli.mesh_io.text import CHUNK_ROWS, float_lines
from dmc_cli.settings import STREAM, OutputUnit
from dmc_cli.stop import check_stop

_ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip archive can hold, which stands for none."""


@dataclass(frozen=True)
class Table:
    """One table of a dump: what it is called and holds, and how to get rows `start` to `stop` - 1 of it.

    `shape` is that of the whole; rows are made when they are written, because a dump is larger than the mesh.
    """

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    rows: Callable[[int, int], AnyArray]

    def pieces(self) -> Iterator[AnyArray]:
        """Yield all rows, some at a time, contiguous; none of an empty table."""
        for start in range(0, self.shape[0], CHUNK_ROWS):
            yield np.ascontiguousarray(self.rows(start, min(start + CHUNK_ROWS, self.shape[0])))


@dataclass(frozen=True, kw_only=True)
class HalfedgeDump:
    """What a dump is made from.

    Attributes:
        vertices: Positions, (V, 3) float32.
        normals: Unit normals, (V, 3) float32.
        quads: Vertices of each face, (F, 4) int32; a triangle's fourth is -1.
        twin: Twin of each halfedge, (4F,) int32, -1 on a boundary and where a triangle has no halfedge.
        vertex_halfedge: A halfedge that starts at each vertex, (V,) int32; on a boundary the one without a
            twin.
        vertex_color: The colours of the vertices' cells, 0 to 7, (V,) uint8.
        face_color: Colours 0 to 4, (F,) uint8; None if the method of contouring has no colours.
        face_color24: The grid's colours, (F,) uint8; likewise.
        unit: The unit of the positions.
    """

    vertices: Float32Array
    normals: Float32Array
    quads: Int32Array
    twin: Int32Array
    vertex_halfedge: Int32Array
    vertex_color: ByteArray
    face_color: ByteArray | None = None
    face_color24: ByteArray | None = None
    unit: OutputUnit = "mm"

    def tables(self) -> Iterator[Table]:
        """Yield the tables in their order."""
        yield from (self._stored(name) for name in ("vertices", "normals", "quads"))
        yield Table("halfedges", (len(self.twin), 4), np.dtype(np.int32), self._halfedges)
        yield self._stored("vertex_halfedge")
        yield Table("face_halfedge", (len(self.quads),), np.dtype(np.int32), _face_halfedges)
        if self.face_color is not None:
            yield from (self._stored(name) for name in ("face_color", "face_color24"))
        yield self._stored("vertex_color")

    def _stored(self, name: str) -> Table:
        """Return a table that lies in memory as it is written."""
        array: AnyArray = getattr(self, name)
        return Table(name, array.shape, array.dtype, lambda start, stop: array[start:stop])

    def _halfedges(self, start: int, stop: int) -> Int32Array:
        """Return origin, face, next and twin of halfedges, int32."""
        corners = self.quads.reshape(-1)
        h = np.arange(start, stop, dtype=np.int32)
        following = next_in_quads(h)
        if self._has_triangles:
            following = np.where(corners[h] < 0, -1, next_halfedges(corners, h))
        return np.stack([corners[start:stop], h >> 2, following, self.twin[start:stop]], axis=1)

    @kept_property
    def _has_triangles(self) -> bool:
        """Return whether a face has no fourth corner."""
        return bool((self.quads[:, 3] < 0).any())


def _face_halfedges(start: int, stop: int) -> Int32Array:
    """Return the first halfedge of faces, int32."""
    return np.arange(4 * start, 4 * stop, 4, dtype=np.int32)


def check_dump_name(path: str) -> None:
    """Raise SettingsError unless the suffix of a dump is one that can be written."""
    suffix = PurePath(path).suffix.lower()
    if path != STREAM and suffix not in (".npz", ".txt"):
        found = f"the suffix {suffix}" if suffix else "no suffix"
        raise SettingsError(f"{path} has {found}; expected .npz or .txt for halfedges; rename it")


def write_halfedges(path: str, dump: HalfedgeDump, *, force: bool = False) -> None:
    """Write a dump completely or not at all; standard output gets text.

    Raises:
        SettingsError: The suffix is neither .npz nor .txt.
        WriteError: The file exists, or it cannot be written; an older file is untouched.
    """
    check_dump_name(path)
    if PurePath(path).suffix.lower() == ".npz":
        _write_archive(path, dump, force=force)
    else:
        write_output(path, _text(dump), force=force)


def _write_archive(path: str, dump: HalfedgeDump, *, force: bool) -> None:
    """Write the tables as members of an uncompressed zip archive, as numpy.savez does."""
    with open_output(path, force=force) as stream, zipfile.ZipFile(stream, "w") as archive:
        for table in dump.tables():
            entry = zipfile.ZipInfo(f"{table.name}.npy", _ZIP_EPOCH)
            descr = np.lib.format.dtype_to_descr(table.dtype)
            with archive.open(entry, "w", force_zip64=True) as member:
                np.lib.format.write_array_header_1_0(
                    member, {"descr": descr, "fortran_order": False, "shape": table.shape}
                )
                for piece in table.pieces():
                    check_stop()
                    member.write(piece.data)
        if dump.unit != "mm":
            with archive.open(zipfile.ZipInfo("unit.npy", _ZIP_EPOCH), "w") as member:
                np.lib.format.write_array(member, np.array(dump.unit), (1, 0), allow_pickle=False)


def _text(dump: HalfedgeDump) -> Iterator[bytes]:
    """Yield the tables as lines."""
    if dump.unit != "mm":
        yield f"# UNIT={dump.unit}\n".encode()
    for table in dump.tables():
        rows, columns = table.shape[0], math.prod(table.shape[1:])
        yield f"{table.name} {rows} {columns} {table.dtype.name}\n".encode()
        for piece in table.pieces():
            yield float_lines(piece.reshape(len(piece), columns))
