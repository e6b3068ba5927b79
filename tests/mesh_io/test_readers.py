"""Mesh files: what other programs write is read."""

import meshio
import numpy as np
import pytest
import trimesh

from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io import numbers, obj
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.obj import encode_obj
from dmc_cli.mesh_io.off import encode_off
from dmc_cli.mesh_io.ply import encode_ply
from dmc_cli.mesh_io.read import read_mesh
from tests import shapes
from tests.cases import case
from tests.mesh_io.ply_files import FACES, PLY_HEAD, binary_ply, head, save

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


def check_values(mesh):
    """What a file of `PLY_HEAD` brings beside points and corners."""
    assert {name: (v.dtype, v.tolist()) for name, v in mesh.vertex_values.items()} == {"red": ("u1", [7] * 4)}
    assert {name: (v.dtype, set(v.tolist()), len(v)) for name, v in mesh.face_values.items()} == {
        "flag": ("u1", {9}, len(mesh.faces)),
        "weight": ("f4", {0.5}, len(mesh.faces)),
    }


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


@pytest.mark.parametrize("name", ENCODERS)
def test_the_largest_float32_is_read_again(tmp_path, name):
    """Its shortest decimal is a larger double."""
    points = np.full((4, 3), np.finfo(np.float32).max, np.float32)
    encode, ascii = ENCODERS[name]
    mesh = MeshFile(points=points, faces=np.array([[0, 1, 2, 3]], np.int32))
    (tmp_path / name).write_bytes(b"".join(encode(mesh, ascii=ascii)))
    assert np.array_equal(read_mesh(tmp_path / name).points.astype(np.float32), points)


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
