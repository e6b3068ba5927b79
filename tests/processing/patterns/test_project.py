"""Merged vertices go back on the trilinear surface; without projection they stay at the papers' place."""

import numpy as np
import pytest
from hypothesis import given

from dmc_cli.measures.deviation import measure_deviation
from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import iwp, paper_field, sphere, volume_of, white_noise
from tests.mesh.meshes import colored, simplified
from tests.strategies import volumes_with_settings


def deviation_of(surface, volume):
    return measure_deviation(surface.placement, volume, volume.value_range())


@pytest.mark.parametrize("name", ["genus_two", "iwp", "neovius", "steiner"])
@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("rules", ["safe", "paper"])
def test_the_deviation_after_is_that_before(extract, name, border, rules):
    volume = paper_field(name, 64)
    surface = extract(volume, border=border, threads=2)
    before = deviation_of(surface, volume)
    result = simplified(colored(surface), simplify_rules=rules)
    after = deviation_of(result, volume)
    assert sum(result.removed_3x3y) > 100
    assert after.max_relative < 1e-6
    low, high = volume.value_range()
    assert abs(after.mean - before.mean) < 1e-8 * (high - low)


def test_without_projection_vertices_leave_the_surface(extract):
    volume = paper_field("genus_two", 64)
    result = simplified(colored(extract(volume)), project=False)
    assert deviation_of(result, volume).max_relative > 1e-6


def test_white_noise_stays_on_the_surface(extract):
    volume = white_noise(24)
    for border in ("open", "closed"):
        result = simplified(colored(extract(volume, border=border)))
        assert deviation_of(result, volume).max_relative < 1e-6


@given(volumes_with_settings())
def test_any_simplified_mesh_is_on_the_surface_and_in_its_cells(volume_and_settings):
    volume, settings = volume_and_settings
    surface = extract_on("cpu", volume, settings)
    before = deviation_of(surface, volume).max_relative or 0.0
    result = simplified(colored(surface), simplify_rules="paper")
    local = result.placement.local.numpy()
    assert ((local >= 0) & (local <= 1)).all()
    if surface.mesh.vertex_count and volume.value_range() is not None:
        assert (deviation_of(result, volume).max_relative or 0.0) <= max(before, 1e-6)


@pytest.mark.parametrize("project", [True, False])
def test_positions_follow_cells_and_local_coordinates(extract, project):
    affine = np.array([[0.5, 0.1, 0, -3], [0, 2, 0, 4], [0.2, 0, 1.25, 7], [0, 0, 0, 1.0]])
    volume = volume_of(sphere(24).values, affine=affine)
    surface = simplified(colored(extract(volume)), project=project)
    cell, nx, ny = (
        surface.placement.cell.numpy(),
        surface.placement.frame.grid.nx,
        surface.placement.frame.grid.ny,
    )
    index = np.stack([cell % nx, cell // nx % ny, cell // nx // ny], axis=1) + surface.placement.local.numpy()
    expected = index @ affine[:3, :3].T + affine[:3, 3]
    np.testing.assert_allclose(surface.mesh.positions.numpy(), expected, atol=1e-5)


@pytest.mark.slow
def test_iwp_512_is_as_near_to_its_formula_as_before_simplification():
    volume = paper_field.__wrapped__("iwp", 512)
    settings = SurfaceSettings(isovalue=0.0, topology="asymptotic")
    result = simplified(colored(extract_on("cpu", volume, settings, threads=2)), simplify_rules="paper")
    x, y, z = (result.mesh.positions.numpy().astype(np.float64) / 511 * 2 - 1).T
    assert np.abs(iwp(x, y, z)).mean() <= 0.98e-4
