"""The halfedge structure and its colours as a file: `.npz`, or `.txt` with the same tables to read.

Everything that follows from a halfedge's number is written out, so that a reader needs no convention: row
4q + c of `halfedges` is the halfedge at corner c of quad q. The text has a line `name rows columns type`
before each table, then a line a row. Entries of the zip archive carry no time, so that the same mesh gives
the same bytes.
"""

import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import PurePath
from typing import Any

import numpy as np

from dmc_cli.errors import SettingsError
from dmc_cli.settings import STREAM
from dmc_cli.writers.atomic import open_output, write_output
from dmc_cli.writers.text import chunks_of, float_lines

Array = np.ndarray[Any, np.dtype[Any]]

_ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip archive can hold, which stands for none."""


@dataclass(frozen=True, kw_only=True)
class HalfedgeDump:
    """The tables of a dump, in their order.

    Attributes:
        vertices: Positions, (V, 3) float32.
        normals: Unit normals, (V, 3) float32.
        quads: Vertices of each quad, (Q, 4) int32.
        halfedges: Origin vertex, face, next, twin (-1 on a boundary) of each halfedge, (4Q, 4) int32.
        vertex_halfedge: A halfedge that starts at each vertex, (V,) int32; on a boundary the one without a
        twin. face_halfedge: The first halfedge of each quad, (Q,) int32. face_color: Colours 0 to 4, (Q,)
        uint8. face_color24: The grid's colours, (Q,) uint8. vertex_color: The colours of the vertices'
        cells, 0 to 7, (V,) uint8.
    """

    vertices: Array
    normals: Array
    quads: Array
    halfedges: Array
    vertex_halfedge: Array
    face_halfedge: Array
    face_color: Array
    face_color24: Array
    vertex_color: Array

    def tables(self) -> Iterator[tuple[str, Array]]:
        """Yield the tables with their names."""
        for field in fields(self):
            yield field.name, getattr(self, field.name)


def halfedge_rows(quads: Array, twin: Array) -> Array:
    """Return origin, face, next and twin of each halfedge, (4Q, 4) int32."""
    h = np.arange(4 * len(quads), dtype=np.int32)
    return np.stack([quads.ravel(), h >> 2, (h & ~3) | ((h + 1) & 3), twin], axis=1).astype(np.int32)


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
        for name, table in dump.tables():
            entry = zipfile.ZipInfo(f"{name}.npy", _ZIP_EPOCH)
            with archive.open(entry, "w", force_zip64=True) as member:
                np.lib.format.write_array(member, table, allow_pickle=False)


def _text(dump: HalfedgeDump) -> Iterator[bytes]:
    """Yield the tables as lines."""
    for name, table in dump.tables():
        rows = table.reshape(len(table), -1)
        columns = rows.shape[1] if table.ndim > 1 else 1
        yield f"{name} {len(rows)} {columns} {table.dtype.name}\n".encode()
        for chunk in chunks_of(rows):
            yield float_lines(chunk)
