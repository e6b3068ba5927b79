"""STL, VTP, VTU, legacy VTK, GLB and 3MF are read back by programs that share no code with ours."""

import json
import struct
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import lib3mf
import meshio
import numpy as np
import pytest
import trimesh
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from dmc_cli.errors import SettingsError
from dmc_cli.mesh_io.mesh_file import MeshFile, grouped
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from tests import shapes
from tests.mesh_io.layouts import rings, turned

VTK_READERS = {
    "stl": vtk.vtkSTLReader,
    "vtp": vtk.vtkXMLPolyDataReader,
    "vtu": vtk.vtkXMLUnstructuredGridReader,
    "vtk": vtk.vtkPolyDataReader,
}


def written(folder, mesh, suffix, **options):
    path = str(folder / f"mesh.{suffix}")
    return path, write_mesh(path, mesh, **options)


def vtk_reader(path):
    reader = VTK_READERS[path[-3:]]()
    reader.SetFileName(path)
    if path.endswith("vtk"):
        reader.ReadAllFieldsOn()
    reader.Update()
    return reader


@pytest.fixture
def mixed(grid):
    """The sheet with a third of the faces cut to triangles, here and there, and with values of all types."""
    draws = np.random.default_rng(7)
    faces = grid.faces.copy()
    faces[draws.random(len(faces)) < 1 / 3, 3] = -1
    count = len(grid.points)
    return replace(
        grid,
        faces=faces,
        vertex_values={
            "thickness": draws.random(count).astype(np.float32),
            "valence": draws.integers(0, 9, count).astype(np.uint8),
            "odd": np.where(np.arange(count) % 3, draws.random(count), np.nan),
        },
        face_values={
            "labels": draws.integers(-5, 70_000, (len(faces), 2)).astype(np.int32),
            "quality": draws.random(len(faces)),
        },
    )


def found_values(data):
    return {data.GetArrayName(n): vtk_to_numpy(data.GetArray(n)) for n in range(data.GetNumberOfArrays())}


@pytest.mark.parametrize("ascii", [False, True])
@pytest.mark.parametrize("suffix", ["vtp", "vtu", "vtk"])
def test_vtk_reads_the_same_faces_and_values(tmp_path, mixed, suffix, ascii):
    path, _ = written(tmp_path, mixed, suffix, ascii=ascii)
    data = vtk_reader(path).GetOutput()
    cells = data.GetCells() if suffix == "vtu" else data.GetPolys()
    starts = vtk_to_numpy(cells.GetOffsetsArray())
    corners = vtk_to_numpy(cells.GetConnectivityArray())
    assert [tuple(ring.tolist()) for ring in np.split(corners, starts[1:-1])] == rings(mixed.faces)
    np.testing.assert_array_equal(vtk_to_numpy(data.GetPoints().GetData()), mixed.points)
    if suffix == "vtu":
        kinds = [data.GetCellType(n) for n in range(data.GetNumberOfCells())]
        assert kinds == [9 if len(ring) == 4 else 5 for ring in rings(mixed.faces)]
    of_points, of_cells = found_values(data.GetPointData()), found_values(data.GetCellData())
    assert set(of_points) == {"Normals", *mixed.vertex_values}
    assert set(of_cells) == set(mixed.face_values)
    np.testing.assert_array_equal(of_points["Normals"], mixed.normals)
    for found, values in ((of_points, mixed.vertex_values), (of_cells, mixed.face_values)):
        for name, array in values.items():
            assert found[name].dtype == array.dtype
            np.testing.assert_array_equal(found[name], array)


@pytest.mark.parametrize("ascii", [False, True])
def test_space_and_unit_stand_where_slicer_looks(tmp_path, cube, ascii):
    mesh = replace(cube, unit="um")
    for suffix in ("vtp", "vtu"):
        fields = vtk_reader(written(tmp_path, mesh, suffix, ascii=ascii)[0]).GetOutput().GetFieldData()
        assert fields.GetAbstractArray("SPACE").GetValue(0) == "RAS"
        assert fields.GetAbstractArray("UNIT").GetValue(0) == "um"
    for suffix in ("vtk", "stl"):
        header = vtk_reader(written(tmp_path, mesh, suffix, ascii=ascii)[0]).GetHeader()
        assert "SPACE=RAS" in header
        assert "UNIT=um" in header


@pytest.mark.parametrize("ascii", [False, True])
def test_vtk_meshio_and_trimesh_read_the_same_triangles_of_stl(tmp_path, mixed, ascii):
    path, told = written(tmp_path, mixed, "stl", ascii=ascii)
    assert [notice.code for notice in told.warnings] == [
        "W-QUADS-SPLIT",
        "W-NORMALS-LEFT-OUT",
        "W-VALUES-LEFT-OUT",
    ]
    assert f"each of {mixed.quad_count} was split into two triangles" in told.warnings[0].sentence
    ours = read_mesh(path)
    expected = ours.points[ours.faces[:, :3]].astype(np.float32)
    assert len(expected) == 2 * mixed.quad_count + mixed.triangle_count
    data = vtk_reader(path).GetOutput()
    cells = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    np.testing.assert_array_equal(vtk_to_numpy(data.GetPoints().GetData())[cells], expected)
    with np.errstate(over="ignore"):  # of the size that it looks for in a text
        found = meshio.read(path)
    np.testing.assert_array_equal(found.points[found.cells_dict["triangle"]].astype(np.float32), expected)
    found = trimesh.load(path, process=False)
    np.testing.assert_array_equal(found.vertices[found.faces].astype(np.float32), expected)


@pytest.mark.parametrize("ascii", [False, True])
def test_trimesh_sees_a_closed_house_of_stl_with_normals_outward(tmp_path, ascii):
    points, faces = shapes.house()
    path, _ = written(tmp_path, MeshFile(points=points, faces=faces), "stl", ascii=ascii)
    data = trimesh.load(path)
    assert data.is_watertight
    assert data.volume == pytest.approx(1 + 0.5 / 3)
    stored = trimesh.load(path, process=False).face_normals
    np.testing.assert_allclose(stored, data.face_normals, atol=1e-6)


@pytest.mark.parametrize("ascii", [False, True])
def test_meshio_reads_the_same_cells_of_vtu(tmp_path, mixed, ascii):
    """Without a space: it takes no texts among the fields of a file."""
    order = np.argsort(mixed.faces[:, 3] >= 0, kind="stable")
    values = {name: array[order] for name, array in mixed.face_values.items()}
    mesh = replace(mixed, space="none", faces=mixed.faces[order], face_values=values)
    data = meshio.read(written(tmp_path, mesh, "vtu", ascii=ascii)[0])
    np.testing.assert_array_equal(data.points, mesh.points)
    np.testing.assert_array_equal(data.cells_dict["quad"], mesh.faces[mesh.triangle_count :])
    np.testing.assert_array_equal(data.cells_dict["triangle"], mesh.faces[: mesh.triangle_count, :3])
    np.testing.assert_array_equal(np.concatenate(data.cell_data["labels"]), values["labels"])
    np.testing.assert_array_equal(data.point_data["thickness"], mesh.vertex_values["thickness"])


def parts(path):
    """The JSON of a GLB file, and its binary chunk."""
    data = Path(path).read_bytes()
    magic, version, length, json_length, kind = struct.unpack("<4sIII4s", data[:20])
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
    return json.loads(data[20 : 20 + json_length]), data[28 + json_length :]


def test_trimesh_reads_a_glb_in_metres_with_y_up(tmp_path, cube):
    low = cube.points + np.array([0, 0, 3], np.float32)
    mesh = replace(cube, points=low * np.array([1, 2, 1], np.float32))
    data = trimesh.load(written(tmp_path, mesh, "glb")[0]).to_geometry()
    assert data.is_watertight
    assert data.volume == pytest.approx(16e-9)
    np.testing.assert_allclose(data.bounds, [[-1e-3, 2e-3, -2e-3], [1e-3, 4e-3, 2e-3]], rtol=1e-6)


def test_the_quads_of_a_glb_are_told_as_its_extension_says(tmp_path, mixed):
    mesh = replace(mixed, vertex_values={"thickness": mixed.vertex_values["thickness"]})
    path, _ = written(tmp_path, mesh, "glb")
    document, _ = parts(path)
    assert document["extensionsUsed"] == ["FB_ngon_encoding"]
    assert document["meshes"][0]["primitives"][0]["extensions"] == {"FB_ngon_encoding": {}}
    data = trimesh.load(path, process=False).to_geometry()
    faces = []
    for first, group in groupby(data.faces.tolist(), key=lambda triangle: triangle[0]):
        fan = list(group)
        faces.append((first, fan[0][1], *(triangle[2] for triangle in fan)))
    assert [turned(face) for face in faces] == [turned(ring) for ring in rings(mesh.faces)]
    np.testing.assert_array_equal(
        data.vertex_attributes["_thickness"].ravel(), mesh.vertex_values["thickness"]
    )
    np.testing.assert_allclose(data.vertices[:, 1], mesh.points[:, 2] / 1000, atol=1e-3)


def test_vtk_reads_a_glb(tmp_path, cube):
    """It knows nothing of the extension, and says so."""
    vtk.vtkObject.GlobalWarningDisplayOff()
    reader = vtk.vtkGLTFReader()
    reader.SetFileName(written(tmp_path, cube, "glb")[0])
    reader.Update()
    vtk.vtkObject.GlobalWarningDisplayOn()
    counts = (reader.GetOutput().GetNumberOfPoints(), reader.GetOutput().GetNumberOfCells())
    assert counts == (8, 12)


def test_a_face_with_a_corner_twice_leaves_a_glb_of_plain_triangles(tmp_path, cube):
    faces = np.vstack([cube.faces, [[0, 1, 0, 2]]]).astype(np.int32)
    path, _ = written(tmp_path, replace(cube, faces=faces), "glb")
    assert "extensionsUsed" not in parts(path)[0]
    assert read_mesh(path).triangle_count == 14


def test_a_value_that_is_no_number_is_refused_by_glb(tmp_path, mixed):
    with pytest.raises(SettingsError, match="the value odd is no finite number at some vertices"):
        written(tmp_path, mixed, "glb")
    assert not list(tmp_path.iterdir())


def two_parts(cube):
    """Two cubes, one beside the other, as groups."""
    moved = replace(cube, points=cube.points + np.array([5, 0, 0], np.float32))
    return grouped({"left": cube, "right & more": moved})


def test_groups_of_a_glb_are_nodes(tmp_path, cube):
    scene = trimesh.load(written(tmp_path, two_parts(cube), "glb")[0])
    assert sorted(scene.graph.nodes_geometry) == ["left", "right & more"]
    for name, x in (("left", -1e-3), ("right & more", 4e-3)):
        transform, geometry = scene.graph[name]
        part = scene.geometry[geometry].copy().apply_transform(transform)
        assert (len(part.vertices), part.is_watertight) == (8, True)
        assert part.bounds[0, 0] == pytest.approx(x)


def model_of(path):
    """What 3MF's own library reads in its strict mode."""
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(path)
    assert reader.GetWarningCount() == 0
    return model


def objects_of(model):
    """The objects of a model."""
    iterator, found = model.GetMeshObjects(), []
    while iterator.MoveNext():
        found.append(iterator.GetCurrentMeshObject())
    return found


def test_lib3mf_reads_the_same_triangles(tmp_path, mixed):
    path, told = written(tmp_path, mixed, "3mf")
    assert told.warnings[0].code == "W-QUADS-SPLIT"
    model = model_of(path)
    assert model.GetUnit() == lib3mf.ModelUnit.MilliMeter
    (found,) = objects_of(model)
    ours = read_mesh(path)
    points = np.array([list(vertex.Coordinates) for vertex in found.GetVertices()], np.float32)
    triangles = np.array([list(triangle.Indices) for triangle in found.GetTriangleIndices()])
    np.testing.assert_allclose(points, mixed.points, rtol=1e-6)
    np.testing.assert_array_equal(triangles, ours.faces[:, :3])
    np.testing.assert_array_equal(ours.points.astype(np.float32), mixed.points)


@pytest.mark.parametrize(
    ("unit", "told", "factor"), [("um", "MicroMeter", 1), ("m", "Meter", 1), ("nm", "MicroMeter", 1e-3)]
)
def test_lib3mf_reads_the_unit(tmp_path, cube, unit, told, factor):
    model = model_of(written(tmp_path, replace(cube, unit=unit), "3mf")[0])
    assert model.GetUnit() == getattr(lib3mf.ModelUnit, told)
    items = model.GetBuildItems()
    assert items.MoveNext()
    fields = items.GetCurrent().GetObjectTransform().Fields
    assert fields[0][0] == pytest.approx(factor)


def test_groups_of_a_3mf_are_objects(tmp_path, cube):
    found = objects_of(model_of(written(tmp_path, two_parts(cube), "3mf")[0]))
    assert [each.GetName() for each in found] == ["left", "right & more"]
    assert all(each.IsManifoldAndOriented() for each in found)
    assert [each.GetVertices()[0].Coordinates[0] for each in found] == [-1, 4]


@pytest.mark.parametrize("suffix", ["stl", "vtp", "off"])
def test_groups_that_a_format_cannot_hold_are_told(tmp_path, cube, suffix):
    _, told = written(tmp_path, two_parts(cube), suffix)
    assert "W-GROUPS-LEFT-OUT" in [notice.code for notice in told.warnings]
