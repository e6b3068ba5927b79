"""Normals are those of the oracle: central differences, one-sided at borders, in the output space."""

import numpy as np
import pytest

from dmc_cli.contouring.normals import compute_normals
from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import plane, smooth_noise, sphere, volume_of
from tests.oracle.grid import cut_grid
from tests.oracle.normals import vertex_normals
from tests.strategies import AFFINES, FLOAT_TYPES, INTEGER_TYPES

SETTINGS = [
    {"border": border, "inside": inside, "orientation": orientation}
    for border in ("open", "closed")
    for inside in ("above", "below")
    for orientation in ("outward", "gradient")
]


@pytest.fixture
def find_normals(device):
    """A surface and its normals on each device."""

    def run(volume, isovalue=0.0, **settings):
        chosen = SurfaceSettings(isovalue=isovalue, **settings)
        surface = extract_on(device, volume, chosen)
        return surface, compute_normals(surface.placement, chosen).numpy()

    return run


def assert_normals_agree(find_normals, volume, isovalue=0.0, **settings):
    chosen = SurfaceSettings(isovalue=isovalue, **settings)
    surface, normals = find_normals(volume, isovalue, **settings)
    grid = cut_grid(volume, chosen)
    cells, local = surface.placement.cell.numpy(), surface.placement.local.numpy()
    expected = vertex_normals(grid, cells, local, volume.affine, chosen)
    assert len(normals) > 0
    np.testing.assert_allclose(normals, expected, rtol=0, atol=2e-4)


def missing_nodes():
    values = smooth_noise(16, sigma=1.5).values.copy()
    values[np.random.default_rng(3).random(values.shape) < 0.02] = np.nan
    return volume_of(values)


@pytest.mark.parametrize("settings", SETTINGS, ids=lambda s: "-".join(s.values()))
@pytest.mark.parametrize("make", [lambda: smooth_noise(20), missing_nodes], ids=["whole", "missing nodes"])
def test_normals_under_any_settings(find_normals, make, settings):
    assert_normals_agree(find_normals, make(), **settings)


@pytest.mark.parametrize("affine", AFFINES)
def test_normals_go_to_the_world_by_the_inverse_transpose(find_normals, affine):
    assert_normals_agree(find_normals, volume_of(smooth_noise(16).values, affine=AFFINES[affine]))


@pytest.mark.parametrize("slope", [1.0, -1.0])
@pytest.mark.parametrize("dtype", INTEGER_TYPES + FLOAT_TYPES)
def test_normals_of_any_type(find_normals, dtype, slope):
    values = (50 + 400 * smooth_noise(14, sigma=1.5).values).clip(0, 100).astype(dtype)
    assert_normals_agree(find_normals, volume_of(values, slope=slope), slope * 50.0)


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize(
    "make", [lambda: smooth_noise(14, sigma=1.5), missing_nodes], ids=["whole", "missing"]
)
@pytest.mark.parametrize("exponent", [-1000, -140, -74, -60, 62, 66, 120, 1000])
def test_values_of_any_size_have_the_same_normals(find_normals, exponent, make, border):
    values = make().values.astype(float)
    plain, expected = find_normals(volume_of(values), border=border)
    scaled, normals = find_normals(volume_of(np.ldexp(values, exponent)), border=border)
    still = np.abs(scaled.placement.local.numpy() - plain.placement.local.numpy()).max(axis=1) < 1e-4
    assert still.mean() > 0.99
    np.testing.assert_allclose(normals[still], expected[still], rtol=0, atol=1e-3)


@pytest.mark.parametrize("exponent", [-140, -74, 66, 100])
@pytest.mark.parametrize("dtype", FLOAT_TYPES)
def test_normals_of_a_sphere_of_any_size_of_values_point_outwards(find_normals, dtype, exponent):
    values = np.ldexp(sphere(nodes=24).values.astype(float), exponent).astype(dtype)
    surface, normals = find_normals(volume_of(values))
    radial = surface.mesh.positions.numpy() - 11.5
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    assert np.sum(normals * radial, axis=1).min() > 0.99


@pytest.mark.parametrize("spacing", [1e-42, 1e-30, 1e-20, 1e20, 1e30, 1e36])
def test_normals_in_any_spacing_are_the_same(find_normals, spacing):
    _, expected = find_normals(smooth_noise(14, sigma=1.5))
    affine = np.diag([spacing, spacing, spacing, 1.0])
    _, normals = find_normals(volume_of(smooth_noise(14, sigma=1.5).values, affine=affine))
    np.testing.assert_allclose(normals, expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_normals_of_nodes_that_are_close_along_one_axis_run_along_it(find_normals, axis):
    spacing = np.ones(4)
    spacing[axis] = 1e-25
    _, even = find_normals(smooth_noise(14, sigma=1.5))
    _, normals = find_normals(volume_of(smooth_noise(14, sigma=1.5).values, affine=np.diag(spacing)))
    expected = np.zeros_like(normals)
    expected[:, axis] = np.sign(even[:, axis])
    np.testing.assert_allclose(normals, expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize("size", [1e-25, 1.0, 1e25])
def test_normals_between_uneven_slices_are_the_same_for_values_of_any_size(find_normals, size):
    positions = np.cumsum(np.random.default_rng(2).uniform(0.5, 2.5, 14))
    values = smooth_noise(14, sigma=1.5).values.astype(float)
    uneven = {"slice_positions": positions - positions[0]}
    _, expected = find_normals(volume_of(values, **uneven))
    _, normals = find_normals(volume_of(size * values, **uneven))
    assert np.mean(np.abs(normals - expected).max(axis=1) < 1e-3) > 0.99


def test_where_the_gradient_vanishes_the_normal_is_along_z(find_normals):
    thin = np.zeros((3, 5, 5), np.float32)
    thin[:, :, 2] = 1.0  # central differences along x are 0 in the middle of the sheet
    surface, normals = find_normals(volume_of(thin), 1.0)
    middle = surface.placement.local.numpy()[:, 0] % 1.0 == 0.0
    assert middle.all()
    np.testing.assert_array_equal(normals, np.broadcast_to([0, 0, 1], normals.shape))


def test_normals_of_a_plane_are_exact_up_to_the_border(find_normals):
    _, normals = find_normals(plane())
    np.testing.assert_array_equal(normals, np.broadcast_to([0, 0, 1], normals.shape))


def test_normals_of_a_sphere_point_outwards(find_normals):
    surface, normals = find_normals(sphere(nodes=32))
    radial = surface.mesh.positions.numpy() - 15.5
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    assert np.sum(normals * radial, axis=1).min() > 0.999


def test_normals_have_unit_length(find_normals):
    _, normals = find_normals(smooth_noise(20))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)


def test_normals_agree_with_the_sides_of_the_quads(find_normals):
    surface, normals = find_normals(sphere(nodes=32), border="closed")
    quads, p = surface.mesh.faces.numpy(), surface.mesh.positions.numpy().astype(np.float64)
    across = np.cross(p[quads[:, 2]] - p[quads[:, 0]], p[quads[:, 3]] - p[quads[:, 1]])
    assert (np.sum(across * normals[quads].mean(axis=1), axis=1) > 0).all()
