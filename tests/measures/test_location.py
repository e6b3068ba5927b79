"""A mesh of a file is located in its volume and goes through every stage; one of another is refused."""

from dataclasses import replace

import numpy as np
import pytest

import dmc_cli as dmc
from dmc_cli.errors import CallError
from dmc_cli.runtime.device import Device
from tests.app.test_measurement import ball

DEVICE = Device("cpu", 2)
SETTINGS = dmc.SurfaceSettings(isovalue=5.0)


def surface_of(volume, **changes):
    return dmc.extract_surface(dmc.upload_volume(volume, DEVICE), replace(SETTINGS, **changes))


def through_a_file(mesh, folder, turn=False):
    """The mesh as it is read again, its faces the other way round if `turn`."""
    file = dmc.file_of_mesh(mesh)
    faces = file.faces[:, ::-1] if turn else file.faces
    dmc.write_mesh(str(folder / "a.ply"), replace(file, faces=np.ascontiguousarray(faces)))
    return dmc.mesh_of_file(dmc.read_mesh(str(folder / "a.ply")), DEVICE)


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("isovalue", [5.0, -500.0])
def test_vertices_of_a_file_are_where_they_were(tmp_path, border, isovalue):
    volume = ball()
    changes = {"border": border, "isovalue": isovalue}
    surface = surface_of(volume, **changes)
    mesh = through_a_file(surface.mesh, tmp_path)
    found = dmc.locate_mesh(mesh, dmc.upload_volume(volume, DEVICE), replace(SETTINGS, **changes))
    np.testing.assert_allclose(found.positions().numpy(), mesh.positions.numpy(), atol=1e-4)
    assert found.frame.sense == surface.placement.frame.sense
    assert found.frame.grid == surface.placement.frame.grid
    assert np.array_equal(found.frame.affine, surface.placement.frame.affine)


def test_vertices_between_uneven_slices_are_where_they_were(tmp_path):
    positions = np.cumsum(np.random.default_rng(2).uniform(0.5, 2.5, 24))
    volume = replace(ball(), slice_positions=positions - positions[0])
    mesh = through_a_file(surface_of(volume).mesh, tmp_path)
    found = dmc.locate_mesh(mesh, dmc.upload_volume(volume, DEVICE), SETTINGS)
    np.testing.assert_allclose(found.positions().numpy(), mesh.positions.numpy(), atol=1e-4)


@pytest.mark.parametrize("turn", [False, True])
def test_a_quad_mesh_of_a_file_goes_through_every_stage(tmp_path, turn):
    volume = ball(n=32)
    uploaded = dmc.upload_volume(volume, DEVICE)
    mesh = through_a_file(surface_of(volume).mesh, tmp_path, turn)
    before = dmc.measure_quality(mesh)
    quads = mesh.face_count
    placement = dmc.locate_mesh(mesh, uploaded, SETTINGS)
    assert placement.frame.sense == (1.0 if turn else -1.0)
    simplified = dmc.simplify(mesh, placement, dmc.MeshSettings(simplify="all"))
    assert sum(simplified.removed_3x3y) > 0
    assert simplified.mesh.face_count < quads
    remeshed = dmc.remesh(simplified.mesh, simplified.placement, 3)
    assert remeshed.operations > 0
    mesh, placement = dmc.relax(remeshed.mesh, remeshed.placement, 3)
    assert dmc.measure_quality(mesh).shape_mean > before.shape_mean
    normals = dmc.compute_normals(placement, SETTINGS).numpy()
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)
    centre = mesh.positions.numpy().mean(axis=0)
    assert (np.einsum("ij,ij->i", mesh.positions.numpy() - centre, normals) > 0).all()
    topology = dmc.measure_topology(mesh)
    assert (topology.genus, topology.boundary_edges) == (0, 0)
    again = dmc.locate_mesh(mesh, uploaded, SETTINGS)  # so it is still on the surface
    np.testing.assert_allclose(again.positions().numpy(), mesh.positions.numpy(), atol=1e-4)


def moved(mesh, by):
    file = dmc.file_of_mesh(mesh)
    return dmc.mesh_of_file(replace(file, points=file.points + np.array(by)), DEVICE)


def test_vertices_outside_the_grid_are_refused():
    volume = ball()
    mesh = moved(surface_of(volume).mesh, (1000.0, 0, 0))
    with pytest.raises(CallError, match=rf"{mesh.vertex_count} of {mesh.vertex_count} vertices lie outside"):
        dmc.locate_mesh(mesh, dmc.upload_volume(volume, DEVICE), SETTINGS)


def test_vertices_far_from_the_surface_are_refused():
    volume = ball()
    uploaded = dmc.upload_volume(volume, DEVICE)
    mesh = surface_of(volume).mesh
    with pytest.raises(CallError, match=r"up to 7\.5\d* mm; expected up to 1\.5\d* mm, a spacing"):
        dmc.locate_mesh(mesh, uploaded, replace(SETTINGS, isovalue=505.0))


def test_the_other_space_is_told_by_its_affine():
    volume = ball()
    turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    file = dmc.file_of_mesh(surface_of(volume).mesh)
    mesh = dmc.mesh_of_file(replace(file, points=file.points * (-1, -1, 1)), DEVICE)
    uploaded = dmc.upload_volume(volume, DEVICE)
    with pytest.raises(CallError, match="the affine of the space"):
        dmc.locate_mesh(mesh, uploaded, SETTINGS)
    found = dmc.locate_mesh(mesh, uploaded, SETTINGS, turn @ volume.affine)
    np.testing.assert_allclose(found.positions().numpy(), mesh.positions.numpy(), atol=1e-4)


def test_what_is_no_volume_on_the_device_is_refused():
    volume = ball()
    with pytest.raises(CallError, match="a Volume was found; expected a volume on cpu"):
        dmc.locate_mesh(surface_of(volume).mesh, volume, SETTINGS)
