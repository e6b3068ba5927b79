"""Files of Gmsh that others write: all versions, numbers in any order, and counts that cannot be."""

import meshio
import numpy as np
import pytest

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_io.read import read_mesh
from tests import shapes
from tests.mesh_io.ply_files import save

HEAD = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
NODES = "$Nodes\n1 4 5 40\n2 1 0 4\n30\n5\n40\n7\n1 0 0\n0 0 0\n1 1 0\n0 1 0\n$EndNodes\n"
ELEMENTS = "$Elements\n2 2 1 9\n2 1 3 1\n9 5 30 40 7\n2 1 2 1\n4 5 30 7\n$EndElements\n"
WHOLE = HEAD + NODES + ELEMENTS
OLD = (
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n30 1 0 0\n5 0 0 0\n40 1 1 0\n7 0 1 0\n$EndNodes\n"
    "$Elements\n3\n1 15 2 0 1 5\n9 3 2 0 1 5 30 40 7\n4 2 3 0 1 6 5 30 7\n$EndElements\n"
)
QUAD, TRIANGLE = [1, 0, 2, 3], [1, 0, 3, -1]


def data(name, title, width, *rows):
    lines = "".join(f"{row}\n" for row in rows)
    return f'${name}\n1\n"{title}"\n1\n0.5\n3\n0\n{width}\n{len(rows)}\n{lines}$End{name}\n'


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("version", ["2.2", "4.0", "4.1"])
def test_all_versions_of_meshio_are_read(tmp_path, version, binary):
    points, faces = shapes.house()
    is_quad = faces[:, 3] >= 0
    cells = [("quad", faces[is_quad]), ("triangle", faces[~is_quad, :3]), ("line", [[0, 1], [1, 2]])]
    values = {"height": points[:, 2].copy()} if binary else {}  # as text meshio writes "np.float64(0.0)"
    tags = {
        name: [np.full(len(rows), number) for number, (_, rows) in enumerate(cells, 1)]
        for name in ("gmsh:physical", "gmsh:geometrical")
    }
    mesh = meshio.Mesh(points, cells, point_data=dict(values), cell_data=tags)
    if (version, binary) == ("4.0", False):
        mesh.cell_data = {}
    if version == "4.1":
        mesh.point_data["gmsh:dim_tags"] = np.tile([2, 1], (len(points), 1))
    meshio.gmsh.write(tmp_path / "a.msh", mesh, version, binary=binary)
    found = read_mesh(tmp_path / "a.msh")
    np.testing.assert_array_equal(found.points, points)
    np.testing.assert_array_equal(found.faces, np.concatenate([faces[is_quad], faces[~is_quad]]))
    assert {name: array.tolist() for name, array in found.vertex_values.items()} == {
        name: array.tolist() for name, array in values.items()
    }
    assert [notice.sentence for notice in found.warnings] == ["a.msh: not read and not used: 2 cells of line"]


@pytest.mark.parametrize(("text", "told"), [(WHOLE, 0), (OLD, 1), (WHOLE.replace("\n", "\r\n"), 0)])
def test_numbers_may_come_in_any_order(tmp_path, text, told):
    mesh = read_mesh(save(tmp_path, "a.msh", text))
    assert mesh.faces.tolist() == [QUAD, TRIANGLE]
    assert mesh.points.tolist() == [[1, 0, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert len(mesh.warnings) == told


def test_values_go_to_the_nodes_and_elements_that_they_name(tmp_path):
    values = (
        data("NodeData", "depth", 1, "5 0.5", "7 0.7", "30 3", "40 4")
        + data("NodeData", "flow", 3, *(f"{number} {number} 0 1" for number in (40, 7, 5, 30)))
        + data("ElementData", "area", 1, "4 0.25", "9 1.5")
    )
    mesh = read_mesh(save(tmp_path, "a.msh", WHOLE + values))
    assert mesh.vertex_values["depth"].tolist() == [3, 0.5, 4, 0.7]
    assert mesh.vertex_values["flow"].tolist() == [[30, 0, 1], [5, 0, 1], [40, 0, 1], [7, 0, 1]]
    assert mesh.face_values["area"].tolist() == [1.5, 0.25]
    assert mesh.warnings == ()


def test_values_of_some_nodes_and_of_other_times_are_told(tmp_path):
    values = data("NodeData", "depth", 1, "5 0.5", "7 0.7") + 2 * data("ElementData", "area", 1, "4 1", "9 2")
    mesh = read_mesh(save(tmp_path, "a.msh", WHOLE + values + "$Periodic\n0\n$EndPeriodic\n"))
    assert mesh.vertex_values == {}
    assert mesh.face_values["area"].tolist() == [2, 1]
    assert mesh.warnings[0].sentence == (
        "a.msh: not read and not used: values depth of some parts, values area of other times, $Periodic"
    )


@pytest.mark.parametrize(
    ("dimension", "places"),
    [(2, "1 0 0 .5 .5\n0 0 0 0 0\n1 1 0 1 1\n0 1 0 0 1"), (1, "1 0 0 2\n0 0 0 2\n1 1 0 2\n0 1 0 2")],
)
def test_parameters_of_nodes_are_passed_over(tmp_path, dimension, places):
    nodes = f"$Nodes\n1 4 5 40\n{dimension} 1 1 4\n30 5 40 7\n{places}\n$EndNodes\n"
    mesh = read_mesh(save(tmp_path, "a.msh", HEAD + nodes + ELEMENTS))
    assert mesh.points.tolist() == [[1, 0, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]]


def test_the_order_of_bytes_and_short_counts_are_read(tmp_path):
    def numbers(kind, *values):
        return np.array(values, kind).tobytes()

    blocks = [
        b"$MeshFormat\n4.1 1 4\n" + numbers(">i4", 1) + b"\n$EndMeshFormat\n$Nodes\n",
        numbers(">u4", 1, 3, 1, 3) + numbers(">i4", 2, 1, 0) + numbers(">u4", 3, 1, 2, 3),
        numbers(">f8", 0, 0, 0, 1, 0, 0, 0, 1, 0) + b"\n$EndNodes\n$Elements\n",
        numbers(">u4", 1, 1, 1, 1) + numbers(">i4", 2, 1, 2) + numbers(">u4", 1, 7, 1, 2, 3),
        b"\n$EndElements\n",
    ]
    (tmp_path / "a.msh").write_bytes(b"".join(blocks))
    mesh = read_mesh(tmp_path / "a.msh")
    assert mesh.faces.tolist() == [[0, 1, 2, -1]]
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


HUGE = 10**15


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", r"0 sections \$MeshFormat were found"),
        ("$NOD\n$ENDNOD\n", r"the section \$NOD has no end"),
        ("x", "'x' was found where a section was expected"),
        (WHOLE.replace("4.1 0 8", "4.1 0 9"), "the format is given as '4.1 0 9'"),
        (WHOLE.replace("4.1 0", "4.1 1"), "was found where the number 1 was expected"),
        (WHOLE[:-20], r"the section \$Elements has no end"),
        (HEAD + ELEMENTS, r"0 sections \$Nodes were found"),
        (WHOLE + NODES, r"2 sections \$Nodes were found"),
        (WHOLE.replace("1 4 5 40", f"1 {HUGE} 5 40"), f"4 nodes were found; expected {HUGE}"),
        (WHOLE.replace("1 4 5 40", f"{HUGE} 4 5 40"), r"\$Nodes is damaged: more is announced"),
        (WHOLE.replace("2 1 0 4", f"2 1 0 {HUGE}"), r"\$Nodes is damaged: more is announced"),
        (WHOLE.replace("2 1 0 4", "2 1 0 -4"), r"\$Nodes is damaged: more is announced, -4"),
        (WHOLE.replace("2 1 0 4", "9 1 1 4"), "a dimension of 9 was found"),
        (WHOLE.replace("2 1 0 4", "2 1 0 3"), r"\$Nodes is damaged"),
        (WHOLE.replace("0 1 0\n$End", "0 1 0 7\n$End"), "it holds more than it announces"),
        (WHOLE.replace("30\n5\n40", f"30\n5\n{HUGE}"), "an element names the node 40"),
        (WHOLE.replace("9 5 30 40 7", "9 0 30 40 7"), "an element names the node 0"),
        (WHOLE.replace("30\n5\n40", "30\n5\n30"), "there are two nodes 30"),
        (WHOLE.replace("30\n5\n40", "30\n5.5\n40"), "5.5 was found where a whole number"),
        (WHOLE.replace("$Elements\n2 2", f"$Elements\n{HUGE} 2"), r"\$Elements is damaged: more is"),
        (WHOLE.replace("$Elements\n2 2", "$Elements\n2 3"), "2 elements were found; expected 3"),
        (WHOLE.replace("2 1 2 1\n", f"2 1 2 {HUGE}\n"), r"\$Elements is damaged: more is announced"),
        (WHOLE + data("NodeData", "a", HUGE), "the sizes .* were found"),
        (WHOLE + data("NodeData", "a", 1).replace("\n1\n0\n", f"\n1\n{HUGE}\n"), "more is announced"),
        (WHOLE + f"$NodeData\n{HUGE}\n$EndNodeData\n", "it ends early"),
        (WHOLE + f"$NodeData\n{'9' * 9999}\n$EndNodeData\n", "where a number was expected"),
        (OLD.replace("$Nodes\n4", f"$Nodes\n{HUGE}"), r"\$Nodes is damaged: more is announced"),
        (OLD.replace("5 30 40 7\n", "5 30 40\n"), "a quad was found that has not 4 nodes behind its tags"),
        (OLD.replace("4 2 3 0 1 6", "4 2 2 0 1 6"), "a triangle was found that has not 3 nodes"),
        (OLD.replace("$Elements\n3", "$Elements\n4"), "3 elements were found; expected 4"),
        (OLD.replace("1 15 2 0 1 5", "1 15"), "an element with fewer than three numbers"),
    ],
)
def test_what_cannot_be_is_refused_before_memory_is_taken(tmp_path, text, told):
    with pytest.raises(MeshFileError, match=rf"^[^$]*a\.msh: .*{told}"):
        read_mesh(save(tmp_path, "a.msh", text))


@pytest.mark.parametrize("sizes", [(2, -1, 2), (2, 0, 2), (2, 1 << 30, 1 << 30), (77, 1, 2), (2, 1, -9)])
def test_a_binary_block_of_version_2_that_cannot_be_is_refused(tmp_path, sizes):
    text = OLD.replace("2.2 0 8\n", "2.2 1 8\n\1\0\0\0\n")
    nodes = b"".join(
        np.array(number, "<i4").tobytes() + np.array(place, "<f8").tobytes()
        for number, place in ((1, (0, 0, 0)), (2, (1, 0, 0)), (3, (0, 1, 0)))
    )
    head, _, _ = text.partition("$Nodes")
    elements = np.array([*sizes, 1, 0, 1, 1, 2, 3], "<i4").tobytes()
    found = b"%b$Nodes\n3\n%b\n$EndNodes\n$Elements\n1\n%b\n$EndElements\n" % (head.encode(), nodes, elements)
    (tmp_path / "a.msh").write_bytes(found)
    with pytest.raises((MeshFileError, UnsupportedFormatError), match=r"a\.msh: .*(damaged|kind 77)"):
        read_mesh(tmp_path / "a.msh")
    whole = found.replace(elements, np.array([2, 1, 2, 1, 0, 1, 1, 2, 3], "<i4").tobytes())
    (tmp_path / "a.msh").write_bytes(whole)
    assert read_mesh(tmp_path / "a.msh").faces.tolist() == [[0, 1, 2, -1]]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (WHOLE.replace("4.1 0 8", "1.0 0 8"), "version 1.0 was found; expected 2 or 4"),
        (WHOLE.replace("2 1 3 1\n", "2 1 200 1\n"), "elements of Gmsh's kind 200 were found"),
        (OLD.replace("9 3 2 0 1 5 30 40 7", "9 10 0 5 30 40 7 5 5 5 5 5"), "1 faces of the kind quad9"),
    ],
)
def test_what_is_not_read_is_named(tmp_path, text, told):
    with pytest.raises(UnsupportedFormatError, match=told):
        read_mesh(save(tmp_path, "a.msh", text))
