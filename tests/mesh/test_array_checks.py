"""Arrays of a program that are no mesh are refused before a kernel reads them, with what to do."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from dmc_cli.errors import CallError
from dmc_cli.measures import measure_quality, measure_topology
from dmc_cli.mesh.connectivity import connect
from dmc_cli.mesh.halfedges import Halfedges
from dmc_cli.mesh.mesh import Mesh
from dmc_cli.mesh.mesh_files import file_of_mesh
from dmc_cli.mesh.placement import Placement
from dmc_cli.runtime.device import Device
from dmc_cli.settings import SurfaceSettings
from tests import shapes
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import sphere
from tests.mesh.meshes import on_device

DEVICE = Device("cpu", 2)
POINTS, FACES = shapes.torus()
POSITIONS = wp.array(POINTS.astype(np.float32), dtype=wp.vec3, device="cpu")
CORNERS = wp.array(FACES.astype(np.int32), dtype=wp.vec4i, device="cpu")


def zeros(count, dtype=wp.int32):
    return wp.zeros(count, dtype=dtype, device="cpu")


def test_a_sound_mesh_is_accepted():
    values = {"a": zeros(len(POINTS), wp.vec2i)}
    mesh = connect(Mesh(POSITIONS, CORNERS, DEVICE, vertex_values=values))
    assert mesh.vertex_values == values
    assert Mesh(zeros(0, wp.vec3), zeros(0, wp.vec4i), DEVICE).face_count == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"positions": POINTS}, r"the positions are of type ndarray; expected .* mesh_of_file"),
        ({"faces": FACES}, r"the faces are of type ndarray; expected a Warp array of vec4i"),
        ({"faces": zeros((9, 4), wp.int64)}, r"the faces are int64 of shape \(9, 4\)"),
        ({"faces": zeros((9, 4))}, r"the faces are int32 of shape \(9, 4\), contiguous; expected vec4i"),
        ({"faces": CORNERS[::2]}, "not contiguous; expected vec4i of one axis, contiguous"),
        ({"positions": zeros(9, wp.vec3d)}, r"the positions are vec3d of shape \(9,\)"),
        ({"device": "cpu"}, "'cpu' was found as the device; expected what select_device returns"),
        ({"device": Device("cuda:0", 2)}, "the positions are on cpu; expected them on cuda:0"),
        ({"vertex_values": {"a": zeros(3)}}, "there are 3 vertex values 'a'; expected"),
        ({"face_values": {"a": zeros((len(FACES), 2))}}, r"the face values 'a' are int32 of shape"),
        ({"face_values": {"a": np.zeros(len(FACES))}}, "the face values 'a' are of type ndarray"),
        (
            {"halfedges": Halfedges(zeros(4), zeros(len(POINTS)), zeros(len(POINTS)))},
            f"there are 4 items of twin; expected {4 * len(FACES)}",
        ),
    ],
)
def test_what_an_array_is_is_checked_when_the_mesh_is_made(change, message):
    with pytest.raises(CallError, match=message):
        Mesh(**{"positions": POSITIONS, "faces": CORNERS, "device": DEVICE} | change)


def spoilt(corner, vertex):
    faces = FACES.astype(np.int32)
    faces[5, corner] = vertex
    return Mesh(POSITIONS, wp.array(faces, dtype=wp.vec4i, device="cpu"), DEVICE)


@pytest.mark.parametrize("use", [connect, measure_quality, measure_topology, file_of_mesh])
@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (spoilt(0, len(POINTS)), f"face 5 names a vertex outside 0 to {len(POINTS) - 1}"),
        (spoilt(3, -2), "face 5 names a vertex outside"),
        (spoilt(1, -1), "face 5 names a vertex outside"),
        (spoilt(3, -1), "triangle_count is 0; expected 1, the faces with -1 as their fourth corner"),
        (replace(Mesh(POSITIONS, CORNERS, DEVICE), triangle_count=2), "triangle_count is 2; expected 0"),
    ],
)
def test_what_is_in_the_faces_is_checked_before_they_are_connected_measured_or_written(use, mesh, message):
    with pytest.raises(CallError, match=message):
        use(mesh)


def test_the_arrays_of_a_placement_are_checked():
    frame = extract_on("cpu", sphere(8), SurfaceSettings(isovalue=0.0)).placement.frame
    Placement(zeros(3, wp.int64), zeros(3, wp.vec3), frame)
    with pytest.raises(CallError, match=r"the cells are int32 of shape \(3,\), contiguous; expected int64"):
        Placement(zeros(3), zeros(3, wp.vec3), frame)
    with pytest.raises(CallError, match="there are 2 local coordinates; expected 3"):
        Placement(zeros(3, wp.int64), zeros(2, wp.vec3), frame)


def test_shapes_of_the_tests_are_sound():
    assert connect(on_device(shapes.halved((POINTS, FACES), 3), DEVICE)).triangle_count > 0
