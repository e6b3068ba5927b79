"""OFF, the Geomview object file format: text, positions and polygons only.

Plain OFF has no place for normals, and its readers disagree on comments, so the space is not told
either; `write` says so in its result.
"""

from collections.abc import Iterator

from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.text import chunks_of, float_lines, quad_lines


def encode_off(mesh: MeshFile, *, ascii: bool = True) -> Iterator[bytes]:
    """Yield the bytes of an OFF file; it is always text."""
    yield f"OFF\n{len(mesh.vertices)} {len(mesh.quads)} 0\n".encode("ascii")
    for rows in chunks_of(mesh.vertices):
        yield float_lines(rows)
    for quads in chunks_of(mesh.quads):
        yield quad_lines(quads, b"4")
