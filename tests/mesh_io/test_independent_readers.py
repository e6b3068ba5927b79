"""Files are read back by programs that share no code with ours."""

import meshio
import numpy as np
import pytest
import trimesh
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from dmc_cli.mesh_io.write import write_mesh

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


@pytest.mark.parametrize(
    ("name", "mark"), [("mesh.ply", "comment "), ("mesh.ascii.ply", "comment "), ("mesh.obj", "# ")]
)
def test_slicer_finds_the_space_in_a_comment(tmp_path, cube, name, mark):
    with open(written(tmp_path, cube, name), "rb") as file:
        start = file.read(200).decode("ascii", "replace")
    assert f"\n{mark}SPACE=RAS\n" in start
