"""PLY, the Stanford polygon format: binary little endian, or ASCII.

The face list is named `vertex_indices`, the one name that all readers know. The space stands in the
comment that 3D Slicer reads.
"""

from collections.abc import Iterator

import numpy as np

from dmc_cli.mesh_io.mesh_file import Float32Array, MeshFile
from dmc_cli.mesh_io.text import chunks_of, float_lines, quad_lines

_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 4)])


def encode_ply(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a PLY file, with normals where the mesh has them."""
    yield _header(mesh, "ascii" if ascii else "binary_little_endian")
    for rows in _vertex_rows(mesh):
        yield float_lines(rows) if ascii else rows.astype("<f4", copy=False).tobytes()
    for quads in chunks_of(mesh.quads):
        if ascii:
            yield quad_lines(quads, b"4")
        else:
            faces = np.empty(len(quads), _FACE)
            faces["count"] = 4
            faces["corners"] = quads
            yield faces.tobytes()


def _header(mesh: MeshFile, encoding: str) -> bytes:
    """Write the lines that tell what follows."""
    lines = ["ply", f"format {encoding} 1.0", "comment written by dmc"]
    if mesh.space != "none":
        lines.append(f"comment SPACE={mesh.space}")
    lines.append(f"element vertex {len(mesh.vertices)}")
    names = ("x", "y", "z") if mesh.normals is None else ("x", "y", "z", "nx", "ny", "nz")
    lines.extend(f"property float {name}" for name in names)
    lines.append(f"element face {len(mesh.quads)}")
    lines.append("property list uchar int vertex_indices")
    lines.append("end_header\n")
    return "\n".join(lines).encode("ascii")


def _vertex_rows(mesh: MeshFile) -> Iterator[Float32Array]:
    """Yield position and normal side by side, in chunks."""
    if mesh.normals is None:
        yield from chunks_of(mesh.vertices)
        return
    for position, normal in zip(chunks_of(mesh.vertices), chunks_of(mesh.normals), strict=True):
        yield np.hstack((position, normal))
