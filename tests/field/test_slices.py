"""Unevenly spaced slices: vertices lie where the slices say, normals and distances follow."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from dmc_cli.contouring import compute_normals, extract_surface
from dmc_cli.field import upload_volume
from dmc_cli.measures.deviation import measure_deviation
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume

RADIUS = 12.0
SPACING = np.array([1.0, 1.0, 1.5])


def sphere(positions: np.ndarray, shear: float = 0.0) -> Volume:
    """A ball of 12 mm round the middle of slices at these positions, sheared along y as by a gantry tilt."""
    affine = np.diag([*SPACING, 1.0])
    affine[1, 2] = shear
    depths = positions / np.linalg.norm(affine[:3, 2])  # in steps of the third column
    depths = depths - depths.mean()
    affine[:3, 3] = -16.0, -17.0, 0.0
    affine[:3, 3] -= affine[:3, 2] * positions.mean() / np.linalg.norm(affine[:3, 2])
    x, y = np.arange(33.0) - 16.0, np.arange(35.0) - 17.0
    z = SPACING[2] * depths[:, None, None]
    tilted = y[None, :, None] + shear * depths[:, None, None]
    values = RADIUS - np.sqrt(z**2 + tilted**2 + x[None, None, :] ** 2)
    return Volume(values=values, affine=affine, space="LPS", slice_positions=positions)


UNEVEN = np.concatenate([[0.0], np.cumsum(np.random.default_rng(1).uniform(0.6, 2.0, 24))])


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("shear", [0.0, 0.4])
def test_a_ball_in_uneven_slices_is_round(border, shear):
    volume = sphere(UNEVEN, shear)
    surface = extract_surface(
        upload_volume(volume, select_device("cpu")), SurfaceSettings(isovalue=0.0, border=border)
    )
    radii = np.linalg.norm(surface.mesh.positions.numpy(), axis=1)
    assert np.abs(radii - RADIUS).max() < 0.1


def test_normals_in_uneven_slices_point_outwards():
    volume = sphere(UNEVEN, 0.4)
    settings = SurfaceSettings(isovalue=0.0)
    surface = extract_surface(upload_volume(volume, select_device("cpu")), settings)
    vertices = surface.mesh.positions.numpy()
    outwards = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    cosines = (compute_normals(surface.placement, settings).numpy() * outwards).sum(axis=1)
    assert cosines.min() > np.cos(np.deg2rad(6))


def test_even_positions_change_nothing():
    positions = SPACING[2] * np.arange(25.0)
    table = sphere(positions)
    plain = Volume(values=table.values, affine=table.affine, space="LPS")
    device = select_device("cpu")
    settings = SurfaceSettings(isovalue=0.0, border="closed")
    found = [extract_surface(upload_volume(volume, device), settings) for volume in (table, plain)]
    np.testing.assert_allclose(
        found[0].mesh.positions.numpy(), found[1].mesh.positions.numpy(), rtol=0, atol=1e-5
    )
    np.testing.assert_array_equal(found[0].mesh.faces.numpy(), found[1].mesh.faces.numpy())


def test_grid_coordinates_leave_the_positions_aside():
    volume = sphere(UNEVEN)
    device = select_device("cpu")
    surface = extract_surface(
        upload_volume(volume, device), SurfaceSettings(isovalue=0.0), np.eye(4), even_slices=True
    )
    cells = surface.placement.cell.numpy()
    nx, ny, _ = volume.shape
    k = cells // (nx * ny) + surface.placement.local.numpy()[:, 2].astype(float)
    np.testing.assert_allclose(surface.mesh.positions.numpy()[:, 2], k, rtol=0, atol=1e-5)


def test_distances_in_millimetres_use_the_local_slice_distance():
    volume = sphere(2.0 * UNEVEN)
    device = select_device("cpu")
    uploaded = upload_volume(volume, device)
    surface = extract_surface(uploaded, SurfaceSettings(isovalue=0.0))
    moved = surface.placement.local.numpy()
    moved[:, 2] = np.clip(moved[:, 2] + 0.01, 0, 1)
    local = wp.array(moved, dtype=wp.vec3, device="cpu")
    found = measure_deviation(replace(surface.placement, local=local), volume, volume.value_range())
    # the field is a distance, so its values are millimetres too, but for the chords between nodes
    assert found.mean_mm == pytest.approx(found.mean, rel=0.1)


def tilted_plane(border):
    """A plane across uneven slices of a volume with a shear, its normal and its distance from the origin."""
    affine = np.array([[0.9, 0.0, 0.1, 3.0], [0.0, 1.1, -0.3, -5.0], [0.0, 0.0, 1.2, 2.0], [0, 0, 0, 1.0]])
    positions = np.cumsum([0.0, *np.random.default_rng(4).uniform(0.3, 3.0, 11)])
    depths = positions / np.linalg.norm(affine[:3, 2])
    k, j, i = np.meshgrid(depths, np.arange(9.0), np.arange(10.0), indexing="ij")
    nodes = np.stack([i, j, k], axis=-1) @ affine[:3, :3].T + affine[:3, 3]
    normal = np.array([0.36, -0.48, 0.8])
    distance = float(np.median(nodes @ normal))
    volume = Volume(values=-(nodes @ normal), affine=affine, space="LPS", slice_positions=positions)
    settings = SurfaceSettings(isovalue=-distance, border=border)
    surface = extract_surface(upload_volume(volume, select_device("cpu", 2)), settings)
    return surface, settings, normal, distance


def test_a_plane_across_uneven_slices_is_plane():
    surface, settings, normal, distance = tilted_plane("open")
    positions = surface.mesh.positions.numpy()
    assert len(positions) > 80
    np.testing.assert_allclose(positions @ normal, distance, atol=1e-5)
    normals = compute_normals(surface.placement, settings).numpy()
    np.testing.assert_allclose(normals, np.broadcast_to(normal, normals.shape), atol=1e-5)


def test_the_cap_beyond_uneven_slices_is_half_the_last_distance_away():
    surface, _, normal, distance = tilted_plane("closed")
    positions = surface.mesh.positions.numpy()
    on_plane = np.abs(positions @ normal - distance) < 1e-5
    depth = (positions[:, 2] - 2.0) / 1.2
    slices = surface.placement.frame.depths.numpy()
    ends = 0.5 * (slices[0] + slices[1]), 0.5 * (slices[-2] + slices[-1])
    assert on_plane.sum() > 50
    assert depth.min() >= ends[0] - 1.0 - 1e-5
    assert (
        np.isclose(depth, ends[0] - 1.0, atol=1e-5).any() or np.isclose(depth, ends[1] - 1.0, atol=1e-5).any()
    )
    assert depth.max() <= ends[1] - 1.0 + 1e-5
