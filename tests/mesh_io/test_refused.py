"""Mesh files that are damaged, or of a kind that is not read, are refused in words."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.freesurfer import IN_RAS, encode_freesurfer
from dmc_cli.mesh_io.gifti import encode_gifti
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from tests.mesh_io.ply_files import FACES, PLY_HEAD, binary_ply, head, save


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


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(MeshFileError, match=r"nowhere\.ply: no such file"):
        read_mesh(tmp_path / "nowhere.ply")


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


def test_what_meshio_says_stands_in_the_message_alone(tmp_path, capfd):
    with pytest.raises(
        MeshFileError, match=r"a\.mesh: meshio cannot read it: Expected `MeshVersionFormatted`"
    ):
        read_mesh(save(tmp_path, "a.mesh", "Dimension 3\nVertices\n1\n0 0 0 0\n"))
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("axis", ["xras", "yras"])
def test_a_volume_of_freesurfer_with_an_axis_cut_off_is_told(tmp_path, axis):
    mesh = MeshFile(points=np.eye(3, dtype=np.float32), faces=np.int32([[0, 1, 2, -1]]), space="RAS")
    data = b"".join(encode_freesurfer(mesh)).replace(f"{axis}   =".encode(), f"{axis} \n=".encode())
    (tmp_path / "a.pial").write_bytes(data)
    mesh = read_mesh(tmp_path / "a.pial")
    assert mesh.space == "none"
    assert "the volume that its coordinates are relative to" in mesh.warnings[0].sentence


@pytest.mark.parametrize(("number", "count"), [("256", 0), ("x", 1), ("nan", 1)])
def test_a_volume_of_gifti_that_cannot_be_is_told(tmp_path, number, count):
    mesh = MeshFile(
        points=np.eye(3, dtype=np.float32),
        faces=np.int32([[0, 1, 2, -1]]),
        space="RAS",
        geometry=replace(IN_RAS, centre=np.array([1.0, 2.0, 3.0])),
    )
    text = b"".join(encode_gifti(mesh)).replace(b"CDATA[256]", f"CDATA[{number}]".encode())
    (tmp_path / "a.gii").write_bytes(text)
    found = read_mesh(tmp_path / "a.gii")
    assert len(found.warnings) == count
    assert found.space == ("none" if count else "RAS")


@pytest.mark.parametrize("number", [np.inf, -np.inf, np.nan])
@pytest.mark.parametrize(("suffix", "order"), [("pial", ">"), ("stl", "<"), ("glb", "<"), ("ply", "<")])
def test_a_coordinate_that_is_no_number_is_refused_without_a_warning(tmp_path, suffix, order, number):
    """Matrices that put a file into a space meet it first."""
    points = np.eye(3, dtype=np.float32)
    points[1, 1] = 1234.5
    path = tmp_path / f"a.{suffix}"
    write_mesh(str(path), MeshFile(points=points, faces=np.int32([[0, 1, 2, -1]]), space="RAS"))
    before, after = (np.array(value, f"{order}f4").tobytes() for value in (1234.5, number))
    assert before in path.read_bytes()
    path.write_bytes(path.read_bytes().replace(before, after))
    with pytest.raises(MeshFileError, match=r"vertex \d is at"):
        read_mesh(path)


@pytest.mark.parametrize(
    ("card", "told"),
    [
        ("GRID,1,7,0.,0.,0.\n", "7"),
        ("GRID    1       7       0.      0.      0.\n", "7"),
        ("GRID*   1               7               0.              0.\n*       0.\n", "7"),
    ],
)
def test_nodes_of_nastran_in_another_system_are_refused(tmp_path, card, told):
    others = "GRID,2,,1.,0.,0.\nGRID,3,0,0.,1.,0.\nCTRIA3,1,1,1,2,3\nENDDATA\n"
    with pytest.raises(UnsupportedFormatError, match=f"in the system of coordinates {told} were found"):
        read_mesh(save(tmp_path, "a.nas", f"BEGIN BULK\n{card}{others}"))
    basic = card.replace("7", " ")
    assert len(read_mesh(save(tmp_path, "b.nas", f"BEGIN BULK\n{basic}{others}")).faces) == 1


def test_two_nodes_of_one_number_are_refused(tmp_path):
    text = "*KEYWORD\n*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n{}*ELEMENT_SHELL\n1,1,1,2,3,3\n*END\n"
    assert len(read_mesh(save(tmp_path, "a.k", text.format(""))).faces) == 1
    with pytest.raises(MeshFileError, match=r"b\.k: there are two nodes 2; expected numbers of their own"):
        read_mesh(save(tmp_path, "b.k", text.format("2,5,5,5\n")))


def test_a_reader_that_would_not_end_is_not_called(tmp_path):
    cut_off = "Begin Nodes\n1 0.0 0.0 0.0\n"
    with pytest.raises(UnsupportedFormatError, match="does not end where a file is cut off"):
        read_mesh(save(tmp_path, "a.mdpa", cut_off))
