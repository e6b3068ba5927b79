"""Write and read OBJ, the Wavefront object format: lines `v x y z`, `vn x y z` and `f a b c d`.

A line `g name` begins a group of faces, `usemtl name` what has its material, which a file beside this one
tells. Colours stand behind the coordinates, too, from 0 to 1, as MeshLab and Blender read them. Indices count
from 1, a negative one back from the last vertex so far; a normal that is written has the index of its vertex.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from dmc_cli.array_types import BoolArray, ByteArray, IntArray
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.mesh_file import UNCOLORED, MeshFile, vertex_colors
from dmc_cli.mesh_io.numbered import numbered_parts
from dmc_cli.mesh_io.numbers import NEWLINE, SPACE, TAB, NumberLines, parse_lines, whole_numbers
from dmc_cli.mesh_io.obj_parts import grouping_of
from dmc_cli.mesh_io.parsed import make_mesh, unread
from dmc_cli.mesh_io.text import chunks_of, face_lines, float_lines, spans

CHUNK = 1 << 24
"""Characters of face lines that are cleaned at a time: the work takes sixteen times as much memory."""


OTHER_PARTS = {b"vn": "normals", b"vt": "texture coordinates", b"l": "lines", b"p": "points"}
"""What else a line may hold, by its first word."""


def encode_obj(mesh: MeshFile, *, ascii: bool = True, companion: str | None = None) -> Iterator[bytes]:
    """Yield the bytes of an OBJ file, with normals where the mesh has them; it is always text.

    Args:
        mesh: The mesh.
        ascii: Taken from whoever writes any format.
        companion: The name of the file of its materials, or None where there is none.
    """
    yield b"# written by dmc\n"
    if mesh.space != "none":
        yield f"# SPACE={mesh.space}\n".encode("ascii")
    if mesh.unit != "mm":
        yield f"# UNIT={mesh.unit}\n".encode("ascii")
    if companion is not None:
        yield f"mtllib {companion}\n".encode()
    colors = vertex_colors(mesh)
    for start, stop in spans(len(mesh.points)):
        rows = np.ascontiguousarray(mesh.points[start:stop], np.float32)
        if colors is not None:
            rows = np.hstack((rows, colors[start:stop] / np.float32(255)))
        yield float_lines(rows, b"v ")
    if mesh.normals is not None:
        for rows in chunks_of(mesh.normals):
            yield float_lines(rows, b"vn ")
    for part in numbered_parts(mesh):
        if mesh.groups:
            yield f"g {part.title}\n".encode()
        if companion is not None:
            yield f"usemtl {part.name}\n".encode("ascii")
        for faces in chunks_of(part.faces):
            yield face_lines(faces, b"f", first=1, repeat=1 if mesh.normals is None else 2)


def encode_materials(mesh: MeshFile) -> Iterator[bytes]:
    """Yield the bytes of an MTL file, a material a group; none for a mesh without colours.

    Colours are those of screens, from 0 to 1: no standard says so, but most programs show them as they are.
    """
    if mesh.color is None and not mesh.colors:
        return
    yield b"# written by dmc\n"
    for part, name in zip(numbered_parts(mesh), mesh.groups or [""], strict=True):
        color = mesh.colors.get(name, mesh.color or UNCOLORED)
        shares = " ".join(f"{channel / 255:.6g}" for channel in color)
        yield f"newmtl {part.name}\nKd {shares}\nKs 0 0 0\nd 1\nillum 1\n".encode("ascii")


def read_obj(path: Path) -> MeshFile:
    """Read the points and faces of an OBJ file; normals, textures and lines are told.

    Raises:
        MeshFileError: The text is not what the format has.
        UnsupportedFormatError: A face has more than four corners.
    """
    data = path.read_bytes()
    if b"\\" in data:
        data = re.sub(rb"\\\r?\n", b" ", data)
    text, starts = _split_lines(data)
    if np.isin(text[starts], (SPACE, TAB)).any():
        text, starts = _split_lines(re.sub(rb"(?m)^[ \t]+", b"", data))
    ends = np.append(starts[1:], len(text))
    is_vertex = _starts_with(text, starts, b"v")
    is_face = _starts_with(text, starts, b"f")

    vertices = parse_lines(str(path), _lines(text, starts, ends, is_vertex))
    if (vertices.counts < 3).any() or len(vertices.counts) != is_vertex.sum():
        raise MeshFileError(f"{path}: a vertex with fewer than 3 coordinates was found; expected x y z")
    points = vertices.values[vertices.starts[:, None] + np.arange(3)]

    faces = parse_lines(str(path), _without_references(_lines(text, starts, ends, is_face)))
    if len(faces.counts) != is_face.sum():
        raise MeshFileError(f"{path}: a face without corners was found; expected 3 or 4; it is damaged")
    corners = whole_numbers(str(path), faces.values) - 1
    if (corners < 0).any():
        seen = np.repeat(np.cumsum(is_vertex)[is_face], faces.counts)
        corners = np.where(corners < -1, corners + 1 + seen, corners)
    told = [part for word, part in OTHER_PARTS.items() if _is_there(text, starts, word)]
    grouping = grouping_of(path, text, starts, is_face, told)
    mesh = make_mesh(str(path), points, faces.counts, corners, data[:1024], grouping)
    told += ["colours"] * (not _are_known(mesh, vertices))
    return replace(mesh, warnings=unread(path, told))


def _are_known(mesh: MeshFile, vertices: NumberLines) -> bool:
    """Return whether there are no colours behind the coordinates but those that the materials tell."""
    if not (vertices.counts >= 6).any():
        return True
    known = vertex_colors(mesh)
    if known is None or (vertices.counts != 6).any():
        return False
    return bool(np.array_equal(np.round(255 * vertices.values.reshape(-1, 6)[:, 3:]), known))


def _split_lines(data: bytes) -> tuple[ByteArray, IntArray]:
    """Return the characters, uint8, and where each line starts; the last character is a newline."""
    text = np.frombuffer(data + b"\n", dtype=np.uint8)
    return text, np.concatenate([[0], np.flatnonzero(text[:-1] == NEWLINE) + 1])


def _starts_with(text: ByteArray, starts: IntArray, letter: bytes) -> BoolArray:
    """Return which lines start with the word `letter`."""
    second = np.minimum(starts + 1, len(text) - 1)
    found: BoolArray = (text[starts] == letter[0]) & (text[second] <= SPACE)
    return found


def _is_there(text: ByteArray, starts: IntArray, word: bytes) -> bool:
    """Return whether a line starts with a word of one letter or two."""
    second = text[np.minimum(starts + 1, len(text) - 1)]
    third = text[np.minimum(starts + 2, len(text) - 1)]
    is_word = second <= SPACE if len(word) == 1 else (second == word[1]) & (third <= SPACE)
    return bool(((text[starts] == word[0]) & is_word).any())


def _lines(text: ByteArray, starts: IntArray, ends: IntArray, wanted: BoolArray) -> ByteArray:
    """Return the wanted lines without their first word, which is one letter."""
    kept = text.copy()
    kept[starts[wanted]] = SPACE
    chosen: ByteArray = kept[np.repeat(wanted, ends - starts)]
    return chosen


def _without_references(text: ByteArray) -> ByteArray:
    """Return face lines with `/texture/normal` behind each vertex blanked out."""
    slash = ord("/")
    if not (text == slash).any():
        return text
    text = text.copy()
    start = 0
    while start < len(text):
        end = min(start + CHUNK, len(text))
        while end < len(text) and text[end - 1] > SPACE:
            end += 1
        part = text[start:end]
        index = np.arange(1, len(part) + 1, dtype=np.int32)
        last_slash = np.maximum.accumulate(np.where(part == slash, index, 0))
        last_space = np.maximum.accumulate(np.where(part <= SPACE, index, 0))
        part[last_slash > last_space] = SPACE
        start = end
    return text
