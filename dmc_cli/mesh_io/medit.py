"""Write and read the text format of Medit (.mesh), which FreeFem, MMG and others read: keywords, then rows.

Each part has a reference of its own number, whose name a comment tells. Space and unit stand in comments.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.meshio_file import PartNumbers, read_with_meshio
from dmc_cli.mesh_io.numbered import Part, numbered_parts
from dmc_cli.mesh_io.text import chunks_of, framed_lines, number_lines

KEYWORDS = {3: "Triangles", 4: "Quadrilaterals"}
"""What faces are called, by their corners."""

REFERENCE = re.compile(rb"^# reference (\d{1,10}): ([^\r\n]+)", re.MULTILINE)
"""A name as we tell it."""


def encode_medit(mesh: MeshFile, *, ascii: bool = True) -> Iterator[bytes]:
    """Yield the bytes of a .mesh file, groups as references; it is always text."""
    tags = "".join(f"# {name}={value}\n" for name, value in mesh.tags.items())
    parts = numbered_parts(mesh)
    names = "".join(f"# reference {part.number}: {part.title}\n" for part in parts)
    yield f"MeshVersionFormatted 1\n# written by dmc\n{tags}{names}Dimension 3\n".encode()
    yield f"Vertices\n{len(mesh.points)}\n".encode("ascii")
    for points in chunks_of(mesh.points, np.float32):
        yield framed_lines(points, (b"", b" ", b" ", b" 0\n"))
    for corners, keyword in KEYWORDS.items():
        count = sum(part.count(corners) for part in parts)
        if count:
            yield f"{keyword}\n{count}\n".encode("ascii")
            for part in parts:
                yield from _faces(part, corners)
    yield b"End\n"


def _faces(part: Part, corners: int) -> Iterator[bytes]:
    """Yield rows of nodes and the part's number."""
    for rows in part.rows(corners):
        numbers = np.full_like(rows, part.number)
        numbers[:, :-1] = rows[:, 1:]
        yield number_lines(numbers)


def read_medit(path: Path) -> MeshFile:
    """Read the triangles and quads of a .mesh file, by meshio; references are groups, 0 none.

    Raises:
        MeshFileError: The file is damaged.
        UnsupportedFormatError: Faces of another kind.
    """
    return read_with_meshio(path, "medit", PartNumbers("medit:ref", "reference", REFERENCE, none=0))
