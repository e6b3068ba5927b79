import numpy as np
import pytest

from dmc_cli.errors import MeshInvariantError
from dmc_cli.mesh_io.mesh_file import MeshFile

VERTICES = np.zeros((4, 3), np.float32)
QUADS = np.array([[0, 1, 2, 3]], np.int32)


def with_nan(row):
    array = np.zeros((4, 3), np.float32)
    array[row, 1] = np.nan
    return array


def test_a_sound_mesh_is_accepted():
    MeshFile(vertices=VERTICES, quads=QUADS, normals=VERTICES)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vertices": with_nan(2)}, "row 2 of the vertices is not finite"),
        ({"vertices": np.full((4, 3), np.inf, np.float32)}, "row 0 of the vertices is not finite"),
        ({"normals": with_nan(3)}, "row 3 of the normals is not finite"),
        ({"normals": np.zeros((3, 3), np.float32)}, "3 normals for 4 vertices"),
        ({"vertices": VERTICES.astype(np.float64)}, "vertices are float64"),
        ({"quads": np.array([[0, 1, 2]], np.int32)}, r"quads are int32 of shape \(1, 3\)"),
        ({"quads": np.array([[0, 1, 2, 3], [0, 1, 2, 4]], np.int32)}, "quad 1 names a vertex outside 0 to 3"),
        ({"quads": np.array([[0, 1, 2, -1]], np.int32)}, "quad 0 names"),
    ],
)
def test_what_no_format_can_hold_is_refused(change, message):
    arguments = {"vertices": VERTICES, "quads": QUADS} | change
    with pytest.raises(MeshInvariantError, match=message):
        MeshFile(**arguments)
