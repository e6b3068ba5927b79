"""Write OBJ, the Wavefront object format: text, indices from 1, a normal of the same index as its vertex."""

from collections.abc import Iterator

import numpy as np

from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.text import chunks_of, face_lines, float_lines


def encode_obj(mesh: MeshFile, *, ascii: bool = True) -> Iterator[bytes]:
    """Yield the bytes of an OBJ file, with normals where the mesh has them; it is always text."""
    yield b"# written by dmc\n"
    if mesh.space != "none":
        yield f"# SPACE={mesh.space}\n".encode("ascii")
    for rows in chunks_of(mesh.points, np.float32):
        yield float_lines(rows, b"v ")
    if mesh.normals is not None:
        for rows in chunks_of(mesh.normals):
            yield float_lines(rows, b"vn ")
    for faces in chunks_of(mesh.faces):
        yield face_lines(faces, b"f", first=1, repeat=1 if mesh.normals is None else 2)
