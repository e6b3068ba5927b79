"""Write and read the surfaces of FreeSurfer: triangles, big endian, without a suffix of their own.

Their coordinates are tkrRAS: RAS less the centre of the volume that the end of the file tells. A volume whose
centre is at 0, with FreeSurfer's axes, makes both the same.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.parsed import make_mesh
from dmc_cli.mesh_io.patient import in_ras
from dmc_cli.mesh_io.triangles import triangle_chunks, triangle_count

MAGIC = b"\xff\xff\xfe"
TAGS = (2, 0, 20)
"""No scanner coordinates (2: 0), then the volume (20)."""

AXES = np.array([[-1, 0, 0], [0, 0, -1], [0, 1, 0]], float)
"""Where the axes of FreeSurfer's volumes point to, in RAS."""

VOLUME = (
    "valid = {valid}  # volume info {word}\nfilename = dmc\nvolume = 256 256 256\nvoxelsize = 1 1 1\n"
    "xras   = -1 0 0\nyras   = 0 0 -1\nzras   = 0 1 0\ncras   = 0 0 0\n"
)


def encode_freesurfer(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a surface of FreeSurfer, quads split into triangles."""
    yield MAGIC + b"created by dmc\n\n"
    yield np.array([len(mesh.points), triangle_count(mesh)], ">i4").tobytes()
    for points in in_ras(mesh):
        yield points.astype(">f4").tobytes()
    for triangles in triangle_chunks(mesh):
        yield triangles.astype(">i4").tobytes()
    yield np.array(TAGS, ">i4").tobytes()
    valid, word = (0, "invalid") if mesh.space == "none" else (1, "valid")
    yield VOLUME.format(valid=valid, word=word).encode("ascii")


def read_freesurfer(path: Path) -> MeshFile:
    """Read the triangles of a surface of FreeSurfer in RAS, or in tkrRAS where no volume is told.

    Raises:
        MeshFileError: The file is damaged, or no such surface of triangles.
    """
    data = path.read_bytes()
    head = data.find(b"\n", data.find(b"\n", 3) + 1) + 1
    if data[:3] != MAGIC or not head or len(data) < head + 8:
        raise MeshFileError(f"{path}: a surface of triangles of FreeSurfer was expected; it begins otherwise")
    vertices, triangles = np.frombuffer(data, ">i4", 2, head).tolist()
    end = head + 8 + 12 * (vertices + triangles)
    if min(vertices, triangles) < 0 or end > len(data):
        raise MeshFileError(
            f"{path}: {vertices} vertices and {triangles} triangles are announced; expected as many as"
            f" {len(data)} bytes hold; it is cut off"
        )
    points = np.frombuffer(data, ">f4", 3 * vertices, head + 8).reshape(-1, 3).astype(float)
    corners = np.frombuffer(data, ">i4", 3 * triangles, head + 8 + 12 * vertices).astype(np.int64)
    volume = _volume(data[end:])
    if volume is not None:
        axes, centre = volume
        points = points @ np.linalg.solve(AXES, axes) + centre
    space = b"SPACE=RAS\n" if volume is not None else b""
    return make_mesh(str(path), points, np.full(triangles, 3), corners, space)


def _volume(end: bytes) -> tuple[AnyArray, AnyArray] | None:
    """Return axes, (3, 3), and centre of the volume that the end of a file tells; None without one."""
    lines = [line.partition(b"=") for line in end.split(b"\n")]
    told = {name.rpartition(b"\x14")[2].strip(): text.split() for name, _, text in lines}  # behind tag 20
    try:
        vectors = {name: np.array(told[name][:3], float) for name in (b"xras", b"yras", b"zras", b"cras")}
        if told[b"valid"][:1] != [b"1"]:
            return None
    except (KeyError, ValueError):
        return None
    axes = np.array([vectors[name] for name in (b"xras", b"yras", b"zras")])
    if axes.shape != (3, 3) or vectors[b"cras"].shape != (3,) or abs(np.linalg.det(axes)) < 0.5:
        return None
    return axes, vectors[b"cras"]
