"""Write and read OFF, the Geomview object file format: counts, points, then faces as `n a b c d`.

It is text, positions and polygons only. Plain OFF has no place for normals or values, which `write` says in
its result, and its readers disagree on comments, so the space is not told either, and the unit only where it
is not the usual one; both are read where a comment has them.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.numbers import parse_lines, whole_numbers
from dmc_cli.mesh_io.parsed import make_mesh, unread
from dmc_cli.mesh_io.text import chunks_of, face_lines, float_lines

HEADER = re.compile(rb"\s*(ST)?(C)?(N)?(4)?(n)?OFF\b")


def encode_off(mesh: MeshFile, *, ascii: bool = True) -> Iterator[bytes]:
    """Yield the bytes of an OFF file; it is always text."""
    unit = f"# UNIT={mesh.unit}\n" if mesh.unit != "mm" else ""
    yield f"OFF\n{unit}{len(mesh.points)} {len(mesh.faces)} 0\n".encode("ascii")
    for rows in chunks_of(mesh.points, np.float32):
        yield float_lines(rows)
    for faces in chunks_of(mesh.faces):
        yield face_lines(faces)


def read_off(path: Path) -> MeshFile:
    """Read the points and faces of a text OFF file; normals and colours are told and not read.

    Raises:
        MeshFileError: The text is not what the format has, or it ends early.
        UnsupportedFormatError: The file is binary or four-dimensional, or a face has more than four corners.
    """
    data = path.read_bytes()
    comments = b"".join(re.findall(rb"#[^\n]*\n", data)) if b"#" in data else b""
    text = re.sub(rb"#[^\n]*", b"", data) if comments else data
    header = HEADER.match(text)
    if header is None:
        raise MeshFileError(f"{path}: the word OFF was expected at the start; this is no OFF file")
    text = text[header.end() :]
    if header[4] or header[5] or re.match(rb"[ \t]*BINARY\b", text):
        raise UnsupportedFormatError(f"{path}: only three-dimensional text OFF is read; write it as text")

    lines = parse_lines(str(path), np.frombuffer(text, dtype=np.uint8).copy())
    if not lines.counts.size or lines.counts[0] not in (2, 3):
        raise MeshFileError(f"{path}: the numbers of vertices and faces were expected after the word OFF")
    vertex_count, face_count = whole_numbers(str(path), lines.values[:2])
    if vertex_count < 0 or face_count < 0:
        raise MeshFileError(
            f"{path}: {vertex_count} vertices and {face_count} faces were announced;"
            " expected no negative number"
        )
    expected = 1 + vertex_count + face_count
    if len(lines.counts) < expected:
        raise MeshFileError(
            f"{path}: {len(lines.counts) - 1} lines were found after the counts; expected {vertex_count}"
            f" vertices and {face_count} faces; the file is cut off"
        )
    starts = lines.starts
    vertices, faces = slice(1, 1 + vertex_count), slice(1 + vertex_count, expected)
    if (lines.counts[vertices] < 3).any():
        raise MeshFileError(f"{path}: a vertex with fewer than 3 coordinates was found; expected x y z")
    points = lines.values[starts[vertices, None] + np.arange(3)]
    counts = whole_numbers(str(path), lines.values[starts[faces]])
    if (counts < 0).any() or (lines.counts[faces] < 1 + counts).any():
        raise MeshFileError(f"{path}: a face with fewer corners than its first number tells was found")
    first = np.repeat(starts[faces] + 1 - (np.cumsum(counts) - counts), counts)
    corners = lines.values[first + np.arange(counts.sum())]
    parts = [
        part for group, part in ((1, "texture coordinates"), (2, "colours"), (3, "normals")) if header[group]
    ]
    if "colours" not in parts and (lines.counts[faces] > 1 + counts).any():
        parts.append("colours")
    return make_mesh(str(path), points, counts, corners, comments, warnings=unread(path, parts))
