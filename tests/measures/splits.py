"""Faces as the triangles that the measures split them into."""

import numpy as np

from dmc_cli.measures.quality import choose_diagonals
from dmc_cli.runtime.device import Device
from tests.mesh.meshes import on_device


def split_faces(shape):
    """The triangles of each face as rows of vertices: one of a triangle, two of a quad."""
    points, faces = shape
    quads = np.where(faces < 0, faces[:, [2]], faces)
    diagonals = choose_diagonals(on_device((points, quads), Device("cpu"))).numpy()
    for (a, b, c, d), diagonal in zip(faces.tolist(), diagonals.tolist(), strict=True):
        if d < 0:
            yield [(a, b, c)]
        else:
            yield [(a, b, c), (a, c, d)] if diagonal == 0 else [(b, c, d), (b, d, a)]


def split_triangles(shape):
    """All of these triangles, (T, 3)."""
    return np.array([triangle for face in split_faces(shape) for triangle in face], np.int32).reshape(-1, 3)
