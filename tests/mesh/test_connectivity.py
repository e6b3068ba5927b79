"""Faces are connected by their vertices as the grid connects them, triangles as well as quads."""

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from dmc_cli.contouring import connect_faces
from dmc_cli.errors import SettingsError
from dmc_cli.mesh.check_halfedges import check_halfedges
from dmc_cli.mesh.connectivity import connect
from dmc_cli.mesh.defects import with_defects
from dmc_cli.mesh.mesh import DEFECT, require_quads
from dmc_cli.runtime.device import Device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import Volume
from tests import shapes
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.mesh.meshes import on_device
from tests.oracle.halfedges import valences
from tests.strategies import volumes_with_settings

DEVICE = Device("cpu", 2)


def plain(mesh):
    """Return the same mesh without what the grid told of it."""
    return type(mesh)(mesh.positions, mesh.faces, mesh.device)


TWO_OPEN_SEGMENTS = np.array(
    [
        [[3, 2, 2, 1, 1, 0], [0, 0, 0, 3, 2, 3], [2, 2, 3, 2, 2, 2]],
        [[2, 3, 1, 3, 2, 0], [1, 3, 2, 0, 3, 2], [3, 0, 0, 3, 0, 2]],
        [[0, 1, 1, 1, 1, 0], [0, 0, 0, 2, 2, 2], [1, 2, 3, 1, 1, 3]],
    ],
    np.uint8,
)


@example(
    (
        Volume(values=TWO_OPEN_SEGMENTS, affine=np.eye(4), space="none"),
        SurfaceSettings(isovalue=1.75, topology="asymptotic", border="open"),
    )
)
@given(volumes_with_settings())
def test_a_mesh_from_a_grid_is_connected_alike_without_it(volume_and_settings):
    volume, settings = volume_and_settings
    by_grid = connect_faces(extract_on("cpu", volume, settings)).mesh
    by_vertices = with_defects(connect(plain(by_grid)))
    quads, twin = by_grid.faces.numpy(), by_vertices.halfedges.twin.numpy()
    defect, grid_twin = by_grid.face_values[DEFECT].numpy(), by_grid.halfedges.twin.numpy()
    # the decider's two segments in one face lie between the same two vertices; at an open border one quad of
    # each may be missing, and the other two meet in these vertices, though not in a segment
    met = (grid_twin < 0) & (twin >= 0) & (grid_twin[twin] < 0)
    assert not met.any() or (settings.topology == "asymptotic" and settings.border == "open")
    apart = met.reshape(-1, 4).any(axis=1)
    assert defect[apart].all()
    np.testing.assert_array_equal(by_vertices.face_values[DEFECT].numpy()[~apart], defect[~apart])
    one_fan = settings.topology == "manifold" or settings.border == "closed"
    # where four quads share two vertices, these do not tell which belong together
    if not defect.any():
        np.testing.assert_array_equal(twin, grid_twin)
        check_halfedges(quads, twin, by_vertices.halfedges.vertex_halfedge.numpy(), one_fan=one_fan)
    expected = valences(quads, twin, by_grid.vertex_count)
    np.testing.assert_array_equal(by_vertices.halfedges.valence.numpy(), expected)


MESHES = {
    "tetrahedron": shapes.tetrahedron(),
    "house": shapes.house(),
    "cube": shapes.cube(),
    "strip": shapes.open_strip(4),
    "torus": shapes.torus(),
    "halved torus": shapes.halved(shapes.torus()),
    "quarter of a torus": shapes.halved(shapes.torus(), every=4),
}


@pytest.mark.parametrize("name", MESHES)
def test_halfedges_are_sound(name, device):
    points, faces = MESHES[name]
    halfedges = connect(on_device((points, faces), Device(device, 2))).halfedges
    twin, start = halfedges.twin.numpy(), halfedges.vertex_halfedge.numpy()
    check_halfedges(faces, twin, start)
    neighbors = [set() for _ in points]
    for face in faces.tolist():
        ring = [v for v in face if v >= 0]
        for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
            neighbors[a].add(b)
            neighbors[b].add(a)
    assert halfedges.valence.numpy().tolist() == [len(found) for found in neighbors]


@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
def test_threads_do_not_show(seed, threads):
    rng = np.random.default_rng(seed)
    faces = rng.integers(0, 9, (20, 4)).astype(np.int32)
    faces[rng.random(20) < 0.5, 3] = -1
    points = np.zeros((9, 3))
    one, other = (connect(on_device((points, faces), Device("cpu", n))).halfedges for n in (1, threads))
    for name in ("twin", "vertex_halfedge", "valence"):
        np.testing.assert_array_equal(getattr(one, name).numpy(), getattr(other, name).numpy())


def test_a_vertex_of_no_face_has_no_halfedge():
    points, faces = shapes.tetrahedron()
    mesh = on_device((np.vstack([points, [9, 9, 9]]), faces), DEVICE)
    halfedges = connect(mesh).halfedges
    assert halfedges.vertex_halfedge.numpy()[-1] == -1
    assert halfedges.valence.numpy()[-1] == 0


def test_what_is_connected_stays_as_it_is():
    mesh = connect(on_device(shapes.cube(), DEVICE))
    assert connect(mesh) is mesh
    assert with_defects(with_defects(mesh)).face_values.keys() == {DEFECT}


def test_stages_for_quads_refuse_triangles():
    assert require_quads(on_device(shapes.cube(), DEVICE), "--relax").face_count == 6
    with pytest.raises(SettingsError, match="--relax takes meshes of quads; 4 of 9 faces are triangles"):
        require_quads(on_device(shapes.house(), DEVICE), "--relax")
