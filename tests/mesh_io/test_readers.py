"""Mesh files: what other programs write is read, what is damaged is refused."""

import contextlib

import meshio
import numpy as np
import pytest
import trimesh
from hypothesis import given, strategies as st

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io import numbers, obj
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.obj import encode_obj
from dmc_cli.mesh_io.off import encode_off
from dmc_cli.mesh_io.ply import encode_ply
from dmc_cli.mesh_io.read import read_mesh
from tests import shapes
from tests.cases import case

ENCODERS = {
    "binary.ply": (encode_ply, False),
    "text.ply": (encode_ply, True),
    "mesh.obj": (encode_obj, True),
    "mesh.off": (encode_off, True),
}


@pytest.mark.parametrize("name", ENCODERS)
@pytest.mark.parametrize("with_normals", [False, True])
def test_our_own_files_read_back(tmp_path, name, with_normals):
    points, quads = shapes.torus(9, 7)
    points = points.astype(np.float32)
    encode, ascii = ENCODERS[name]
    mesh = MeshFile(points=points, faces=quads, normals=points if with_normals else None, space="LPS")
    (tmp_path / name).write_bytes(b"".join(encode(mesh, ascii=ascii)))
    found = read_mesh(tmp_path / name)
    assert np.array_equal(found.points.astype(np.float32), points)
    assert np.array_equal(found.faces, quads)
    assert found.space in ("LPS", "none") if name.endswith("off") else found.space == "LPS"
    assert found.triangle_count == 0


@pytest.mark.parametrize("suffix", ["ply", "obj", "vtk", "vtu", "off", "stl"])
def test_meshios_triangles_are_read(tmp_path, suffix):
    points, faces = shapes.tetrahedron()
    meshio.Mesh(points, [("triangle", faces[:, :3])]).write(tmp_path / f"mesh.{suffix}")
    found = read_mesh(tmp_path / f"mesh.{suffix}")
    assert np.allclose(found.points[found.faces[:, :3]], points[faces[:, :3]])
    assert (found.faces[:, 3] == -1).all()


@pytest.mark.parametrize("suffix", ["ply", "vtk", "vtu"])
def test_meshios_mixed_meshes_are_read(tmp_path, suffix):
    points, faces = shapes.house()
    is_quad = faces[:, 3] >= 0
    meshio.Mesh(points, [("quad", faces[is_quad]), ("triangle", faces[~is_quad, :3])]).write(
        tmp_path / f"m.{suffix}"
    )
    found = read_mesh(tmp_path / f"m.{suffix}")
    assert {tuple(f) for f in found.faces.tolist()} == {tuple(f) for f in faces.tolist()}
    assert found.triangle_count == 4


@pytest.mark.parametrize("suffix", ["ply", "obj", "off"])
def test_trimeshs_files_are_read(tmp_path, suffix):
    mesh = trimesh.creation.icosphere(2)
    mesh.export(tmp_path / f"ball.{suffix}")
    found = read_mesh(tmp_path / f"ball.{suffix}")
    assert np.allclose(found.points, mesh.vertices, atol=1e-6)
    assert np.array_equal(found.faces[:, :3], mesh.faces)


def save(tmp_path, name, text):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_an_obj_of_any_style_is_read(tmp_path):
    text = """# any style
mtllib a.mtl
o thing
v 0 0 0 1.0
v 1 0 0 0.5 0.5 0.5
  v 1 1 0
vt 0 0
vn 0 0 1
f 1/1/1 2//1 3/1
v 0 1e0 0
usemtl x
f -4 -3 \\
 -2 -1
s off
l 1 2
f\t1 3 4
"""
    found = read_mesh(save(tmp_path, "a.obj", text.replace("\n", "\r\n")))
    assert found.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert found.faces.tolist() == [[0, 1, 2, -1], [0, 1, 2, 3], [0, 2, 3, -1]]


@pytest.mark.parametrize("piece", [1, 2, 5, 9, 17, 1 << 24])
def test_the_pieces_in_which_references_are_dropped_do_not_show(tmp_path, monkeypatch, piece):
    monkeypatch.setattr(obj, "CHUNK", piece)
    faces = np.random.default_rng(0).integers(0, 40, (30, 4))
    lines = [f"v {n} 0 0" for n in range(40)]
    for face in faces + 1:
        words = zip(face, ("/{0}", "//{0}", "/{0}/{0}", ""), strict=True)
        lines.append("f " + " ".join(f"{v}{reference.format(1234 + v)}" for v, reference in words))
    assert read_mesh(save(tmp_path, "a.obj", "\n".join(lines))).faces.tolist() == faces.tolist()


@pytest.mark.parametrize(("place", "space"), [(1015, "RAS"), (1016, "none")])
def test_the_space_of_an_obj_stands_in_its_first_kilobyte(tmp_path, place, space):
    text = "#".ljust(place, "x") + "SPACE=RAS\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n"
    assert read_mesh(save(tmp_path, "a.obj", text)).space == space


def test_words_of_which_some_are_no_numbers_are_refused(tmp_path, monkeypatch):
    """As they are where NumPy only warns of them."""
    monkeypatch.setattr(numbers, "parse_numbers", lambda path, text: np.zeros(8))
    with pytest.raises(MeshFileError, match="9 words were found, but 8 numbers in them"):
        read_mesh(save(tmp_path, "a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n"))


def test_negative_indices_count_from_the_last_vertex_so_far(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 5 5 5\nv 6 6 6\nf -3 -2 -1\n"
    assert read_mesh(save(tmp_path, "a.obj", text)).faces[:, :3].tolist() == [[0, 1, 2], [2, 3, 4]]


def test_three_cubes_that_count_from_their_own_vertices_are_read():
    found = read_mesh(case("measure_obj") / "three_cubes_negative.obj")
    assert (found.points.shape, found.faces.shape) == ((24, 3), (18, 4))
    corners = found.points[found.faces].astype(float)
    diagonals = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    areas = np.cross(*diagonals) / 2
    assert np.linalg.norm(areas, axis=1).sum() == 18
    assert (areas * corners.mean(axis=1)).sum() / 3 == 3


@pytest.mark.parametrize("head", ["OFF\n4 2 0\n", "OFF 4 2 0\n", "# hello\nOFF\n\n4 2 # counts\n"])
def test_an_off_with_comments_and_colours_is_read(tmp_path, head):
    text = head + "0 0 0\n1 0 0\n\n1 1 0 # corner\n0 1 0\n4 0 1 2 3 255 0 0\n3  0 1 2\n"
    found = read_mesh(save(tmp_path, "a.off", text))
    assert found.faces.tolist() == [[0, 1, 2, 3], [0, 1, 2, -1]]
    assert found.points[2].tolist() == [1, 1, 0]


PLY_HEAD = """ply
format {format} 1.0
comment SPACE=RAS
obj_info made by hand
element vertex 4
property uchar red
property double x
property double y
property double z
element edge 1
property int a
property int b
element face {faces}
property uchar flag
property list uchar uint vertex_index
property float weight
end_header
"""


def binary_ply(order, faces):
    vertices = np.array(
        [(7, i, i + 1, i + 2) for i in range(4)], dtype=[("r", "u1"), *((a, order + "f8") for a in "xyz")]
    )
    body = vertices.tobytes() + np.array([1, 2], dtype=order + "i4").tobytes()
    for face in faces:
        body += bytes([9, len(face)]) + np.array(face, dtype=order + "u4").tobytes()
        body += np.array([0.5], dtype=order + "f4").tobytes()
    name = "binary_little_endian" if order == "<" else "binary_big_endian"
    return PLY_HEAD.format(format=name, faces=len(faces)).encode() + body


def check_values(mesh):
    """What a file of `PLY_HEAD` brings beside points and corners."""
    assert {name: (v.dtype, v.tolist()) for name, v in mesh.vertex_values.items()} == {"red": ("u1", [7] * 4)}
    assert {name: (v.dtype, set(v.tolist()), len(v)) for name, v in mesh.face_values.items()} == {
        "flag": ("u1", {9}, len(mesh.faces)),
        "weight": ("f4", {0.5}, len(mesh.faces)),
    }


FACES = [[0, 1, 2], [0, 1, 2, 3], [3, 2, 1, 0], *[[1, 2, 3]] * 300, [0, 2, 3, 1]]


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_binary_ply_with_more_in_it_is_read(tmp_path, order):
    found = read_mesh(save(tmp_path, "a.ply", binary_ply(order, FACES)))
    assert found.faces.tolist() == [f if len(f) == 4 else [*f, -1] for f in FACES]
    assert found.points[1].tolist() == [1, 2, 3]
    assert found.space == "RAS"
    check_values(found)


def test_a_text_ply_with_more_in_it_is_read(tmp_path):
    lines = [f"7 {i} {i + 1} {i + 2}" for i in range(4)] + ["1 2"]
    lines += [f"9 {len(f)} {' '.join(map(str, f))} 0.5" for f in FACES]
    text = PLY_HEAD.format(format="ascii", faces=len(FACES)) + "\n".join(lines)
    found = read_mesh(save(tmp_path, "a.ply", text))
    assert found.faces.tolist() == [f if len(f) == 4 else [*f, -1] for f in FACES]
    assert found.points[3].tolist() == [3, 4, 5]
    check_values(found)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("order", ["<", ">", ""])
def test_faces_in_runs_of_any_length_are_read(tmp_path, order, seed):
    draws = np.random.default_rng(seed)
    lengths = draws.choice([1, 2, 63, 64, 65, 127, 128, 129, 200], 12)
    sizes = np.repeat(np.tile([3, 4], 6), lengths)
    faces = [draws.integers(0, 4, size).tolist() for size in sizes]
    if order:
        content = binary_ply(order, faces)
    else:
        lines = [f"7 {i} {i + 1} {i + 2}" for i in range(4)] + ["1 2"]
        lines += [f"9 {len(f)} {' '.join(map(str, f))} 0.5" for f in faces]
        content = PLY_HEAD.format(format="ascii", faces=len(faces)) + "\n".join(lines)
    found = read_mesh(save(tmp_path, "a.ply", content))
    assert found.faces.tolist() == [f if len(f) == 4 else [*f, -1] for f in faces]


def head(properties="x y z", vertices=1, faces=1):
    """The header of a PLY file in text."""
    lines = [f"element vertex {vertices}", *(f"property float {name}" for name in properties.split())]
    lines += [f"element face {faces}", "property list uchar int vertex_indices", "end_header", ""]
    return "\n".join(["ply", "format ascii 1.0", *lines])


@pytest.mark.parametrize("keep", [0, 2, 60, 200, -1, -7, -2000, -7000])
def test_a_ply_that_is_cut_off_is_refused(tmp_path, keep):
    data = binary_ply("<", FACES)
    with pytest.raises(MeshFileError, match=r"a\.ply: "):
        read_mesh(save(tmp_path, "a.ply", data[:keep]))


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        (
            "a.off",
            "OFF\n4 1 0\n0 0 0\n1 0 0\n",
            "2 lines were found after the counts; expected 4 vertices and 1",
        ),
        ("a.off", "OFX\n4 1 0\n", "the word OFF was expected"),
        ("a.off", "OFF\n1 1 0\n0 0\n3 0 0 0\n", "a vertex with fewer than 3 coordinates"),
        ("a.off", "OFF\n1 1 0\n0 0 0\n3 0 0\n", "a face with fewer corners"),
        ("a.off", "OFF\n", "the numbers of vertices and faces were expected"),
        ("a.off", "OFF\n1 1 0\n0 x 0\n3 0 0 0\n", "'x' was found where a number was expected"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 4\n", "a face names vertex 3; expected 0 to 2"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 0 1 2\n", "a face names vertex -1; expected 0 to 2"),
        (
            "a.obj",
            "v 0 0 0\nv 1 0 nan\nv 1 1 0\nf 1 2 3\n",
            "vertex 1 is at .*nan.*; expected finite numbers",
        ),
        (
            "a.off",
            "OFF\n3 1 0\n0 0 0\n1 0 0\n0 -1e39 0\n3 0 1 2\n",
            r"vertex 2 is at \[0.0, -1e\+39, 0.0\]; expected finite numbers up to 3.4e\+38",
        ),
        ("a.obj", "v 0 0 0\nv 1 0\nv 1 1 0\nf 1 2 3\n", "a vertex with fewer than 3 coordinates"),
        ("a.obj", "v 0 0 0\n", "1 vertices and no faces were found"),
        ("a.obj", "", "0 vertices and no faces were found"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
            "no property y",
        ),
        ("a.ply", "ply\nformat ascii 2.0\nend_header\n", "the header has the line 'format ascii 2.0'"),
        ("a.ply", "ply\nproperty int x\nend_header\n", "the header has the line 'property int x'"),
        ("a.ply", "ply\nend_header\n", "the header names no format"),
        ("a.ply", "ply\nend_header", "a header from ply to end_header was expected; this is no PLY file"),
        ("a.ply", "ply\nformat ascii 1.0\n", "a header from ply to end_header was expected"),
        ("a.ply", "x\nformat ascii 1.0\nend_header\n", "a header from ply to end_header was expected"),
        ("a.ply", "ply\nformat ascii 1.0\nend_header\n", "no element vertex was found"),
        ("a.off", "OFF\n-1 1 0\n0 0 0\n3 0 0 0\n", "-1 vertices and 1 faces were announced"),
        ("a.off", "OFF\n1 -1 0\n0 0 0\n3 0 0 0\n", "1 vertices and -1 faces were announced"),
        ("a.off", "OFF\nnan 1 0\n0 0 0\n3 0 0 0\n", "nan was found where a whole number"),
        ("a.off", "OFF\n1 1 0\n0 0 0\n-3 0 0 0\n", "a face with fewer corners"),
        ("a.off", "OFF\n1 1 0\n0 0 0\n3 0 0.5 0\n", "0.5 was found where a whole number"),
        ("a.obj", "v 0 0 0\nf 1 nan 1\n", "nan was found where a whole number"),
        ("a.obj", "v 0 0 0\nf 1 1e300 1\n", r"1e\+300 was found where a whole number"),
        ("a.ply", head(vertices=-1) + "0 0 0 3 0 0 0", "the line 'element vertex -1'"),
        ("a.ply", head(properties="x x y z"), "the element vertex has 2 properties called x; expected one"),
        ("a.ply", head(properties="") + "3 0 0 0", "the vertices have no property x"),
        ("a.ply", head() + "0 0 0 3 0 0.5 0", "0.5 was found where a whole number"),
        ("a.ply", head() + "0 0 0 3 0 nan 0", "nan was found where a whole number"),
        ("a.ply", head() + "0 0 0 2.5 0 0 0", "the file ends within the element face"),
        ("a.ply", head(faces=2) + "0 0 0 3 0 0 0 nan 0 0 0", "the file ends within the element face"),
        ("a.ply", head(faces=2) + "0 0 0 3 0 0 0 3.5 0 0 0", "the file ends within the element face"),
        ("a.stl", "solid nothing", "meshio cannot read it|no faces were found"),
    ],
)
def test_a_damaged_file_is_refused_with_what_was_found(tmp_path, name, text, found):
    with pytest.raises(MeshFileError, match=found):
        read_mesh(save(tmp_path, name, text))


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 2 2 2\nv 3 3 3\nf 1 2 3 4 5\n", "face 0 has 5 corners"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n", "face 0 has 2 corners"),
        ("a.off", "4OFF\n1 1 0\n", "only three-dimensional text OFF"),
        ("a.off", "OFF BINARY\n", "only three-dimensional text OFF"),
        ("a.xyz123", "", r"no reader for \.xyz123"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
            "element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n"
            "end_header\n",
            "has the lists vertex_indices, texcoord; expected one",
        ),
    ],
)
def test_an_unsupported_file_is_refused(tmp_path, name, text, found):
    with pytest.raises(UnsupportedFormatError, match=found):
        read_mesh(save(tmp_path, name, text))


@pytest.mark.parametrize("name", ENCODERS)
def test_the_largest_float32_is_read_again(tmp_path, name):
    """Its shortest decimal is a larger double."""
    points = np.full((4, 3), np.finfo(np.float32).max, np.float32)
    encode, ascii = ENCODERS[name]
    mesh = MeshFile(points=points, faces=np.array([[0, 1, 2, 3]], np.int32))
    (tmp_path / name).write_bytes(b"".join(encode(mesh, ascii=ascii)))
    assert np.array_equal(read_mesh(tmp_path / name).points.astype(np.float32), points)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(MeshFileError, match=r"nowhere\.ply: no such file"):
        read_mesh(tmp_path / "nowhere.ply")


@pytest.mark.parametrize("name", ["x", "nx", "other"])
def test_a_number_that_signals_is_no_warning(tmp_path, name):
    """A float32 NaN of which a processor tells once it is made a double."""
    points = np.eye(3, dtype="<f4")
    names = ("x", "y", "z", "nx", "ny", "nz", "other")
    rows = np.zeros(3, [(each, "<u4") for each in names])
    for axis, column in zip("xyz", points.T, strict=True):
        rows[axis] = column.view("<u4")
    rows[name][1] = 0x7F800001
    text = head(properties=" ".join(names), vertices=3).replace("ascii", "binary_little_endian")
    data = text.encode() + rows.tobytes() + b"\3" + np.arange(3, dtype="<i4").tobytes()
    path = save(tmp_path, "a.ply", data)
    if name == "x":
        with pytest.raises(MeshFileError, match="vertex 1 is at"):
            read_mesh(path)
    else:
        assert np.isnan(read_mesh(path).vertex_values[name][1])


def test_an_element_without_properties_takes_no_room(tmp_path):
    text = head().replace("element face", "element nothing 99\nelement face")
    assert len(read_mesh(save(tmp_path, "a.ply", text + "0 0 0 3 0 0 0")).faces) == 1


def test_faces_without_corners_are_none(tmp_path):
    text = head().replace("list uchar int vertex_indices", "uchar flags")
    with pytest.raises(MeshFileError, match="1 vertices and no faces were found"):
        read_mesh(save(tmp_path, "a.ply", text + "0 0 0 7"))


@given(st.binary(max_size=300))
def test_garbage_gives_a_message_or_a_mesh(tmp_path_factory, garbage):
    folder = tmp_path_factory.mktemp("garbage")
    head = PLY_HEAD.format(format="binary_little_endian", faces=3).encode()
    for name, text in (("a.ply", head + garbage), ("a.obj", garbage), ("a.off", b"OFF\n" + garbage)):
        with contextlib.suppress(MeshFileError, UnsupportedFormatError):
            read_mesh(save(folder, name, text))


def codes(mesh):
    return [notice.code for notice in mesh.warnings]


def test_what_an_obj_file_holds_besides_is_told(tmp_path):
    path = tmp_path / "a.obj"
    plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    path.write_text(plain + "g part\no object\nusemtl m\ns off\n")
    assert codes(read_mesh(path)) == []
    path.write_text("vn 0 0 1\nvt 0 0\n" + plain + "l 1 2\np 3\n")
    mesh = read_mesh(path)
    assert codes(mesh) == ["W-MESH-UNREAD"]
    assert mesh.warnings[0].sentence == (
        "a.obj: not read and not used: normals, texture coordinates, lines, points"
    )


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", None),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n", "colours"),
        ("NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n", "normals"),
        ("COFF\n3 1 0\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n0 1 0 1 1 1 1\n3 0 1 2\n", "colours"),
    ],
)
def test_what_an_off_file_holds_besides_is_told(tmp_path, text, told):
    path = tmp_path / "a.off"
    path.write_text(text)
    assert [notice.sentence for notice in read_mesh(path).warnings] == (
        [] if told is None else [f"a.off: not read and not used: {told}"]
    )


def test_what_meshio_reads_besides_is_told(tmp_path):
    path = tmp_path / "a.vtu"
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    cells = [("triangle", [[0, 1, 2]]), ("line", [[0, 3], [1, 3]]), ("tetra", [[0, 1, 2, 3]])]
    meshio.Mesh(points, cells, point_data={"depth": points[:, 0]}).write(path)
    mesh = read_mesh(path)
    assert (len(mesh.faces), codes(mesh)) == (1, ["W-MESH-UNREAD"])
    for part in ("2 cells of line", "1 cells of tetra", "values depth"):
        assert part in mesh.warnings[0].sentence
    meshio.Mesh(points, cells[:1]).write(path)
    assert codes(read_mesh(path)) == []


@pytest.mark.parametrize(("kind", "corners"), [("polygon", 5), ("triangle6", 6), ("quad8", 8)])
def test_faces_that_meshio_reads_and_no_mesh_has_are_refused(tmp_path, kind, corners):
    """Else the mesh had holes in their places."""
    path = tmp_path / "a.vtu"
    points = np.random.default_rng(0).random((8, 3))
    cells = [("triangle", [[0, 1, 2]]), (kind, [[*range(corners)]])]
    meshio.Mesh(points, cells).write(path)
    with pytest.raises(
        UnsupportedFormatError, match=rf"1 faces of the kind {kind}.*expected triangles and quads"
    ):
        read_mesh(path)
