import numpy as np
import pytest

from dmc_cli.errors import CallError
from dmc_cli.mesh_io.mesh_file import LABELS, MeshFile

POINTS = np.zeros((4, 3), np.float32)
FACES = np.array([[0, 1, 2, 3]], np.int32)


def with_nan(row, dtype=np.float32):
    array = np.zeros((4, 3), dtype)
    array[row, 1] = np.nan
    return array


def test_a_sound_mesh_is_accepted():
    mesh = MeshFile(points=POINTS, faces=FACES, normals=POINTS)
    assert (mesh.triangle_count, mesh.quad_count) == (0, 1)
    assert (mesh.vertex_values, mesh.face_values) == ({}, {})


def test_triangles_have_no_fourth_corner():
    mesh = MeshFile(points=POINTS, faces=np.array([[0, 1, 2, -1], [0, 1, 2, 3], [3, 2, 1, -1]], np.int32))
    assert (mesh.triangle_count, mesh.quad_count) == (2, 1)


def test_points_may_be_doubles_that_float32_holds():
    MeshFile(points=np.full((4, 3), float(np.finfo(np.float32).max)), faces=FACES)


def test_values_are_a_number_or_a_vector_an_item():
    kinds = ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8")
    vertex_values = {kind: np.zeros(4, kind) for kind in kinds} | {"direction": with_nan(0)}
    face_values = {LABELS: np.zeros((1, 2), np.int32)}
    MeshFile(points=POINTS, faces=FACES, vertex_values=vertex_values, face_values=face_values)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": with_nan(2)}, "row 2 of the points is not finite"),
        ({"points": with_nan(2, np.float64)}, "row 2 of the points is not finite"),
        ({"points": np.full((4, 3), 1e39)}, "row 0 of the points is not finite in float32"),
        ({"points": np.full((4, 3), np.inf, np.float32)}, "row 0 of the points is not finite"),
        ({"normals": with_nan(3)}, "row 3 of the normals is not finite"),
        ({"normals": np.zeros((3, 3), np.float32)}, "3 normals for 4 vertices"),
        ({"normals": np.zeros((4, 3))}, "normals are float64"),
        ({"points": [[0, 0, 0]]}, "points are of type list; expected a NumPy array"),
        ({"faces": FACES.astype(np.int64)}, r"faces are int64 of shape \(1, 4\); expected int32"),
        ({"points": POINTS.astype(np.int32)}, "points are int32 .*expected float32 or float64"),
        ({"faces": np.array([[0, 1, 2]], np.int32)}, r"faces are int32 of shape \(1, 3\)"),
        ({"faces": np.array([[0, 1, 2, 3], [0, 1, 2, 4]], np.int32)}, "face 1 names a vertex outside 0 to 3"),
        ({"faces": np.array([[0, 1, 2, -1], [0, 1, -1, -1]], np.int32)}, "face 1 names"),
        ({"faces": np.array([[0, 1, 2, -1], [0, 4, 1, -1]], np.int32)}, "face 1 names"),
        ({"faces": np.array([[0, -1, 2, 3]], np.int32)}, "face 0 names"),
        ({"faces": np.array([[0, 1, 2, -2]], np.int32)}, "face 0 names"),
        (
            {"vertex_values": {"a": np.zeros(3)}},
            r"value a is float64 of shape \(3,\); expected \(4,\)",
        ),
        ({"vertex_values": {"a": np.zeros((4, 1))}}, "expected .* n at least 2"),
        ({"vertex_values": {"a": np.zeros((4, 2, 2))}}, "the vertex value a is"),
        (
            {"face_values": {"a": np.float64(1)}},
            "face values a are of type float64; expected a NumPy array",
        ),
        ({"face_values": {"a": np.zeros(1, np.int64)}}, "the face value a is int64"),
        ({"face_values": {"a": np.zeros(1, ">f4")}}, "the face value a is >f4"),
        ({"face_values": {"a b": np.zeros(1)}}, "a face value is called 'a b'; expected one word"),
        ({"face_values": {"": np.zeros(1)}}, "a face value is called ''"),
        ({"face_values": {"größe": np.zeros(1)}}, "a face value is called 'größe'"),
    ],
)
def test_what_no_format_can_hold_is_refused(change, message):
    arguments = {"points": POINTS, "faces": FACES} | change
    with pytest.raises(CallError, match=message):
        MeshFile(**arguments)
