"""Small meshes to write."""

import numpy as np
import pytest

from dmc_cli.mesh_io.mesh_file import MeshFile


@pytest.fixture
def cube():
    """A closed cube of edge 2 round the origin, in RAS, quads outward, with normals."""
    corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], np.float32)
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return MeshFile(
        points=corners,
        faces=np.array(quads, np.int32),
        normals=(corners / np.sqrt(np.float32(3))).astype(np.float32),
        space="RAS",
    )


@pytest.fixture
def grid():
    """A wavy sheet of 300 x 40 quads: indices of one to five digits, coordinates of every size."""
    i, j = np.meshgrid(np.arange(301), np.arange(41), indexing="ij")
    heights = 1e-7 * i + 1e5 * np.sin(j) * (i % 7)
    vertices = np.stack([i * 0.1, j * -33.3, heights], axis=-1).reshape(-1, 3).astype(np.float32)
    first = (i[:-1, :-1] * 41 + j[:-1, :-1]).ravel()
    quads = np.stack([first, first + 41, first + 42, first + 1], axis=1).astype(np.int32)
    normals = np.tile(np.array([[0.6, -0.0, 0.8]], np.float32), (len(vertices), 1))
    return MeshFile(points=vertices, faces=quads, normals=normals, space="LPS")
