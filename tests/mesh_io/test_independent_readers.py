"""Files are read back by programs that share no code with ours."""

from dataclasses import replace

import meshio
import numpy as np
import pytest
import trimesh
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.write import write_mesh
from tests import shapes

NAMES = ["mesh.ply", "mesh.ascii.ply", "mesh.obj", "mesh.off"]
VTK_READERS = {"ply": vtk.vtkPLYReader, "obj": vtk.vtkOBJReader, "off": vtk.vtkOFFReader}


def written(tmp_path, mesh, name):
    path = str(tmp_path / name)
    write_mesh(path, mesh, ascii="ascii" in name)
    return path


def vtk_mesh(path):
    reader = VTK_READERS[path[-3:]]()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("shape", ["cube", "grid"])
def test_vtk_reads_the_same_quads(request, tmp_path, name, shape):
    mesh = request.getfixturevalue(shape)
    data = vtk_mesh(written(tmp_path, mesh, name))
    cells = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 4)
    np.testing.assert_array_equal(vtk_to_numpy(data.GetPoints().GetData()).astype(np.float32), mesh.points)
    np.testing.assert_array_equal(cells, mesh.faces)


@pytest.mark.parametrize("name", ["mesh.ply", "mesh.ascii.ply", "mesh.obj"])
def test_vtk_reads_the_same_normals(tmp_path, grid, name):
    data = vtk_mesh(written(tmp_path, grid, name))
    np.testing.assert_array_equal(
        vtk_to_numpy(data.GetPointData().GetNormals()).astype(np.float32), grid.normals
    )


@pytest.mark.parametrize("name", ["mesh.ply", "mesh.ascii.ply", "mesh.obj"])
@pytest.mark.parametrize("shape", ["cube", "grid"])
def test_meshio_reads_the_same_quads(request, tmp_path, name, shape):
    mesh = request.getfixturevalue(shape)
    data = meshio.read(written(tmp_path, mesh, name))
    np.testing.assert_array_equal(data.points.astype(np.float32), mesh.points)
    np.testing.assert_array_equal(data.cells_dict["quad"], mesh.faces)
    assert list(data.cells_dict) == ["quad"]


@pytest.mark.parametrize("name", NAMES)
def test_trimesh_sees_a_closed_cube_that_faces_outward(tmp_path, cube, name):
    data = trimesh.load(written(tmp_path, cube, name), force="mesh")
    assert data.is_watertight
    assert data.volume == pytest.approx(8)


@pytest.fixture
def mixed(grid):
    """The sheet with a third of the faces cut to triangles, here and there, and with values."""
    draws = np.random.default_rng(7)
    faces = grid.faces.copy()
    faces[draws.random(len(faces)) < 1 / 3, 3] = -1
    return replace(
        grid,
        faces=faces,
        vertex_values={"thickness": draws.random(len(grid.points)).astype(np.float32)},
        face_values={"labels": draws.integers(-5, 70_000, (len(faces), 2)).astype(np.int32)},
    )


def rings(faces):
    return [tuple(v for v in face if v >= 0) for face in faces.tolist()]


@pytest.mark.parametrize("name", NAMES)
def test_vtk_reads_triangles_and_quads_in_their_order(tmp_path, mixed, name):
    cells = vtk_mesh(written(tmp_path, mixed, name)).GetPolys()
    starts = vtk_to_numpy(cells.GetOffsetsArray())
    corners = vtk_to_numpy(cells.GetConnectivityArray())
    assert [tuple(ring.tolist()) for ring in np.split(corners, starts[1:-1])] == rings(mixed.faces)


@pytest.mark.parametrize("name", ["mesh.ply", "mesh.ascii.ply", "mesh.obj"])
def test_meshio_reads_the_same_triangles_and_quads(tmp_path, mixed, name):
    data = meshio.read(written(tmp_path, replace(mixed, face_values={}), name))
    np.testing.assert_array_equal(data.points.astype(np.float32), mixed.points)
    is_triangle = mixed.faces[:, 3] < 0
    for kind, faces in (("triangle", mixed.faces[is_triangle, :3]), ("quad", mixed.faces[~is_triangle])):
        found = np.concatenate([block.data for block in data.cells if block.type == kind])
        np.testing.assert_array_equal(found, faces)
    if name.endswith("ply"):
        found = data.point_data["thickness"].astype(np.float32)
        np.testing.assert_array_equal(found, mixed.vertex_values["thickness"])


def test_meshio_reads_the_same_values_of_faces(tmp_path, mixed):
    """In text, where triangles come before quads; in other files it does not."""
    order = np.argsort(mixed.faces[:, 3] >= 0, kind="stable")
    values = {name: array[order] for name, array in mixed.face_values.items()}
    sorted_faces = replace(mixed, faces=mixed.faces[order], face_values=values)
    data = meshio.read(written(tmp_path, sorted_faces, "mesh.ascii.ply"))
    found = [np.concatenate(data.cell_data[f"labels_{side}"]) for side in (0, 1)]
    np.testing.assert_array_equal(np.transpose(found), values["labels"])


@pytest.mark.parametrize("name", ["mesh.ply", "mesh.ascii.ply"])
@pytest.mark.parametrize("shape", ["tetrahedron", "sphere"])
def test_trimesh_reads_the_same_values(tmp_path, name, shape):
    points, faces = getattr(shapes, shape)()
    labels = np.stack([np.arange(len(faces)), 70_000 - np.arange(len(faces))], axis=1).astype(np.int32)
    thickness = np.linspace(0, 1, len(points))
    mesh = MeshFile(
        points=points, faces=faces, vertex_values={"thickness": thickness}, face_values={"labels": labels}
    )
    elements = trimesh.load(written(tmp_path, mesh, name), process=False).metadata["_ply_raw"]
    np.testing.assert_array_equal(np.ravel(elements["vertex"]["data"]["thickness"]), thickness)
    found = [np.ravel(elements["face"]["data"][f"labels_{side}"]) for side in (0, 1)]
    np.testing.assert_array_equal(np.transpose(found), labels)


@pytest.mark.parametrize("name", ["mesh.ascii.ply", "mesh.obj", "mesh.off"])
def test_trimesh_sees_a_closed_house_of_quads_and_triangles(tmp_path, name):
    """Its binary PLY has faces of one size only."""
    points, faces = shapes.house()
    data = trimesh.load(written(tmp_path, MeshFile(points=points, faces=faces), name), force="mesh")
    assert data.is_watertight
    assert data.volume == pytest.approx(1 + 0.5 / 3)


@pytest.mark.parametrize("name", NAMES)
def test_trimesh_sees_a_closed_tetrahedron(tmp_path, name):
    points, faces = shapes.tetrahedron()
    data = trimesh.load(written(tmp_path, MeshFile(points=points, faces=faces), name), force="mesh")
    assert data.is_watertight
    assert data.volume == pytest.approx(1 / 6)


@pytest.mark.parametrize(
    ("name", "mark"), [("mesh.ply", "comment "), ("mesh.ascii.ply", "comment "), ("mesh.obj", "# ")]
)
def test_slicer_finds_the_space_in_a_comment(tmp_path, cube, name, mark):
    with open(written(tmp_path, cube, name), "rb") as file:
        start = file.read(200).decode("ascii", "replace")
    assert f"\n{mark}SPACE=RAS\n" in start
