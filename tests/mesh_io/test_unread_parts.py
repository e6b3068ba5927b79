"""What a mesh file holds besides its mesh is told, and faces that no mesh of ours has are refused."""

import meshio
import numpy as np
import pytest

from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.mesh_io.read import read_mesh


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


@pytest.mark.parametrize("suffix", ["xdmf", "vtu"])
def test_what_other_files_hold_besides_is_told(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    cells = [("triangle", [[0, 1, 2]]), ("line", [[0, 3], [1, 3]]), ("tetra", [[0, 1, 2, 3]])]
    meshio.Mesh(points, cells, point_data={"depth": points[:, 0]}).write(path)
    mesh = read_mesh(path)
    assert (len(mesh.faces), codes(mesh)) == (1, ["W-MESH-UNREAD"])
    for part in ("2 cells of line", "1 cells of tetra"):
        assert part in mesh.warnings[0].sentence
    np.testing.assert_array_equal(mesh.vertex_values["depth"], points[:, 0])
    meshio.Mesh(points, cells[:1]).write(path)
    assert codes(read_mesh(path)) == []


@pytest.mark.parametrize("suffix", ["msh", "vtu"])
@pytest.mark.parametrize(("kind", "corners"), [("triangle6", 6), ("quad8", 8)])
def test_faces_that_no_mesh_has_are_refused(tmp_path, suffix, kind, corners):
    """Else the mesh had holes in their places."""
    path = tmp_path / f"a.{suffix}"
    points = np.random.default_rng(0).random((8, 3))
    cells = [("triangle", [[0, 1, 2]]), (kind, [[*range(corners)]])]
    meshio.Mesh(points, cells).write(path, file_format={"msh": "gmsh22"}.get(suffix))
    with pytest.raises(
        UnsupportedFormatError, match=rf"1 faces of the kind {kind}.*expected triangles and quads"
    ):
        read_mesh(path)
