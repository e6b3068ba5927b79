"""Write OFF, the Geomview object file format: text, positions and polygons only.

Plain OFF has no place for normals or values, which `write` says in its result, and its readers disagree on
comments, so the space is not told either.
"""

from collections.abc import Iterator

import numpy as np

from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.text import chunks_of, face_lines, float_lines


def encode_off(mesh: MeshFile, *, ascii: bool = True) -> Iterator[bytes]:
    """Yield the bytes of an OFF file; it is always text."""
    yield f"OFF\n{len(mesh.points)} {len(mesh.faces)} 0\n".encode("ascii")
    for rows in chunks_of(mesh.points, np.float32):
        yield float_lines(rows)
    for faces in chunks_of(mesh.faces):
        yield face_lines(faces)
