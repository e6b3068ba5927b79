"""Normals are those of the oracle: central differences, one-sided at borders, in the output space."""

import numpy as np
import pytest

from dmc_cli.settings import SurfaceSettings
from dmc_cli.surface.normals import compute_normals
from tests.fields import plane, smooth_noise, sphere, volume_of
from tests.oracle.grid import cut_grid
from tests.oracle.normals import vertex_normals
from tests.strategies import AFFINES, FLOAT_TYPES, INTEGER_TYPES
from tests.surface.agreement import extract_on

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
        return surface, compute_normals(surface, chosen).numpy()

    return run


def assert_normals_agree(find_normals, volume, isovalue=0.0, **settings):
    chosen = SurfaceSettings(isovalue=isovalue, **settings)
    surface, normals = find_normals(volume, isovalue, **settings)
    grid = cut_grid(volume, chosen)
    cells, local = surface.vertex_cell.numpy(), surface.vertex_local.numpy()
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


def test_normals_of_a_plane_are_exact_up_to_the_border(find_normals):
    _, normals = find_normals(plane())
    np.testing.assert_array_equal(normals, np.broadcast_to([0, 0, 1], normals.shape))


def test_normals_of_a_sphere_point_outwards(find_normals):
    surface, normals = find_normals(sphere(nodes=32))
    radial = surface.vertices.numpy() - 15.5
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    assert np.sum(normals * radial, axis=1).min() > 0.999


def test_normals_have_unit_length(find_normals):
    _, normals = find_normals(smooth_noise(20))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)


def test_normals_agree_with_the_sides_of_the_quads(find_normals):
    surface, normals = find_normals(sphere(nodes=32), border="closed")
    quads, p = surface.quads.numpy(), surface.vertices.numpy().astype(np.float64)
    across = np.cross(p[quads[:, 2]] - p[quads[:, 0]], p[quads[:, 3]] - p[quads[:, 1]])
    assert (np.sum(across * normals[quads].mean(axis=1), axis=1) > 0).all()
