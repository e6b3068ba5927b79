"""USD is read back by its own library, quads, values and groups; what else it writes is read by us."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.mesh_file import grouped
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from tests.mesh_io.layouts import rings


def written(folder, mesh, name="a.usda"):
    path = str(folder / name)
    assert not write_mesh(path, mesh).warnings
    return path


@pytest.fixture
def mixed(grid):
    """The sheet with a third of the faces cut to triangles, and with values of all types."""
    draws = np.random.default_rng(7)
    faces = grid.faces.copy()
    faces[draws.random(len(faces)) < 1 / 3, 3] = -1
    count = len(grid.points)
    vertex_values = {
        "thickness": np.where(np.arange(count) % 3, draws.random(count), np.nan),
        "flow": draws.random((count, 3)).astype(np.float32),
        "kind": draws.integers(0, 200, count).astype(np.uint8),
    }
    labels = draws.integers(-5, 70_000, (len(faces), 2)).astype(np.int32)
    return replace(grid, faces=faces, vertex_values=vertex_values, face_values={"labels": labels})


def test_usd_reads_the_same_polygons_normals_and_values(tmp_path, mixed):
    stage = Usd.Stage.Open(written(tmp_path, mixed))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.001
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert stage.GetDefaultPrim().GetName() == "dmc"
    assert stage.GetRootLayer().customLayerData == {"SPACE": "LPS"}
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/dmc/mesh"))
    assert mesh.GetSubdivisionSchemeAttr().Get() == "none"
    counts, corners = (
        np.array(mesh.GetFaceVertexCountsAttr().Get()),
        np.array(mesh.GetFaceVertexIndicesAttr().Get()),
    )
    assert [tuple(ring.tolist()) for ring in np.split(corners, np.cumsum(counts)[:-1])] == rings(mixed.faces)
    np.testing.assert_array_equal(np.array(mesh.GetPointsAttr().Get()), mixed.points)
    np.testing.assert_array_equal(np.array(mesh.GetNormalsAttr().Get()), mixed.normals)
    assert mesh.GetNormalsInterpolation() == "vertex"
    np.testing.assert_array_equal(
        np.array(mesh.GetExtentAttr().Get()), [mixed.points.min(axis=0), mixed.points.max(axis=0)]
    )
    values = UsdGeom.PrimvarsAPI(mesh)
    for name, array in mixed.vertex_values.items():
        assert values.GetPrimvar(name).GetInterpolation() == "vertex"
        np.testing.assert_array_equal(np.array(values.GetPrimvar(name).Get()), array)
    assert values.GetPrimvar("labels").GetInterpolation() == "uniform"
    np.testing.assert_array_equal(np.array(values.GetPrimvar("labels").Get()), mixed.face_values["labels"])
    assert not UsdGeom.Mesh.ValidateTopology(
        mesh.GetFaceVertexIndicesAttr().Get(), mesh.GetFaceVertexCountsAttr().Get(), len(mixed.points)
    )[1]


def test_groups_are_meshes(tmp_path, cube):
    moved = replace(cube, points=cube.points + np.array([5, 0, 0], np.float32))
    stage = Usd.Stage.Open(written(tmp_path, grouped({"left": cube, "2 right": moved})))
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert [mesh.GetPrim().GetName() for mesh in meshes] == ["left", "part_2_right"]
    assert [np.array(mesh.GetPointsAttr().Get())[:, 0].min() for mesh in meshes] == [-1, 4]


def test_another_unit_and_another_axis_are_read(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, "Y")
    place = UsdGeom.Xform.Define(stage, "/a")
    place.AddTranslateOp().Set(Gf.Vec3d(1, 0, 0))
    mesh = UsdGeom.Mesh.Define(stage, "/a/b")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (1, 2, 0), (0, 2, 3)])
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    stage.Save()
    del stage, place, mesh
    found = read_mesh(tmp_path / "a.usda")
    assert found.faces.tolist() == [[0, 1, 2, 3]]
    np.testing.assert_allclose(found.points, [[10, 0, 0], [20, 0, 0], [20, 0, 20], [10, -30, 20]])


def test_a_file_that_is_none_is_refused_and_a_missing_library_told(tmp_path, cube, monkeypatch):
    (tmp_path / "a.usda").write_text("#usda 1.0\ndef Mesh {")
    with pytest.raises(MeshFileError, match="USD's library cannot read it"):
        read_mesh(tmp_path / "a.usda")
    path = written(tmp_path, cube, "b.usda")
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(UnsupportedFormatError, match=r"install it with pip install 'dmc-cli\[usd\]'"):
        read_mesh(path)


def stage_of(counts, *corners, normals="[(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)]"):
    """A stage of meshes with four points each."""
    points = "[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]"
    meshes = "".join(
        f'def Mesh "m{number}"\n{{\nint[] faceVertexCounts = {counts}\nint[] faceVertexIndices = {found}\n'
        f'point3f[] points = {points}\nnormal3f[] normals = {normals} (\ninterpolation = "vertex"\n)\n}}\n'
        for number, found in enumerate(corners)
    )
    return f'#usda 1.0\n(\nmetersPerUnit = 0.001\nupAxis = "Z"\n)\n{meshes}'


@pytest.mark.parametrize(
    ("counts", "corners", "told"),
    [
        ([4, 3], [[0, 1, 2, 3, 0, 1]], "6 corners of 2 faces were found; expected 7"),
        ([4], [[0, 1, 2, 3, 0]], "5 corners of 1 faces were found; expected 4"),
        ([4], [[0, 1, 2], [3, 0, 1, 2, 3]], "3 corners of 1 faces were found; expected 4"),
        ([4], [[0, 1, 2, 4], [0, 1, 2, 3]], "a face names vertex 4; expected 0 to 3"),
        ([4], [[0, 1, 2, 3], [0, 1, 2, -1]], "a face names vertex -1; expected 0 to 3"),
        ([-4], [[0, 1, 2, 3]], "4 corners of 1 faces were found; expected -4"),
    ],
)
def test_faces_that_do_not_fit_their_mesh_are_refused(tmp_path, counts, corners, told):
    """Also where what one mesh lacks the next one has."""
    (tmp_path / "a.usda").write_text(stage_of(counts, *corners))
    with pytest.raises(MeshFileError, match=rf"a\.usda: {told}"):
        read_mesh(tmp_path / "a.usda")


@pytest.mark.parametrize("number", ["nan", "inf", "1e300"])
def test_normals_that_are_no_numbers_are_told(tmp_path, number):
    normals = f"[(0, 0, {number}), (0, 0, 1), (0, 0, 1), (0, 0, 1)]"
    (tmp_path / "a.usda").write_text(stage_of([4], [0, 1, 2, 3], normals=normals))
    mesh = read_mesh(tmp_path / "a.usda")
    assert mesh.normals is None
    assert mesh.warnings[0].sentence == "a.usda: not read and not used: normals"


@pytest.mark.parametrize("length", ["0", "-0.001", "inf", "nan"])
def test_a_unit_that_is_no_length_is_refused(tmp_path, length):
    """A negative one would mirror the mesh."""
    text = stage_of([4], [0, 1, 2, 3]).replace("metersPerUnit = 0.001", f"metersPerUnit = {length}")
    (tmp_path / "a.usda").write_text(text)
    with pytest.raises(
        MeshFileError, match=r"a\.usda: a unit of .* metres was found; expected a length above 0"
    ):
        read_mesh(tmp_path / "a.usda")


def test_attributes_of_no_type_are_refused_and_subsets_told(tmp_path):
    text = stage_of([4], [0, 1, 2, 3])
    (tmp_path / "a.usda").write_text(text.replace("int[] faceVertexCounts", "nt[] faceVertexCounts"))
    with pytest.raises(MeshFileError, match=r"a\.usda: an attribute of a mesh has no numbers"):
        read_mesh(tmp_path / "a.usda")
    subset = 'def GeomSubset "top"\n{\nuniform token elementType = "face"\nint[] indices = [0]\n}\n}\n'
    (tmp_path / "b.usda").write_text(text.removesuffix("}\n") + subset)
    mesh = read_mesh(tmp_path / "b.usda")
    assert list(mesh.groups) == ["m0"]
    assert mesh.warnings[0].sentence == "b.usda: not read and not used: subsets of faces"
