"""Take some faces of a mesh file, with the vertices that they have, or turn all round."""

from dataclasses import replace

import numpy as np

from dmc_cli.array_types import BoolArray
from dmc_cli.mesh_io.mesh_file import NO_CORNER, MeshFile


def keep_faces(mesh: MeshFile, is_kept: BoolArray) -> MeshFile:
    """Return the mesh of some faces and their vertices, both in the order that they had; values go along.

    Args:
        mesh: The mesh.
        is_kept: Which faces stay, (F,).
    """
    faces = mesh.faces[is_kept]
    is_used = np.zeros(len(mesh.points) + 1, bool)  # the last one stands for the corner that triangles lack
    is_used[faces.ravel()] = True
    is_used = is_used[:-1]
    number = np.append(np.cumsum(is_used, dtype=np.int32) - 1, np.int32(NO_CORNER)).astype(np.int32)
    ends = np.cumsum([0, *mesh.groups.values()])
    counts = {
        name: int(np.count_nonzero(is_kept[start:end]))
        for name, start, end in zip(mesh.groups, ends[:-1], ends[1:], strict=True)
    }
    return replace(
        mesh,
        points=mesh.points[is_used],
        faces=number[faces],
        normals=None if mesh.normals is None else mesh.normals[is_used],
        vertex_values={name: values[is_used] for name, values in mesh.vertex_values.items()},
        face_values={name: values[is_kept] for name, values in mesh.face_values.items()},
        groups={name: count for name, count in counts.items() if count},
        colors={name: color for name, color in mesh.colors.items() if counts.get(name)},
    )


def flip_faces(mesh: MeshFile) -> MeshFile:
    """Return the mesh with all faces turned round, each from its first corner on, and normals likewise."""
    faces = mesh.faces[:, [0, 3, 2, 1]]
    is_triangle = mesh.faces[:, 3] == NO_CORNER
    faces[is_triangle] = mesh.faces[is_triangle][:, [0, 2, 1, 3]]
    return replace(mesh, faces=faces, normals=None if mesh.normals is None else -mesh.normals)
