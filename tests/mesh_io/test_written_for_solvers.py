"""Formats of solvers are read back by meshio, and line by line as their manuals have the fields."""

from dataclasses import replace

import meshio
import numpy as np
import pytest

from dmc_cli.errors import MeshFileError, SettingsError, WriteError
from dmc_cli.mesh_io import numbered
from dmc_cli.mesh_io.mesh_file import grouped
from dmc_cli.mesh_io.numbered import solver_names
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from tests.mesh_io.layouts import rings

MESHIO = {"msh": "gmsh", "inp": "abaqus", "nas": "nastran", "mesh": "medit", "xdmf": "xdmf"}
LAYOUTS = [("msh", False), ("msh", True), ("inp", False), ("nas", False), ("mesh", False), ("xdmf", False)]


@pytest.fixture
def mixed(grid):
    """The sheet with a third of the faces cut to triangles, here and there, and with values."""
    draws = np.random.default_rng(7)
    faces = grid.faces.copy()
    faces[draws.random(len(faces)) < 1 / 3, 3] = -1
    count = len(grid.points)
    return replace(
        grid,
        faces=faces,
        vertex_values={"thickness": draws.random(count).astype(np.float32), "flow": draws.random((count, 3))},
        face_values={"labels": draws.integers(-5, 70_000, (len(faces), 2)).astype(np.int32)},
    )


def written(folder, mesh, suffix, **options):
    path = folder / f"mesh.{suffix}"
    write_mesh(str(path), mesh, **options)
    return path


def two_parts(mesh):
    """The mesh twice, as groups."""
    return grouped({"left": mesh, "2 right": replace(mesh, points=mesh.points + np.float32(1e6))})


def cells_of(data, kind):
    blocks = [block.data for block in data.cells if block.type == kind]
    return np.concatenate(blocks) if blocks else np.zeros((0, {"triangle": 3, "quad": 4}[kind]), int)


@pytest.mark.parametrize(("suffix", "ascii"), LAYOUTS)
def test_meshio_reads_the_same_nodes_and_elements(tmp_path, mixed, suffix, ascii):
    data = meshio.read(written(tmp_path, mixed, suffix, ascii=ascii), MESHIO[suffix])
    np.testing.assert_array_equal(data.points.astype(np.float32), mixed.points)
    is_triangle = mixed.faces[:, 3] < 0
    np.testing.assert_array_equal(cells_of(data, "triangle"), mixed.faces[is_triangle, :3])
    np.testing.assert_array_equal(cells_of(data, "quad"), mixed.faces[~is_triangle])
    assert {block.type for block in data.cells} == {"triangle", "quad"}


@pytest.mark.parametrize("ascii", [False, True])
def test_meshio_reads_the_same_values_of_gmsh(tmp_path, mixed, ascii):
    data = meshio.read(written(tmp_path, mixed, "msh", ascii=ascii), "gmsh")
    np.testing.assert_array_equal(
        data.point_data["thickness"].astype(np.float32), mixed.vertex_values["thickness"]
    )
    np.testing.assert_array_equal(data.point_data["flow"], mixed.vertex_values["flow"])
    order = np.argsort(mixed.faces[:, 3] >= 0, kind="stable")
    for side in (0, 1):
        found = np.concatenate(data.cell_data[f"labels_{side}"])
        np.testing.assert_array_equal(found, mixed.face_values["labels"][order, side])


def test_meshio_reads_the_same_values_of_xdmf(tmp_path, mixed):
    path = written(tmp_path, mixed, "xdmf")
    data = meshio.read(path, "xdmf")
    for name, array in mixed.vertex_values.items():
        assert data.point_data[name].dtype == array.dtype
        np.testing.assert_array_equal(data.point_data[name], array)
    found = np.concatenate(data.cell_data["labels"])
    np.testing.assert_array_equal(found, mixed.face_values["labels"])
    faces = [row for block in data.cells for row in block.data.tolist()]
    assert faces == [[*ring] for ring in rings(mixed.faces)]  # in the order of the mesh
    again = read_mesh(path)
    np.testing.assert_array_equal(again.faces, mixed.faces)
    np.testing.assert_array_equal(again.face_values["labels"], mixed.face_values["labels"])


def test_groups_of_medit_are_references(tmp_path, mixed):
    path = written(tmp_path, two_parts(mixed), "mesh")
    data = meshio.read(path, "medit")
    found = dict(zip([block.type for block in data.cells], data.cell_data["medit:ref"], strict=True))
    is_triangle = mixed.faces[:, 3] < 0
    for kind, count in (("triangle", is_triangle.sum()), ("quad", (~is_triangle).sum())):
        assert found[kind].tolist() == [1] * count + [2] * count
    assert "# reference 2: 2 right\n" in path.read_text()


@pytest.mark.parametrize(("suffix", "ascii"), [*LAYOUTS, ("k", False)])
def test_what_is_written_is_read_by_us_too(tmp_path, mixed, suffix, ascii):
    found = read_mesh(written(tmp_path, mixed, suffix, ascii=ascii))
    np.testing.assert_array_equal(found.points.astype(np.float32), mixed.points)
    assert sorted(rings(found.faces)) == sorted(rings(mixed.faces))
    assert (found.space, found.warnings) == ("LPS", ())


@pytest.mark.parametrize("ascii", [False, True])
def test_groups_of_gmsh_are_physical_surfaces(tmp_path, cube, ascii):
    data = meshio.read(written(tmp_path, two_parts(cube), "msh", ascii=ascii), "gmsh")
    assert {name: found.tolist() for name, found in data.field_data.items()} == {
        "left": [1, 2],
        "2 right": [2, 2],
    }
    assert np.concatenate(data.cell_data["gmsh:physical"]).tolist() == [1] * 6 + [2] * 6
    (box,) = [
        line
        for line in written(tmp_path, two_parts(cube), "msh", ascii=True, force=True).read_text().split("\n")
        if line.startswith("2 999999")
    ]
    assert [float(word) for word in box.split()] == [2, *[999_999] * 3, *[1_000_001] * 3]


def test_groups_of_abaqus_are_sets_and_surfaces(tmp_path, mixed):
    path = written(tmp_path, two_parts(mixed), "inp")
    data = meshio.read(path, "abaqus")
    lines = path.read_text().split("\n")
    kinds = [line for line in lines if line.startswith("*ELEMENT")]
    assert kinds == [
        f"*ELEMENT, TYPE={kind}, ELSET={name}" for name in ("left", "part_2_right") for kind in ("S4R", "S3R")
    ]
    assert lines[-5:] == [
        "*SURFACE, TYPE=ELEMENT, NAME=SURFACE_left",
        "left, SPOS",
        "*SURFACE, TYPE=ELEMENT, NAME=SURFACE_part_2_right",
        "part_2_right, SPOS",
        "",
    ]
    assert len(cells_of(data, "quad")) == 2 * mixed.quad_count
    numbers = [int(line.partition(",")[0]) for line in lines[lines.index(kinds[0]) :] if line[:1].isdigit()]
    assert sorted(numbers) == list(range(1, 2 * len(mixed.faces) + 1))


@pytest.mark.parametrize(
    ("element", "triangle"),
    [(None, "S3R"), ("S4", "S3"), ("M3D4", "M3D3"), ("SFM3D4", "SFM3D3"), ("R3D4", "R3D3")],
)
def test_the_element_of_abaqus_is_the_one_asked_for(tmp_path, mixed, element, triangle):
    lines = written(tmp_path, mixed, "inp", element=element).read_text().split("\n")
    kinds = [line.split(",")[1] for line in lines if line.startswith("*ELEMENT")]
    assert kinds == [f" TYPE={element or 'S4R'}", f" TYPE={triangle}"]


def test_an_element_is_refused_where_there_is_no_choice(tmp_path, cube):
    with pytest.raises(
        SettingsError, match=r"S4 was asked for \(--element\), but Nastran files have no choice"
    ):
        written(tmp_path, cube, "nas", element="S4")


def test_groups_of_nastran_are_properties(tmp_path, cube):
    path = written(tmp_path, two_parts(cube), "nas")
    data = meshio.read(path, "nastran")
    assert np.concatenate(data.cell_data["nastran:ref"]).tolist() == [1] * 6 + [2] * 6
    assert "$ property 2: part_2_right\n" in path.read_text()


def test_every_real_of_nastran_has_a_point_and_fits_its_field(tmp_path, cube):
    points = cube.points.copy()
    points[:4] = [
        [1e-7, -1e-7, 1e30],
        [-1.2345678e-38, 1.1754944e-38, -1e-30],
        [1e5, 1e20, -0.0],
        [0.1, 7, 8],
    ]
    path = written(tmp_path, replace(cube, points=points), "nas")
    lines = [line for line in path.read_text().split("\n") if line.startswith(("GRID*", "*"))]
    fields = [(one[40:56], one[56:72], two[8:24]) for one, two in zip(lines[::2], lines[1::2], strict=True)]
    assert all("." in field and field.strip() for row in fields for field in row)
    np.testing.assert_array_equal(np.array(fields).astype(np.float32), points)
    assert all(len(one) == 73 for one in lines[::2])


def test_ls_dyna_has_its_fields_where_the_manual_has_them(tmp_path, mixed):
    """Nodes: 8, 16, 16, 16 columns. Shells: ten of 8, the fourth node of a triangle its third."""
    path = written(tmp_path, two_parts(mixed), "k")
    lines = path.read_text().split("\n")
    assert lines[0] == "*KEYWORD"
    assert lines[-2:] == ["*END", ""]
    node, shell = lines.index("*NODE"), lines.index("*ELEMENT_SHELL")
    nodes = [
        (int(line[:8]), *(float(line[8 + 16 * c : 24 + 16 * c]) for c in range(3)))
        for line in lines[node + 1 : shell]
    ]
    assert [row[0] for row in nodes] == list(range(1, 2 * len(mixed.points) + 1))
    np.testing.assert_array_equal(np.float32([row[1:] for row in nodes]), two_parts(mixed).points)
    shells = np.array([[int(line[8 * c : 8 * c + 8]) for c in range(6)] for line in lines[shell + 1 : -2]])
    faces = two_parts(mixed).faces
    expected = np.where(faces < 0, faces[:, 2:3], faces)[shells[:, 0] - 1] + 1
    np.testing.assert_array_equal(shells[:, 2:], expected)
    np.testing.assert_array_equal(shells[:, 1], np.where(shells[:, 0] > len(mixed.faces), 2, 1))
    parts = [lines[n + 1 : n + 3] for n, line in enumerate(lines) if line == "*PART"]
    assert [(name, int(card[:10])) for name, card in parts] == [("left", 1), ("part_2_right", 2)]


def test_names_are_letters_digits_and_bars_and_differ():
    names = ["Skull", "skull", "7 ribs", "left lung", "left-lung", "Ä", "", "x" * 100]
    assert solver_names(names) == [
        *("Skull", "skull_2", "part_7_ribs", "left_lung", "left_lung_2"),
        *("part__", "part_", "x" * 64),
    ]


@pytest.mark.parametrize("suffix", ["inp", "nas", "k"])
def test_more_than_a_format_has_numbers_for_is_refused(tmp_path, cube, suffix, monkeypatch):
    module = {"inp": "abaqus.writer", "nas": "nastran", "k": "ls_dyna"}[suffix]
    monkeypatch.setattr(f"dmc_cli.mesh_io.{module}.MOST", 7)
    with pytest.raises(
        WriteError, match="file of 8 nodes or elements cannot be written: its numbers go to 7"
    ):
        written(tmp_path, cube, suffix)
    assert not list(tmp_path.iterdir())
    assert numbered.LONGEST_NAME < 80


def test_ls_dyna_with_other_numbers_commas_and_comments_is_read(tmp_path):
    path = tmp_path / "a.key"
    path.write_text(
        "$ SPACE=RAS\n*KEYWORD\n*NODE\n$#   nid  x y z\n10,0,0,0\n20,1,0,0\n"
        "      30             1.0             1.0             0.0       0       0\n"
        "      40             0.0             1.0             0.0\n*PART\nskull\n         1\n*ELEMENT_SHELL\n"
        "       7       1      40      10      20      30\n8,1,10,20,30,30\n*END\n"
    )
    mesh = read_mesh(path)
    assert mesh.faces.tolist() == [[3, 0, 1, 2], [0, 1, 2, -1]]
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert mesh.space == "RAS"


@pytest.mark.parametrize(
    ("node", "told"),
    [
        ("       3              .5             1.0             +2.", None),
        ("       3             0.5             1.0", "fewer than 4 numbers"),
        ("       3             0.5             1.0         1.0 2.0", "fewer than 4 numbers"),
        ("       3             0.5            true             2.0", "'true' was found where a number"),
        ("3,.5,1", "fewer than 4 numbers"),
        ("3,.5,1,2,0,0", None),
    ],
)
def test_fields_of_ls_dyna_are_numbers_however_they_are_written(tmp_path, node, told):
    path = tmp_path / "a.k"
    path.write_text(
        f"*keyword\n*node\n1,0,0,0\n       2             1.0             0.0             0.0\n{node}\n"
        "*element_shell\n       1       1       1       2       3       3\n*end\n"
    )
    if told is None:
        assert read_mesh(path).points.tolist() == [[0, 0, 0], [1, 0, 0], [0.5, 1, 2]]
    else:
        with pytest.raises(MeshFileError, match=told):
            read_mesh(path)
