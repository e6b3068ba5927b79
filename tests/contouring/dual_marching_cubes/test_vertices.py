"""Vertices lie in their cells, on the trilinear surface, and where the affine says."""

import numpy as np
import pytest

from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.real import REAL_VOLUMES, read_real_volume
from tests.fields import paper_field, smooth_noise, sphere, volume_of, white_noise
from tests.oracle.grid import cut_grid
from tests.oracle.trilinear import cell_indices, distances_at


def integer_noise():
    """Integers whose isovalue, an integer, is the value of many nodes."""
    return volume_of(np.random.default_rng(5).integers(0, 6, (20, 21, 22)).astype(np.int16))


def float_noise_with_ties():
    """Floats of which many equal the isovalue: vertices lie on nodes."""
    return volume_of(integer_noise().values.astype(np.float32))


def large_offset():
    """Small noise on a large mean: the residual is lost without subtracting the isovalue first."""
    return volume_of(white_noise(24).values.astype(np.float64) + 1e5)


def noise_of_size(size, dtype):
    """Noise whose values are about `size`."""
    return lambda: volume_of((white_noise(12).values.astype(np.float64) * size).astype(dtype))


def mixed_sizes():
    """Values of either sign from 1e-50 to 1e50: beside a large value a small one keeps its sign only."""
    rng = np.random.default_rng(6)
    return volume_of(rng.choice([-1.0, 1.0], (9, 10, 11)) * 10.0 ** rng.uniform(-50, 50, (9, 10, 11)))


VOLUMES = {
    "sphere": (sphere, 0.0),
    "iwp": (lambda: paper_field("iwp", 32), 0.0),
    "genus two": (lambda: paper_field("genus_two", 64), 0.0),
    "white noise": (lambda: white_noise(34), 0.0),
    "smooth noise": (lambda: smooth_noise(34, sigma=1.0), 0.0),
    "integer noise": (integer_noise, 3.0),
    "float noise with ties": (float_noise_with_ties, 3.0),
    "large offset": (large_offset, 1e5),
    "large offset with ties": (lambda: volume_of(large_offset().values.astype(np.float32)), 1e5),
    "small float32": (noise_of_size(1e-30, np.float32), 0.0),
    "smallest float32": (noise_of_size(1e-42, np.float32), 0.0),
    "largest float32": (noise_of_size(5e37, np.float32), 0.0),
    "small float64": (noise_of_size(1e-200, np.float64), 0.0),
    "large float64": (noise_of_size(1e150, np.float64), 0.0),
    "mixed sizes": (mixed_sizes, 0.0),
}


LARGE = {"nifti_bonsai/bonsai.nii.gz", "raw_engine"}
"""Real volumes of seven million nodes and more."""


@pytest.fixture(params=VOLUMES)
def volume_and_isovalue(request):
    make, isovalue = VOLUMES[request.param]
    return make(), isovalue


@pytest.fixture(params=["open", "closed"])
def border(request):
    return request.param


def test_vertices_lie_on_the_trilinear_surface(extract, volume_and_isovalue, border):
    volume, isovalue = volume_and_isovalue
    surface = extract(volume, isovalue, border=border)
    grid = cut_grid(volume, SurfaceSettings(isovalue=isovalue, border=border))
    distance = distances_at(grid, surface.placement.cell.numpy(), surface.placement.local.numpy())
    value_range = float(volume.values.max()) - float(volume.values.min())
    assert np.abs(distance).max() <= 1e-5 * value_range


def test_vertices_lie_in_their_cells(extract, volume_and_isovalue, border):
    local = extract(*volume_and_isovalue, border=border).placement.local.numpy()
    assert local.min() >= 0.0
    assert local.max() <= 1.0


def test_the_cells_of_vertices_are_active(extract, volume_and_isovalue, border):
    volume, isovalue = volume_and_isovalue
    surface = extract(volume, isovalue, border=border)
    cases = cut_grid(volume, SurfaceSettings(isovalue=isovalue, border=border)).cases()
    i, j, k = cell_indices_of(surface, volume, isovalue, border).T
    assert ((cases[k, j, i] > 0) & (cases[k, j, i] < 255)).all()


def cell_indices_of(surface, volume, isovalue, border):
    grid = cut_grid(volume, SurfaceSettings(isovalue=isovalue, border=border))
    return cell_indices(grid, surface.placement.cell.numpy())


@pytest.mark.real
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in LARGE else ()) for name in REAL_VOLUMES]
)
def test_the_vertices_of_real_volumes_lie_on_the_trilinear_surface(extract, name, border, shared_data):
    volume, isovalue = read_real_volume(shared_data, name), REAL_VOLUMES[name][0]
    surface = extract(volume, isovalue, border=border, threads=2)
    grid = cut_grid(volume, SurfaceSettings(isovalue=isovalue, border=border))
    distance = distances_at(grid, surface.placement.cell.numpy(), surface.placement.local.numpy())
    low, high = volume.value_range()
    assert np.abs(distance).max() <= 1e-5 * (high - low)


def test_vertices_of_ordinary_cells_come_first_and_both_parts_are_in_grid_order(extract, border):
    surface = extract(white_noise(20), border=border)
    cells, ordinary = surface.placement.cell.numpy(), surface.numbering.cells.ordinary_count
    assert 0 < ordinary < len(cells)
    assert (np.diff(cells[:ordinary]) > 0).all()
    assert (np.diff(cells[ordinary:]) >= 0).all()
    assert not set(cells[:ordinary]) & set(cells[ordinary:])


@pytest.mark.parametrize(
    "affine",
    [
        np.eye(4),
        np.diag([0.5, 2.0, 1.25, 1.0]),
        np.array([[0.3, 0.1, 0, -100], [-0.1, 0.3, 0.2, 50], [0, 0.05, -2, 7], [0, 0, 0, 1]]),
    ],
    ids=["identity", "anisotropic", "oblique"],
)
def test_vertices_are_cell_plus_local_through_the_affine(extract, border, affine):
    volume = volume_of(white_noise(12).values, affine=affine)
    surface = extract(volume, border=border)
    index = cell_indices_of(surface, volume, 0.0, border) - (border == "closed")
    index = index + surface.placement.local.numpy().astype(np.float64)
    expected = index @ affine[:3, :3].T + affine[:3, 3]
    np.testing.assert_allclose(surface.mesh.positions.numpy(), expected, rtol=0, atol=2e-5)


def test_caps_of_a_closed_border_lie_half_a_cell_outside_the_last_nodes(extract):
    volume = volume_of(np.full((4, 4, 4), 2.0, dtype=np.float32))
    surface = extract(volume, 1.0, border="closed")
    extremes = np.unique(np.abs(surface.mesh.positions.numpy() - 1.5).max(axis=1))
    np.testing.assert_allclose(extremes, 2.0, atol=0.5)
    assert surface.mesh.positions.numpy().min() >= -0.5 - 1e-6
    assert surface.mesh.positions.numpy().max() <= 3.5 + 1e-6


def test_a_sphere_is_met_to_second_order(extract):
    volume = sphere(nodes=64)
    affine = np.diag([2 / 63, 2 / 63, 2 / 63, 1.0])
    affine[:3, 3] = -1.0
    vertices = extract(volume_of(volume.values, affine=affine)).mesh.positions.numpy()
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 0.75, atol=5e-4)
