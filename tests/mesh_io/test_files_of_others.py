"""STL, VTK's formats, GLB and 3MF that other programs have written are read, in each of their encodings."""

from dataclasses import replace

import lib3mf
import meshio
import numpy as np
import pytest
import trimesh
import vtk
from vtk.util.numpy_support import numpy_to_vtk

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from tests import shapes
from tests.mesh_io.layouts import rings

HEAD = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET "
POINTS, FACES = shapes.house()
RINGS = rings(FACES)


def data_set(kind, *, lines=False):
    """The house as VTK has it, with a value of each vertex and two of each face."""
    data = kind()
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(POINTS.astype(np.float32), deep=True))
    data.SetPoints(points)
    data.Allocate(10)
    if lines:
        line = vtk.vtkIdList()
        for v in (0, 1, 2):
            line.InsertNextId(v)
        data.InsertNextCell(4, line)
    for ring in RINGS:
        ids = vtk.vtkIdList()
        for v in ring:
            ids.InsertNextId(v)
        data.InsertNextCell({3: 5, 4: 9}[len(ring)], ids)
    count = len(RINGS) + lines
    heights = numpy_to_vtk(POINTS[:, 2].astype(np.float64), deep=True)
    heights.SetName("height")
    data.GetPointData().AddArray(heights)
    pairs = numpy_to_vtk(np.arange(2 * count, dtype=np.int32).reshape(-1, 2), deep=True)
    pairs.SetName("labels")
    data.GetCellData().AddArray(pairs)
    ids = numpy_to_vtk(np.arange(count, dtype=np.int64), deep=True)
    ids.SetName("cell ids")
    data.GetCellData().AddArray(ids)
    space = vtk.vtkStringArray()
    space.SetName("SPACE")
    space.InsertNextValue("LPS")
    data.GetFieldData().AddArray(space)
    return data


def check_house(mesh, lines=False):
    np.testing.assert_array_equal(mesh.points.astype(np.float32), POINTS.astype(np.float32))
    assert rings(mesh.faces) == RINGS
    np.testing.assert_array_equal(mesh.vertex_values["height"], POINTS[:, 2])
    np.testing.assert_array_equal(mesh.face_values["labels"][:, 0], 2 * (np.arange(len(RINGS)) + lines))
    told = "".join(notice.sentence for notice in mesh.warnings)
    assert "values cell ids" in told
    assert ("1 cells of polyline" in told) == lines


@pytest.mark.parametrize("lines", [False, True])
@pytest.mark.parametrize("compressor", [None, vtk.vtkZLibDataCompressor, vtk.vtkLZMADataCompressor])
@pytest.mark.parametrize("header", ["SetHeaderTypeToUInt32", "SetHeaderTypeToUInt64"])
@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended", "Appended raw"])
@pytest.mark.parametrize(
    ("suffix", "kind", "writer"),
    [
        ("vtp", vtk.vtkPolyData, vtk.vtkXMLPolyDataWriter),
        ("vtu", vtk.vtkUnstructuredGrid, vtk.vtkXMLUnstructuredGridWriter),
    ],
)
def test_xml_of_vtk_is_read_in_every_encoding(
    tmp_path, suffix, kind, writer, mode, header, compressor, lines
):
    path = str(tmp_path / f"a.{suffix}")
    output = writer()
    output.SetFileName(path)
    output.SetInputData(data_set(kind, lines=lines))
    getattr(output, f"SetDataModeTo{mode.split()[0]}")()
    output.SetEncodeAppendedData(mode == "Appended")
    output.SetCompressor(None if compressor is None else compressor())
    getattr(output, header)()
    output.SetBlockSize(64)
    assert output.Write()
    mesh = read_mesh(path)
    check_house(mesh, lines)
    assert mesh.space == "LPS"


@pytest.mark.parametrize("byte_order", ["BigEndian", "LittleEndian"])
def test_xml_of_either_byte_order_is_read(tmp_path, byte_order):
    path = str(tmp_path / "a.vtp")
    output = vtk.vtkXMLPolyDataWriter()
    output.SetFileName(path)
    output.SetInputData(data_set(vtk.vtkPolyData))
    getattr(output, f"SetByteOrderTo{byte_order}")()
    output.Write()
    check_house(read_mesh(path))


@pytest.mark.parametrize("is_binary", [False, True])
@pytest.mark.parametrize("version", [42, 51])
@pytest.mark.parametrize(
    ("kind", "writer"),
    [
        (vtk.vtkPolyData, vtk.vtkPolyDataWriter),
        (vtk.vtkUnstructuredGrid, vtk.vtkUnstructuredGridWriter),
    ],
)
def test_legacy_files_of_vtk_are_read(tmp_path, kind, writer, version, is_binary):
    path = str(tmp_path / "a.vtk")
    data = data_set(kind, lines=True)
    data.GetFieldData().Initialize()
    normals = numpy_to_vtk(np.tile(np.float32([0, 0, 1]), (len(POINTS), 1)), deep=True)
    normals.SetName("n")
    data.GetPointData().SetNormals(normals)
    data.GetPointData().SetActiveScalars("height")
    output = writer()
    output.SetFileName(path)
    output.SetInputData(data)
    output.SetHeader("vtk output;SPACE=LPS")
    output.SetFileVersion(version)
    (output.SetFileTypeToBinary if is_binary else output.SetFileTypeToASCII)()
    output.Write()
    mesh = read_mesh(path)
    check_house(mesh, lines=True)
    assert mesh.space == "LPS"
    np.testing.assert_array_equal(mesh.normals, np.tile([0, 0, 1], (len(POINTS), 1)))


def test_legacy_files_of_meshio_are_read(tmp_path):
    path = tmp_path / "a.vtk"
    for binary in (True, False):
        kinds = [("quad", FACES[FACES[:, 3] >= 0]), ("triangle", FACES[FACES[:, 3] < 0, :3])]
        meshio.write(path, meshio.Mesh(POINTS, kinds), binary=binary)
        mesh = read_mesh(path)
        assert sorted(rings(mesh.faces)) == sorted(RINGS)


def test_a_legacy_file_with_colours_texture_and_a_table_is_read(tmp_path):
    path = tmp_path / "a.vtk"
    path.write_text(
        HEAD + "POLYDATA\nPOINTS 3 double\n0 0 0 1 0\n0 0 1 0\n\n"
        "POLYGONS 1 4\n3 0 1 2\n\nPOINT_DATA 3\nSCALARS depth float 1\nLOOKUP_TABLE mine\n1 2 nan\n"
        "LOOKUP_TABLE mine 2\n0 0 0 1 1 1 1 1\nTEXTURE_COORDINATES t 2 float\n0 0 0 1 1 1\nVECTORS v float\n"
        "1 2 3 4 5 6 7 8 9\nCELL_DATA 1\nCOLOR_SCALARS rgb 3\n0.5 0 1\n"
    )
    mesh = read_mesh(path)
    np.testing.assert_array_equal(mesh.vertex_values["depth"], np.float32([1, 2, np.nan]))
    np.testing.assert_array_equal(mesh.vertex_values["v"], np.arange(1, 10).reshape(3, 3))
    np.testing.assert_array_equal(mesh.face_values["rgb"], [[0.5, 0, 1]])
    assert mesh.warnings[0].sentence == "a.vtk: not read and not used: texture coordinates"


@pytest.mark.parametrize(
    ("name", "text", "error", "told"),
    [
        ("a.vtp", "<VTKFile type='PolyData'><PolyData>", MeshFileError, "XML of VTK was expected"),
        ("a.vtp", "<VTKFile type='ImageData'><ImageData/></VTKFile>", MeshFileError, "VTK's ImageData"),
        ("a.vtp", "<VTKFile compressor='vtkLZ4DataCompressor'/>", UnsupportedFormatError, "expected vtkZLib"),
        ("a.vtu", "<VTKFile byte_order='Middle'/>", MeshFileError, "byte_order LittleEndian or BigEndian"),
        ("a.vtu", "<VTKFile><UnstructuredGrid/></VTKFile>", MeshFileError, "no element Piece"),
        ("a.vtk", "# vtk DataFile Version 3.0\n", MeshFileError, "this is no legacy VTK file"),
        ("a.vtk", HEAD + "POLYDATA\nPOINTS 9 float\n0 0", MeshFileError, "cut off"),
        ("a.vtk", HEAD + "RECTILINEAR_GRID\n", UnsupportedFormatError, "RECT"),
        ("a.vtk", HEAD + "POLYDATA\nPOINTS x y\n", MeshFileError, "is not what VTK"),
        ("a.vtk", HEAD + "POLYDATA\nNONSENSE 3\n", MeshFileError, "a section was"),
        ("a.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", MeshFileError, "nine a"),
        ("a.stl", "x" * 90, MeshFileError, "or no STL file"),
        ("a.glb", "glTF", MeshFileError, "this is no GLB file"),
        ("a.glb", "glTF\x02\0\0\0\x14\0\0\0\x02\0\0\0JSON[]", MeshFileError, "the JSON is no object"),
        ("a.3mf", "PK", MeshFileError, "a zip with 3D/3dmodel.model was expected"),
    ],
)  # fmt: skip
def test_what_is_no_such_file_is_refused(tmp_path, name, text, error, told):
    (tmp_path / name).write_text(text, "latin-1")
    with pytest.raises(error, match=told):
        read_mesh(tmp_path / name)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
def test_stl_of_trimesh_is_read_and_its_corners_joined(tmp_path, kind):
    sphere = trimesh.creation.icosphere(2)
    path = tmp_path / "a.stl"
    path.write_bytes(
        sphere.export(file_type=kind) if kind == "stl" else sphere.export(file_type=kind).encode()
    )
    mesh = read_mesh(path)
    assert (len(mesh.points), len(mesh.faces)) == (len(sphere.vertices), len(sphere.faces))
    again = trimesh.Trimesh(mesh.points, mesh.faces[:, :3])
    assert again.is_watertight
    assert again.volume == pytest.approx(sphere.volume, rel=1e-5)


def test_zeros_of_either_sign_are_one_place_in_stl(tmp_path, cube):
    points = cube.points.copy()
    points[:, 0] = np.where(points[:, 0] > 0, 1, np.where(points[:, 1] > 0, -0.0, 0.0))
    write_mesh(str(tmp_path / "a.stl"), replace(cube, points=points))
    assert len(read_mesh(tmp_path / "a.stl").points) == 8


def test_glb_of_trimesh_is_read_in_millimetres_with_z_up(tmp_path):
    box = trimesh.creation.box((1, 2, 3))
    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 0, 1], [1, 0, 0])
    scene.add_geometry(box, node_name="a")
    scene.add_geometry(box, node_name="b", parent_node_name="a", transform=turn)
    path = tmp_path / "a.glb"
    path.write_bytes(scene.export(file_type="glb"))
    mesh = read_mesh(path)
    assert (len(mesh.faces), mesh.quad_count) == (24, 0)
    bounds = scene.bounds * 1000  # y up
    expected = np.stack([bounds[:, 0], -bounds[::-1, 2], bounds[:, 1]], axis=1)
    found = np.stack([mesh.points.min(axis=0), mesh.points.max(axis=0)])
    np.testing.assert_allclose(found, expected, atol=1e-3)
    assert trimesh.Trimesh(mesh.points, mesh.faces[:, :3]).volume == pytest.approx(12e9, rel=1e-6)


def test_3mf_of_lib3mf_is_read_where_it_is_built_in_millimetres(tmp_path):
    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.Inch)
    box = trimesh.creation.box((1, 2, 3))
    found = model.AddMeshObject()
    positions = [lib3mf.Position((lib3mf.ctypes.c_float * 3)(*vertex)) for vertex in box.vertices]
    triangles = [lib3mf.Triangle((lib3mf.ctypes.c_uint32 * 3)(*face)) for face in box.faces]
    found.SetGeometry(positions, triangles)
    model.AddBuildItem(found, wrapper.GetIdentityTransform())
    model.AddBuildItem(found, wrapper.GetTranslationTransform(10, 0, 0))
    path = str(tmp_path / "a.3mf")
    model.QueryWriter("3mf").WriteToFile(path)
    mesh = read_mesh(path)
    assert len(mesh.faces) == 24
    np.testing.assert_allclose(mesh.points.min(axis=0), box.bounds[0] * 25.4, rtol=1e-6)
    np.testing.assert_allclose(mesh.points.max(axis=0), (box.bounds[1] + [10, 0, 0]) * 25.4, rtol=1e-6)


@pytest.mark.timeout(60)
@pytest.mark.parametrize("text", ["BEGIN BULK\n", "BEGIN BULK\n$ nothing\n\n", "BEGIN BULK", ""])
def test_bulk_data_without_a_card_are_refused(tmp_path, text):
    (tmp_path / "a.nas").write_text(text)
    with pytest.raises(MeshFileError):
        read_mesh(tmp_path / "a.nas")


FACETS = """  facet normal 0 0 1
    outer loop
      vertex {0} 0 0
      vertex 1e0 {0} -0.5
      vertex 1 +1. {0}
    endloop
  endfacet
"""


@pytest.mark.parametrize("chunk", [1, 150, 1 << 23])
def test_texts_of_triangles_are_read_whatever_their_solids_are_called(tmp_path, monkeypatch, chunk):
    """Several solids, names that are words of the format, capitals; pieces do not show."""
    monkeypatch.setattr("dmc_cli.mesh_io.stl.TEXT_CHUNK", chunk)
    facets = [FACETS.format(x) for x in (2, 3, 4)]
    texts = {
        "regular": f"solid a vertex 1 2\n{facets[0]}{facets[1]}endsolid a\nsolid\n{facets[2]}endsolid z\n",
        "capitals": "solid\n" + "".join(facets).upper() + "ENDSOLID",
        "no loops": "solid\n" + "".join(facets).replace("    outer loop\n", "") + "endsolid\n",
    }
    for name, text in texts.items():
        (tmp_path / "a.stl").write_text(text)
        found = read_mesh(tmp_path / "a.stl")
        corners = found.points[found.faces[:, :3]].tolist()
        assert corners == [[[x, 0, 0], [1, x, -0.5], [1, 1, x]] for x in (2, 3, 4)], name


@pytest.mark.parametrize("word", ["corner", "vertex nan", "vertex 1"])
def test_a_text_of_triangles_with_a_word_too_many_or_none_is_refused(tmp_path, word):
    text = "solid\n" + FACETS.format(2) * 3 + "endsolid\n"
    place = text.rindex("vertex")
    (tmp_path / "a.stl").write_text(text[:place] + word + text[place + 6 :])
    with pytest.raises(MeshFileError):
        read_mesh(tmp_path / "a.stl")
