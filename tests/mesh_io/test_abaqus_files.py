"""Input files of Abaqus that others write: parts, instances, files in files, numbers in any order."""

from dataclasses import replace

import numpy as np
import pytest

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.abaqus.kinds import kind_of
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from tests.mesh_io.ply_files import save

NODES = "*NODE\n7, 0, 0, 0\n2, 1, 0, 0\n30, 1, 1, 0\n4, 0, 1, 0\n"
QUAD, TRIANGLE = "*ELEMENT, TYPE=S4R\n1, 7, 2, 30, 4\n", "*ELEMENT, TYPE=S3\n2, 30, 4, 7\n"
WHOLE = NODES + QUAD + TRIANGLE
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
PART = f"*Part, name=One\n{WHOLE}*End Part\n"


@pytest.mark.parametrize("element", ["S4R", "S4", "M3D4", "SFM3D4", "R3D4"])
def test_all_elements_that_are_written_come_back(tmp_path, cube, element):
    faces = cube.faces.copy()
    faces[0, 3] = -1
    path = tmp_path / "a.inp"
    write_mesh(str(path), replace(cube, faces=faces, normals=None), element=element)
    mesh = read_mesh(path)
    assert mesh.faces.tolist() == [*faces[1:].tolist(), faces[0].tolist()]
    np.testing.assert_array_equal(mesh.points.astype(np.float32), cube.points)
    assert mesh.space == cube.space


@pytest.mark.parametrize(
    "text",
    [
        WHOLE,
        WHOLE.replace("\n", "\r\n").lower(),
        "*HEADING\nany words\n** a comment\n" + WHOLE.replace("7, 0, 0, 0", " 7 , 0.D0, 0., ,0,0,1")
        .replace("0\n", "0,0,0,1\n"),
        WHOLE.replace("S4R\n", "S4R,\n  ELSET=a\n").replace("7, 2, 30, 4\n", "7, 2,\n 30, 4,\n"),
        NODES.replace("1, 1, 0\n", "1, 1, 0\n** between\n\n*NODE, NSET=b\n") + QUAD + TRIANGLE,
        PART,
        PART + "*Assembly, name=a\n*Instance, name=One-1, part=ONE\n*End Instance\n*End Assembly\n",
        WHOLE.replace(", 0\n", "\n"),
    ],
    ids=["plain", "small", "spaced", "continued", "blocks", "part", "instance", "plane"],
)  # fmt: skip
def test_all_ways_to_write_a_mesh_give_the_same(tmp_path, text):
    mesh = read_mesh(save(tmp_path, "a.inp", text))
    assert mesh.points.tolist() == SQUARE
    assert mesh.faces.tolist() == [[0, 1, 2, 3], [2, 3, 0, -1]]
    assert mesh.warnings == ()


def test_instances_are_moved_and_then_turned(tmp_path):
    text = (
        f"{PART}*Part, name=unused\n*Node\n1, 9, 9, 9\n*End Part\n*Assembly, name=a\n"
        "*Instance, name=a, part=One\n*End Instance\n"
        "*Instance, name=b, part=One\n10, 0, 0\n10, 0, 0, 10, 0, 5, 90\n*End Instance\n*End Assembly\n"
    )
    mesh = read_mesh(save(tmp_path, "a.inp", text))
    turned = [[10, 0, 0], [10, 1, 0], [9, 1, 0], [9, 0, 0]]
    np.testing.assert_allclose(mesh.points, SQUARE + turned, atol=1e-14)
    assert mesh.faces.tolist() == [[0, 1, 2, 3], [2, 3, 0, -1], [4, 5, 6, 7], [6, 7, 4, -1]]


def test_parts_number_their_nodes_for_themselves(tmp_path):
    moved = PART.replace("One", "Two").replace("7, 0, 0, 0", "7, 0, 0, 9")
    mesh = read_mesh(save(tmp_path, "a.inp", PART + moved))
    assert mesh.points.tolist() == [*SQUARE, [0, 0, 9], *SQUARE[1:]]
    assert mesh.faces[2].tolist() == [4, 5, 6, 7]


def test_files_that_a_file_names_are_read(tmp_path):
    (tmp_path / "nodes.txt").write_text(NODES.partition("\n")[2])
    (tmp_path / "quads.inp").write_text(QUAD)
    text = f"*NODE, INPUT=nodes.txt\n*INCLUDE, INPUT=quads.inp\n{TRIANGLE}"
    assert read_mesh(save(tmp_path, "a.inp", text)).points.tolist() == SQUARE
    with pytest.raises(MeshFileError, match=r"a\.inp: the file 'none' that it names cannot be read"):
        read_mesh(save(tmp_path, "a.inp", "*INCLUDE, INPUT=none\n"))
    with pytest.raises(MeshFileError, match="more than 10 files include each other"):
        read_mesh(save(tmp_path, "a.inp", "*INCLUDE, INPUT=a.inp\n"))


def test_other_elements_are_told(tmp_path):
    text = (
        WHOLE
        + "*ELEMENT, TYPE=B31\n8, 7, 2\n9, 2, 30\n*ELEMENT, TYPE=S4\n*ELEMENT, TYPE=C3D20\n5, 1,\n2, 3\n"
    )
    mesh = read_mesh(save(tmp_path, "a.inp", text))
    assert mesh.warnings[0].sentence == "a.inp: not read and not used: 2 cells of B31, 1 cells of C3D20"
    assert len(mesh.faces) == 2


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("S3", "triangle"), ("S3RS", "triangle"), ("STRI3", "triangle"), ("CPS3", "triangle"),
        ("S4R5", "quad"), ("CPE4RH", "quad"), ("CAX4P", "quad"), ("DC2D4", "quad"), ("M3D4R", "quad"),
        ("STRI65", "triangle6"), ("CPS6M", "triangle6"), ("S8R5", "quad8"), ("S9R5", "quad9"),
        ("C3D4", "C3D4"), ("B31", "B31"), ("C3D8R", "C3D8R"), ("T3D3", "T3D3"), ("SC8R", "SC8R"),
    ],
)  # fmt: skip
def test_elements_are_told_by_their_names(name, kind):
    assert kind_of(name) == kind


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("solid", "'solid' was found where a keyword"),
        (WHOLE.replace("2, 1, 0, 0", "2, 1, 0"), r"nodes with \[3, 4\] numbers"),
        (WHOLE.replace("2, 1, 0, 0", "2, 1, x, 0"), "'x' was found where a number"),
        (WHOLE.replace("2, 1, 0, 0", "2, 1, 1e39, 0"), "vertex 1 is at"),
        (WHOLE.replace("2, 1, 0, 0", "2.5, 1, 0, 0"), "2.5 was found where a whole number"),
        (WHOLE.replace("2, 1, 0, 0", "30, 1, 0, 0"), "there are two nodes 30"),
        (WHOLE.replace("2, 30, 4, 7", "2, 30, 4, 8"), "an element names the node 8"),
        (WHOLE.replace("2, 30, 4, 7", "1, 30, 4, 7"), "two elements of a part have one number"),
        (WHOLE.replace("2, 30, 4, 7", "2, 30, 4"), "a triangle of 3 numbers was found; expected its own and"),
        (WHOLE.replace(", TYPE=S3", ""), r"\*ELEMENT without a TYPE"),
        (PART + "*Instance, part=Two\n", "an instance of the part TWO was found, which is none"),
        (PART + "*Instance, part=One\n1, 2\n", r"an instance with \[2\] numbers"),
        (PART + "*Instance, part=One\n0,0,0\n1,1,1,1,1,1,90\n", r"an instance with \[3, 7\] numbers"),
        (PART + "*Instance, part=One\n0,0,1e39\n", "vertex 0 is at"),
        (NODES + "*ELEMENT, TYPE=S4", "4 vertices and no faces were found"),
    ],
)  # fmt: skip
def test_what_is_damaged_is_refused(tmp_path, text, told):
    with pytest.raises(MeshFileError, match=rf"a\.inp: .*{told}"):
        read_mesh(save(tmp_path, "a.inp", text))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (WHOLE + "*ELEMENT, TYPE=S8R\n9, 1, 2, 3, 4, 5, 6, 7, 8\n", "1 faces of the kind quad8"),
        (WHOLE + "*NGEN\n1, 5, 1\n", r"\*NGEN was found"),
        (WHOLE.replace("*NODE", "*NODE, SYSTEM=C"), "in another system"),
    ],
)
def test_what_is_not_read_is_named(tmp_path, text, told):
    with pytest.raises(UnsupportedFormatError, match=told):
        read_mesh(save(tmp_path, "a.inp", text))
