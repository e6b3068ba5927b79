"""`dmc measure`: a mesh file measured like the mesh that it was written from."""

import math
from dataclasses import replace

import numpy as np
import pytest

from dmc_cli.app.measurement import VolumeReference, measure_file, measure_mesh
from dmc_cli.contouring import extract_surface
from dmc_cli.field import upload_volume
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.runtime.device import Device
from dmc_cli.settings import MeasureSettings, SurfaceSettings
from dmc_cli.volume.volume import Volume
from tests import shapes

DEVICE = Device("cpu", 2)


def ball(n=24, space="RAS", slope=1.0):
    k, j, i = np.indices((n, n, n)) - (n - 1) / 2
    values = (100 * (n / 3 - np.sqrt(i**2 + j**2 + k**2))).astype(np.float32)
    affine = np.array([[0.5, 0.1, 0, 30], [0, 0.7, 0.1, -20], [0, 0, 1.5, 10], [0, 0, 0, 1]])
    return Volume(values=values, affine=affine, space=space, slope=slope)


def mesh_of(volume, isovalue, border="open", space=None, inside="above"):
    settings = SurfaceSettings(isovalue=isovalue, border=border, inside=inside)
    surface = extract_surface(upload_volume(volume, DEVICE), settings)
    points, faces = surface.mesh.positions.numpy().astype(float), surface.mesh.faces.numpy()
    return MeshFile(points=points, faces=faces, space=space or volume.space)


def test_a_mesh_is_on_the_surface_of_its_volume():
    volume = ball()
    found = measure_mesh(DEVICE, mesh_of(volume, 5.0), "a.ply", VolumeReference(volume=volume, isovalue=5.0))
    assert found["warnings"] == []
    assert found["deviation"]["max_relative"] < 1e-6
    assert found["deviation"]["max_mm"] < 1e-5
    assert (found["topology"]["genus"], found["topology"]["boundary_edges"]) == (0, 0)
    assert found["mesh"]["quads"] == found["mesh"]["faces"]


@pytest.mark.parametrize("border", ["open", "closed"])
def test_a_mesh_that_the_border_cuts_is_on_the_surface_too(border):
    volume = ball()
    mesh = mesh_of(volume, -500.0, border)
    found = measure_mesh(DEVICE, mesh, "a.ply", VolumeReference(volume=volume, isovalue=-500.0))
    assert found["warnings"] == []
    assert found["deviation"]["max_relative"] < 1e-6
    assert (found["topology"]["boundary_edges"] == 0) == (border == "closed")


def test_axes_of_mesh_and_volume_may_differ():
    volume = ball(space="RAS")
    mesh = mesh_of(volume, 5.0)
    turned = MeshFile(points=mesh.points * (-1, -1, 1), faces=mesh.faces, space="LPS")
    found = measure_mesh(DEVICE, turned, "a.ply", VolumeReference(volume=volume, isovalue=5.0))
    assert found["deviation"]["max_relative"] < 1e-6


def test_a_moved_mesh_deviates_by_as_much():
    volume = ball()
    mesh = mesh_of(volume, 5.0)
    moved = MeshFile(points=np.add(mesh.points, (0.05, 0, 0)), faces=mesh.faces, space="RAS")
    found = measure_mesh(DEVICE, moved, "a.ply", VolumeReference(volume=volume, isovalue=5.0))
    assert found["deviation"]["max_mm"] == pytest.approx(0.05, rel=0.1)
    assert found["deviation"]["mean_mm"] < found["deviation"]["rms"]


@pytest.mark.parametrize("border", ["open", "closed"])
def test_a_mesh_of_uneven_slices_is_on_the_surface(border):
    positions = np.cumsum(np.random.default_rng(2).uniform(0.5, 2.5, 24))
    even = ball()
    volume = Volume(
        values=even.values, affine=even.affine, space="RAS", slice_positions=positions - positions[0]
    )
    mesh = mesh_of(volume, -500.0, border)
    found = measure_mesh(DEVICE, mesh, "a.ply", VolumeReference(volume=volume, isovalue=-500.0))
    assert found["warnings"] == []
    assert found["deviation"]["max_relative"] < 1e-6


def without_some(volume, how):
    """The volume with a twentieth of its nodes without data."""
    values = volume.values.copy()
    values[np.random.default_rng(3).random(values.shape) < 0.05] = 12345.0 if how == "padding" else np.nan
    return replace(volume, values=values, padding=(12345.0, 12345.0) if how == "padding" else None)


@pytest.mark.parametrize("slope", [1.0, -2.0])
@pytest.mark.parametrize("inside", ["above", "below"])
@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("how", ["padding", "NaN"])
def test_a_mesh_beside_nodes_without_data_is_on_the_surface(how, border, inside, slope):
    volume = without_some(ball(n=16, slope=slope), how)
    isovalue = slope * -200.0
    mesh = mesh_of(volume, isovalue, border, inside=inside)
    reference = VolumeReference(volume=volume, isovalue=isovalue, inside=inside)
    found = measure_mesh(DEVICE, mesh, "a.ply", reference)["deviation"]
    assert found["max_relative"] < 3e-6
    assert found["mean_mm"] < 1e-5


def test_the_other_side_of_a_closed_border_is_another_surface():
    volume = ball()
    mesh = mesh_of(volume, -500.0, "closed", inside="below")
    found = measure_mesh(DEVICE, mesh, "a.ply", VolumeReference(volume=volume, isovalue=-500.0))
    assert found["deviation"]["max_relative"] > 0.01


def test_points_outside_the_volume_are_told():
    volume = ball()
    mesh = mesh_of(volume, 5.0)
    far = MeshFile(points=np.add(mesh.points, (1000, 0, 0)), faces=mesh.faces)
    found = measure_mesh(DEVICE, far, "a.ply", VolumeReference(volume=volume, isovalue=5.0))
    assert found["warnings"] == [
        f"{len(mesh.points)} vertices lie outside the volume; they are measured at its border"
    ]
    assert found["warning_codes"] == ["W-OUTSIDE-VOLUME"]


def test_what_was_not_read_of_the_mesh_is_told(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n")
    found = measure_file(MeasureSettings(mesh=str(tmp_path / "a.obj")))
    assert found["warning_codes"] == ["W-MESH-UNREAD"]


def test_without_a_volume_there_is_no_deviation():
    points, faces = shapes.house()
    found = measure_mesh(DEVICE, MeshFile(points=points, faces=faces), "house.obj")
    assert found["deviation"] is None
    assert (found["mesh"]["quads"], found["mesh"]["triangles"]) == (5, 4)
    assert found["mesh"]["volume"] == pytest.approx(1 + 0.5 / 3)
    assert found["quality"]["shape_mean"] == 1.0
    assert math.isfinite(found["quality"]["mean_ratio_mean"])
