"""Colours of meshes and of their groups, as other programs read them."""

import json
import struct
from dataclasses import replace
from pathlib import Path

import lib3mf
import numpy as np
import pytest
import trimesh
import vtk
from pxr import Usd, UsdGeom
from vtk.util.numpy_support import vtk_to_numpy

from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io.mesh_file import UNCOLORED, grouped, linear
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh

RED, GREEN = (255, 16, 0), (0, 128, 64)
VTK_READERS = {
    "vtp": vtk.vtkXMLPolyDataReader,
    "vtu": vtk.vtkXMLUnstructuredGridReader,
    "vtk": vtk.vtkPolyDataReader,
}


@pytest.fixture
def three(cube):
    """Three cubes side by side, the last one without a colour."""
    cubes = [replace(cube, points=cube.points + np.array([5 * n, 0, 0], np.float32)) for n in range(3)]
    return grouped({"a": replace(cubes[0], color=RED), "b": replace(cubes[1], color=GREEN), "c": cubes[2]})


EXPECTED = np.repeat([RED, GREEN, UNCOLORED], 8, axis=0)


def written(folder, mesh, suffix, **options):
    path = str(folder / f"a.{suffix}")
    write_mesh(path, mesh, **options)
    return path


@pytest.mark.parametrize("ascii", [False, True])
@pytest.mark.parametrize("suffix", ["ply", "obj"])
def test_trimesh_reads_the_colours_of_vertices(tmp_path, three, suffix, ascii):
    path = written(tmp_path, three, suffix, ascii=ascii)
    choices = {"split_objects": False, "skip_materials": True} if suffix == "obj" else {}
    data = trimesh.load(path, process=False, force="mesh", **choices)
    order = np.lexsort(data.vertices.T)
    expected = EXPECTED[np.lexsort(three.points.T)]
    np.testing.assert_array_equal(data.visual.vertex_colors[order, :3], expected)


@pytest.mark.parametrize("suffix", VTK_READERS)
def test_vtk_reads_the_colours_of_vertices(tmp_path, three, suffix):
    reader = VTK_READERS[suffix]()
    reader.SetFileName(written(tmp_path, three, suffix))
    if suffix == "vtk":
        reader.ReadAllFieldsOn()
    reader.Update()
    colors = vtk_to_numpy(reader.GetOutput().GetPointData().GetArray("RGB"))
    assert colors.dtype == np.uint8
    np.testing.assert_array_equal(colors, EXPECTED)


def test_a_glb_has_a_material_a_colour(tmp_path, three):
    data = Path(written(tmp_path, three, "glb")).read_bytes()
    document = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])
    used = [mesh["primitives"][0].get("material") for mesh in document["meshes"]]
    assert used == [0, 1, None]
    factors = [each["pbrMetallicRoughness"]["baseColorFactor"] for each in document["materials"]]
    assert factors == [[*linear(RED), 1.0], [*linear(GREEN), 1.0]]
    found = read_mesh(tmp_path / "a.glb")
    assert (found.colors, found.warnings) == ({"a": RED, "b": GREEN}, ())
    scene = trimesh.load(tmp_path / "a.glb")
    materials = {name: getattr(each.visual, "material", None) for name, each in scene.geometry.items()}
    assert {name: found and found.name for name, found in materials.items()} == {
        "a": "a",
        "b": "b",
        "c": None,
    }


def test_light_is_what_the_standard_of_screens_says():
    assert linear((0, 255, 128)) == [0, 1, pytest.approx(0.215861, abs=1e-6)]
    assert linear((10, 11, 188)) == pytest.approx([0.003035, 0.003347, 0.502886], abs=1e-6)


def test_lib3mf_reads_the_colours_of_objects(tmp_path, three):
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(written(tmp_path, three, "3mf"))
    assert reader.GetWarningCount() == 0
    objects, found = model.GetMeshObjects(), []
    while objects.MoveNext():
        each = objects.GetCurrentMeshObject()
        group, material, is_set = each.GetObjectLevelProperty()
        color = None
        if is_set:
            shown = model.GetBaseMaterialGroupByID(group).GetDisplayColor(material)
            color = (shown.Red, shown.Green, shown.Blue)
        found.append((each.GetName(), color))
    assert found == [("a", RED), ("b", GREEN), ("c", None)]
    found = read_mesh(tmp_path / "a.3mf")
    assert (found.colors, [notice.code for notice in found.warnings]) == ({"a": RED, "b": GREEN}, [])


def test_usd_reads_the_colours_of_meshes(tmp_path, three):
    stage = Usd.Stage.Open(written(tmp_path, three, "usda"))
    colors = [
        UsdGeom.Mesh(prim).GetDisplayColorAttr().Get() for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)
    ]
    np.testing.assert_allclose(colors[0], [linear(RED)], rtol=1e-6)
    np.testing.assert_allclose(colors[1], [linear(GREEN)], rtol=1e-6)
    assert colors[2] is None


@pytest.mark.parametrize("name", FORMATS)
def test_a_format_without_colours_says_so(tmp_path, cube, name):
    told = write_mesh(str(tmp_path / f"a{FORMATS[name].suffix}"), replace(cube, color=RED)).warnings
    assert ("W-COLORS-LEFT-OUT" in [notice.code for notice in told]) == (not FORMATS[name].holds_colors)


def test_values_called_red_stay_what_they_are(tmp_path, cube):
    mesh = replace(cube, color=RED, vertex_values={"red": cube.points[:, 0]})
    found = read_mesh(written(tmp_path, mesh, "ply"))
    assert list(found.vertex_values) == ["red"]
    np.testing.assert_array_equal(found.vertex_values["red"], cube.points[:, 0])
