"""Write input files of Abaqus.

Each part is a set of elements, and a surface of their positive sides. Space and unit stand in comments.
"""

from collections.abc import Iterator

import numpy as np

from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.numbered import check_numbers, numbered_parts
from dmc_cli.mesh_io.text import chunks_of, framed_lines, join_lines, spans
from dmc_cli.settings import Element

TRIANGLES: dict[Element, str] = {"S4R": "S3R", "S4": "S3", "M3D4": "M3D3", "SFM3D4": "SFM3D3", "R3D4": "R3D3"}
"""The element of three corners that goes with one of four: shells, membranes, surfaces, rigid ones."""

MOST = 999_999_999
"""The largest number of a node or an element."""


def encode_abaqus(mesh: MeshFile, *, ascii: bool = True, element: Element = "S4R") -> Iterator[bytes]:
    """Yield the bytes of an input file, groups as sets and surfaces; it is always text.

    Raises:
        WriteError: There are more nodes or elements than Abaqus has numbers for.
    """
    check_numbers(mesh, "Abaqus", MOST)
    tags = "".join(f"** {name}={value}\n" for name, value in mesh.tags.items())
    yield f"*HEADING\nwritten by dmc\n{tags}*NODE\n".encode("ascii")
    for (start, stop), points in zip(
        spans(len(mesh.points)), chunks_of(mesh.points, np.float32), strict=True
    ):
        numbers = framed_lines(np.arange(start + 1, stop + 1)[:, None], (b"", b",\n"))
        yield join_lines([numbers, framed_lines(points, (b"", b", ", b", ", b"\n"))])
    parts = [part for part in numbered_parts(mesh) if len(part.faces)]
    for part in parts:
        for corners, kind in ((4, element), (3, TRIANGLES[element])):
            if part.count(corners):
                yield f"*ELEMENT, TYPE={kind}, ELSET={part.name}\n".encode("ascii")
            for rows in part.rows(corners):
                yield framed_lines(rows, (b"", *[b", "] * corners, b"\n"))
    for part in parts:
        yield f"*SURFACE, TYPE=ELEMENT, NAME=SURFACE_{part.name}\n{part.name}, SPOS\n".encode("ascii")
