"""Write and read the surfaces of FreeSurfer: triangles, big endian, without a suffix of their own.

Their coordinates are tkrRAS of the volume that the end of the file tells (`volume/tkr.py`). A volume whose
centre is at 0, with FreeSurfer's axes, makes them RAS; it is told where the mesh is of no volume.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.parsed import make_mesh, unread
from dmc_cli.mesh_io.patient import UNREADABLE, checked_geometry, in_ras, patient_points, patient_triangles
from dmc_cli.mesh_io.triangles import triangle_count
from dmc_cli.volume import TKR_AXES, VolumeGeometry

MAGIC = b"\xff\xff\xfe"
TAGS = (2, 0, 20)
"""No scanner coordinates (2: 0), then the volume (20)."""

VOLUME = (
    "valid = {valid}  # volume info {word}\nfilename = dmc\nvolume = {shape}\nvoxelsize = {spacing}\n"
    "xras   = {axes[0]}\nyras   = {axes[1]}\nzras   = {axes[2]}\ncras   = {centre}\n"
)
IN_RAS = VolumeGeometry((256, 256, 256), (1.0, 1.0, 1.0), TKR_AXES, np.zeros(3))
"""The volume whose tkrRAS is RAS itself."""


def encode_freesurfer(mesh: MeshFile, *, ascii: bool = False) -> Iterator[bytes]:
    """Yield the bytes of a surface of FreeSurfer, quads split into triangles."""
    yield MAGIC + b"created by dmc\n\n"
    yield np.array([len(mesh.points), triangle_count(mesh)], ">i4").tobytes()
    for points in patient_points(mesh):
        yield points.astype(">f4").tobytes()
    for triangles in patient_triangles(mesh):
        yield triangles.astype(">i4").tobytes()
    yield np.array(TAGS, ">i4").tobytes()
    valid, word = (0, "invalid") if mesh.space == "none" else (1, "valid")
    volume = mesh.geometry or IN_RAS
    yield VOLUME.format(
        valid=valid,
        word=word,
        shape=_text(volume.shape),
        spacing=_text(volume.spacing),
        axes=[*map(_text, volume.axes)],
        centre=_text(volume.centre),
    ).encode("ascii")


def _text(numbers: Iterable[float]) -> str:
    """Return numbers with a space between."""
    return " ".join(f"{number:.15g}" for number in numbers)


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
    corners = np.frombuffer(data, ">i4", 3 * triangles, head + 8 + 12 * vertices).reshape(-1, 3)
    volume, parts = _volume(data[end:])
    if volume is not None:
        points, corners = in_ras(points, corners, volume)
    return make_mesh(
        str(path),
        points,
        np.full(triangles, 3),
        corners.astype(np.int64).ravel(),
        b"SPACE=RAS\n" if volume is not None else b"",
        geometry=None if volume is None or np.array_equal(volume.to_ras, np.eye(4)) else volume,
        warnings=unread(path, parts),
    )


def _volume(end: bytes) -> tuple[VolumeGeometry | None, list[str]]:
    """Return the volume that the end of a file tells, None without one, and what cannot be read of it."""
    lines = [line.partition(b"=") for line in end.split(b"\n")]
    told = {name.rpartition(b"\x14")[2].strip(): text.split() for name, _, text in lines}  # behind tag 20
    if told.get(b"valid", [])[:1] != [b"1"]:
        return None, []
    try:
        vectors = {name: np.array(told[name][:3], float) for name in (b"xras", b"yras", b"zras", b"cras")}
        spacing = np.array(told.get(b"voxelsize", IN_RAS.spacing)[:3], float)
        shape = np.array(told.get(b"volume", IN_RAS.shape)[:3], float)
        axes = np.array([vectors[name] for name in (b"xras", b"yras", b"zras")])
        found = checked_geometry(shape, spacing, axes, vectors[b"cras"])
    except (KeyError, ValueError):
        found = None
    return found, [] if found is not None else [UNREADABLE]
