"""Give coordinates in the one space that a format has, in millimetres: RAS, or the tkrRAS of a volume."""

from collections.abc import Iterator

import numpy as np

from dmc_cli.array_types import AnyArray, Float32Array, Int32Array
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.text import chunks_of
from dmc_cli.mesh_io.triangles import triangle_chunks
from dmc_cli.volume import FARTHEST_MM, VolumeGeometry

LPS_TO_RAS = np.array([-1, -1, 1], np.float32)

MOST_NODES, LONGEST_AXIS, SMALLEST_DETERMINANT = 2**31, 1.01, 0.5
"""Nodes along an axis, a number of a direction, and what three directions of length 1 span, at worst."""

UNREADABLE = "the volume that its coordinates are relative to (its numbers are none of a volume)"
"""What is told where a file names a volume that cannot be: the coordinates stay in tkrRAS."""


def patient_points(mesh: MeshFile) -> Iterator[Float32Array]:
    """Yield the positions in chunks: in tkrRAS of a volume, in RAS, or without a space as they are."""
    if mesh.geometry is None:
        for points in chunks_of(mesh.points, np.float32):
            # from LPS it is half a turn round z: no face is mirrored
            yield points * LPS_TO_RAS if mesh.space == "LPS" else points
        return
    from_ras = np.linalg.inv(mesh.geometry.to_ras)
    for points in chunks_of(mesh.points, np.float64):
        yield (points @ from_ras[:3, :3].T + from_ras[:3, 3]).astype(np.float32)


def patient_triangles(mesh: MeshFile) -> Iterator[Int32Array]:
    """Yield the triangles so that they look outward there: turned round where that space is mirrored."""
    is_mirrored = mesh.geometry is not None and mesh.geometry.is_mirrored
    for triangles in triangle_chunks(mesh):
        yield triangles[:, [0, 2, 1]] if is_mirrored else triangles


def in_ras(points: AnyArray, triangles: AnyArray, geometry: VolumeGeometry) -> tuple[AnyArray, AnyArray]:
    """Return positions, (V, 3), and triangles, (T, 3), of tkrRAS in RAS, looking outward there."""
    to_ras = geometry.to_ras
    moved = points.astype(np.float64) @ to_ras[:3, :3].T + to_ras[:3, 3]
    return moved, triangles[:, [0, 2, 1]] if geometry.is_mirrored else triangles


def checked_geometry(
    shape: AnyArray, spacing: AnyArray, axes: AnyArray, centre: AnyArray
) -> VolumeGeometry | None:
    """Return the volume that a file tells, or None if its numbers are none of a volume."""
    limits = ((shape, MOST_NODES), (spacing, FARTHEST_MM), (axes, LONGEST_AXIS), (centre, FARTHEST_MM))
    if any(not (np.abs(found) <= limit).all() for found, limit in limits):  # none of which NaN is
        return None
    if any(found.shape != (3,) for found in (shape, spacing, centre)) or axes.shape != (3, 3):
        return None
    if abs(np.linalg.det(axes)) < SMALLEST_DETERMINANT:
        return None
    nodes = (int(n) for n in np.round(shape))
    return VolumeGeometry((*nodes,), (*spacing.tolist(),), axes, centre)  # type: ignore[arg-type]
