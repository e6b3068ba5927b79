"""Values of vertices and faces go from a file through a mesh and its stages into a file again."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from dmc_cli.contouring import color_faces, connect_faces
from dmc_cli.errors import CallError
from dmc_cli.mesh.check_halfedges import check_halfedges
from dmc_cli.mesh.mesh import COLOR, COLOR24, DEFECT, OWN_PREFIX
from dmc_cli.mesh.mesh_files import file_of_mesh, mesh_of_file
from dmc_cli.mesh_io.mesh_file import LABELS, MeshFile
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from dmc_cli.processing import remesh, simplify
from dmc_cli.processing.remeshing.regions import FROZEN
from dmc_cli.runtime.device import Device
from dmc_cli.settings import MeshSettings, SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import sphere
from tests.mesh_io.mixed import mixed_meshes

DEVICE = Device("cpu", 2)
SETTINGS = SurfaceSettings(isovalue=0.0, border="closed")


def assert_same_values(found, expected):
    """The same names in the same order, and the same numbers of the same types."""
    assert list(found) == list(expected)
    for name, values in expected.items():
        assert found[name].dtype == values.dtype
        np.testing.assert_array_equal(found[name], values)


@given(mixed_meshes(with_values=True))
def test_a_file_is_the_same_after_a_mesh(file):
    again = file_of_mesh(mesh_of_file(file, DEVICE), file.normals, file.space)
    np.testing.assert_array_equal(again.points, file.points.astype(np.float32))
    np.testing.assert_array_equal(again.faces, file.faces)
    assert (again.space, again.triangle_count) == (file.space, file.triangle_count)
    assert (again.normals is None) == (file.normals is None)
    assert_same_values(again.vertex_values, file.vertex_values)
    assert_same_values(again.face_values, file.face_values)


def labelled(faces, cells, placement, volume):
    """The values that a vertex or face of two blobs, one above the other, must have after every stage."""
    grid = placement.frame.grid
    upper = cells // (grid.nx * grid.ny) + 0.5 >= volume.values.shape[0] / 2 + grid.border
    of_face = upper[faces[:, 0]]
    vertex_values = {"frozen": upper.astype(np.uint8), "color": np.where(upper, np.nan, 0.5)}
    face_values = {
        "color": of_face.astype(np.uint8),
        "defect": np.where(of_face, -7, 7).astype(np.int16),
        "color24": of_face.astype(np.float32),
        LABELS: np.stack([1 + of_face, 3 * of_face], axis=1).astype(np.int32),
    }
    return vertex_values, face_values


@pytest.mark.parametrize("ascii", [False, True])
def test_values_of_a_file_go_through_the_stages_whatever_their_names(tmp_path, ascii):
    """A PLY whose properties are called as what stages keep for themselves, from a file to a file."""
    volume = sphere(12)
    volume = replace(volume, values=np.concatenate([volume.values, volume.values]))
    surface = color_faces(connect_faces(extract_on("cpu", volume, SETTINGS)))
    cells, placement = surface.placement.cell.numpy(), surface.placement
    of_vertices, of_faces = labelled(surface.mesh.faces.numpy(), cells, placement, volume)
    written = replace(file_of_mesh(surface.mesh), vertex_values=of_vertices, face_values=of_faces)
    write_mesh(str(tmp_path / "a.ply"), written, ascii=ascii)
    mesh = mesh_of_file(read_mesh(tmp_path / "a.ply"), DEVICE)
    own = {name: surface.mesh.face_values[name] for name in (COLOR, COLOR24, DEFECT)}
    mesh = replace(mesh, halfedges=surface.mesh.halfedges).with_face_values(own)
    result = simplify(mesh, placement, MeshSettings(simplify="all", simplify_rules="paper"))
    assert sum(result.removed_3x3y) > 0
    for found in (result, remesh(result.mesh, result.placement, 6)):
        halfedges = found.mesh.halfedges
        check_halfedges(found.mesh.faces.numpy(), halfedges.twin.numpy(), halfedges.vertex_halfedge.numpy())
        assert set(found.mesh.face_values) == {*of_faces, COLOR, COLOR24}
        write_mesh(str(tmp_path / "b.ply"), file_of_mesh(found.mesh), ascii=ascii, force=True)
        read = read_mesh(tmp_path / "b.ply")
        expected = labelled(read.faces, found.placement.cell.numpy(), found.placement, volume)
        assert_same_values(read.vertex_values, expected[0])
        assert_same_values(read.face_values, expected[1])


@pytest.mark.parametrize(("suffix", "told"), [("obj", "OBJ"), ("off", "OFF")])
def test_what_a_format_cannot_hold_is_told(tmp_path, suffix, told):
    file = MeshFile(
        points=np.eye(4, 3, dtype=np.float32),
        faces=np.array([[0, 1, 2, 3]], np.int32),
        vertex_values={"quality": np.zeros(4)},
        face_values={LABELS: np.zeros((1, 2), np.int32)},
    )
    written = write_mesh(str(tmp_path / f"a.{suffix}"), file_of_mesh(mesh_of_file(file, DEVICE)))
    (warning,) = written.warnings
    assert warning.code == "W-VALUES-LEFT-OUT"
    assert warning.sentence == f"{told} files hold no values of vertices and faces; left out: quality, labels"


@pytest.mark.parametrize("name", [COLOR, COLOR24, DEFECT, FROZEN])
def test_no_value_of_a_file_can_have_a_name_of_the_stages(name):
    assert name.startswith(OWN_PREFIX)
    with pytest.raises(CallError, match="expected one word"):
        MeshFile(
            points=np.eye(4, 3, dtype=np.float32),
            faces=np.array([[0, 1, 2, 3]], np.int32),
            face_values={name: np.zeros(1)},
        )


def test_no_array_is_shared_with_the_file():
    file = MeshFile(
        points=np.eye(4, 3, dtype=np.float32),
        faces=np.array([[0, 1, 2, 3]], np.int32),
        face_values={LABELS: np.zeros((1, 2), np.int32)},
    )
    mesh = mesh_of_file(file, DEVICE)
    for array in (mesh.positions, mesh.faces, mesh.face_values[LABELS]):
        array.fill_(1)
    assert file.points[0, 1] == 0
    assert file.faces[0, 3] == 3
    assert not file.face_values[LABELS].any()
