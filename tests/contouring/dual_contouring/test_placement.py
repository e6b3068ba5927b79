"""Vertices lie where the oracle puts them: least error, the paper's recipe, particles."""

import numpy as np
import pytest

from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import as_arrays, extract_on
from tests.contouring.dual_marching_cubes.test_vertices import VOLUMES
from tests.fields import paper_field, smooth_noise, volume_of, white_noise
from tests.oracle import planes
from tests.oracle.dual import cell_crossings
from tests.oracle.grid import cut_grid
from tests.strategies import FLOAT_TYPES, INTEGER_TYPES

PLACED = [name for name in VOLUMES if name != "mixed sizes"]
"""Beside a value that is 1e30 times as large a small one keeps its sign only."""

CLOSE = {"qef": 2e-3, "paper": 1e-5, "particle": 1e-5}
"""Of local coordinates. An eigenvalue of a hundredth of the largest makes roundings that much larger."""


def surface_and_planes(extract, volume, isovalue, **chosen):
    """A surface, its cells' crossings and the normals there."""
    surface = extract(volume, isovalue, method="dc", **chosen)
    grid = cut_grid(volume, SurfaceSettings(isovalue=isovalue, method="dc", **chosen))
    cells = surface.placement.cell.numpy()
    assert len(cells) > 0
    return surface, cell_crossings(grid, cells), planes.crossing_normals(grid, cells)


def undecided(points, normals, placement):
    """Cells of which a rounding decides: an eigenvalue at the cut, a solution at the wall, a lost normal."""
    lost = np.isinf(normals).any(axis=(1, 2))
    normals[lost] = 0.0
    if placement == "particle":
        return lost
    cut = planes.CUT if placement == "qef" else planes.FULL_CUT
    found, values = planes.least_points(points, normals, cut)
    near = np.abs(values[:, :2] / np.maximum(values[:, 2:], 1e-300) - cut) < 1e-3 * cut
    if placement == "paper":
        weak = (values[:, :2] < 1e-9 * values[:, 2:]) & (values[:, :2] > 1e-14 * values[:, 2:])
        wall = np.abs(np.abs(found - 0.5) - 0.5).min(axis=1) < 1e-6
        return (near | weak).any(axis=1) | wall | lost
    return near.any(axis=1) | lost


def assert_placed(extract, volume, isovalue=0.0, *, placement, **chosen):
    surface, points, normals = surface_and_planes(extract, volume, isovalue, placement=placement, **chosen)
    open_cells = undecided(points, normals, placement)
    expected = {
        "qef": planes.place_qef,
        "paper": planes.place_paper,
        "particle": lambda p, n: planes.place_particle(p, n, 50, 0.05),
    }[placement](points, normals)
    assert open_cells.mean() < 0.2
    difference = np.abs(surface.placement.local.numpy() - expected)[~open_cells]
    assert difference.max(initial=0.0) <= CLOSE[placement]
    assert np.mean(difference) <= 1e-5


@pytest.fixture(params=CLOSE)
def placement(request):
    return request.param


@pytest.fixture(params=["open", "closed"])
def border(request):
    return request.param


@pytest.mark.parametrize("name", PLACED)
def test_vertices_lie_where_the_oracle_puts_them(extract, name, placement, border):
    make, isovalue = VOLUMES[name]
    assert_placed(extract, make(), isovalue, placement=placement, border=border)


@pytest.mark.parametrize("dtype", INTEGER_TYPES + FLOAT_TYPES)
def test_values_of_any_type(extract, dtype, placement, border):
    values = np.random.default_rng(1).integers(0, 100, (6, 7, 40)).astype(dtype)
    assert_placed(extract, volume_of(values, slope=-1.0), -50.0, placement=placement, border=border)


def test_nodes_without_data(extract, placement, border):
    values = smooth_noise(20).values.copy()
    values[8:12, 5:18, 9:15] = np.nan
    assert_placed(extract, volume_of(values), placement=placement, border=border, inside="below")


def test_a_flat_field_leaves_vertices_at_the_mean(extract, placement):
    values = np.zeros((5, 5, 5), np.float32)
    values[:, :, ::2] = 1.0  # central differences vanish at every node but those of the border
    surface = extract(volume_of(values), 0.5, method="dc", placement=placement)
    local = surface.placement.local.numpy()
    np.testing.assert_allclose(local, 0.5, atol=1e-6)


@pytest.mark.parametrize("threads", [2, 3])
def test_the_same_bytes_on_any_number_of_threads(threads, placement):
    volume, chosen = white_noise(24), SurfaceSettings(isovalue=0.3, method="dc", placement=placement)
    one, several = (as_arrays(extract_on("cpu", volume, chosen, threads=n)) for n in (1, threads))
    assert {name: array.tobytes() for name, array in one.items()} == {
        name: array.tobytes() for name, array in several.items()
    }


@pytest.mark.parametrize("steps", [0, 1, 10])
@pytest.mark.parametrize("size", [0.05, 0.16])
def test_a_particle_goes_as_many_steps_as_it_is_told(extract, steps, size):
    chosen = {"placement": "particle", "steps": steps, "step_size": size}
    surface, points, normals = surface_and_planes(extract, paper_field("steiner", 32), 0.0, **chosen)
    expected = planes.place_particle(points, normals, steps, size)
    np.testing.assert_allclose(surface.placement.local.numpy(), expected, atol=1e-5)


def test_those_outside_their_cell_are_counted(extract):
    surface, points, normals = surface_and_planes(extract, white_noise(16), 0.3, placement="qef")
    found, _ = planes.least_points(points, normals, planes.CUT)
    outside = int((~((found >= 0) & (found <= 1)).all(axis=1)).sum())
    assert abs(surface.counts.fallback_vertices - outside) <= 0.002 * outside
    assert outside > 100
