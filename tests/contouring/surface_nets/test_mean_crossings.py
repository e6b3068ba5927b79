"""Vertices of surface nets lie at the mean of their cells' crossings, whatever the values are."""

import numpy as np
import pytest

from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_grid.deviation import deviations
from tests.contouring.dual_marching_cubes.agreement import as_arrays, extract_on
from tests.contouring.dual_marching_cubes.test_vertices import VOLUMES
from tests.fields import paper_field, smooth_noise, volume_of
from tests.oracle.dual import mean_crossings
from tests.oracle.grid import cut_grid
from tests.strategies import FLOAT_TYPES, INTEGER_TYPES

PLACED = [name for name in VOLUMES if name != "mixed sizes"]
"""Beside a value that is 1e30 times as large a small one keeps its sign only."""

CLOSE = 2e-6
"""Some roundings of local coordinates in single precision."""


def assert_at_means(extract, volume, isovalue=0.0, **chosen):
    surface = extract(volume, isovalue, method="nets", **chosen)
    grid = cut_grid(volume, SurfaceSettings(isovalue=isovalue, method="nets", **chosen))
    expected = mean_crossings(grid, surface.placement.cell.numpy())
    assert len(expected) > 0
    np.testing.assert_allclose(surface.placement.local.numpy(), expected, atol=CLOSE)


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("name", PLACED)
def test_vertices_lie_at_the_mean_of_the_crossings(extract, name, border):
    make, isovalue = VOLUMES[name]
    assert_at_means(extract, make(), isovalue, border=border)


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("dtype", INTEGER_TYPES + FLOAT_TYPES)
def test_values_of_any_type(extract, dtype, border):
    values = np.random.default_rng(1).integers(0, 100, (6, 7, 40)).astype(dtype)
    assert_at_means(extract, volume_of(values, slope=-1.0), -50.0, border=border)


@pytest.mark.parametrize("border", ["open", "closed"])
def test_nodes_without_data(extract, border):
    values = smooth_noise(20).values.copy()
    values[8:12, 5:18, 9:15] = np.nan
    assert_at_means(extract, volume_of(values), border=border, inside="below")


def test_positions_are_those_of_the_cells_in_the_world(extract):
    affine = np.array([[0.5, 0.1, 0, -3], [0, -2, 0, 4], [0.2, 0, 1.25, 7], [0, 0, 0, 1.0]])
    surface = extract(volume_of(smooth_noise(16).values, affine=affine), method="nets")
    cell, grid = surface.placement.cell.numpy(), surface.placement.frame.grid
    index = np.stack(grid.lowest_nodes(cell), axis=1) + surface.placement.local.numpy().astype(float)
    expected = index @ affine[:3, :3].T + affine[:3, 3]
    np.testing.assert_allclose(surface.mesh.positions.numpy(), expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("threads", [2, 3])
def test_the_same_bytes_on_any_number_of_threads(threads):
    volume = smooth_noise(48, sigma=1.0)
    chosen = SurfaceSettings(isovalue=0.0, method="nets")
    one, several = (as_arrays(extract_on("cpu", volume, chosen, threads=n)) for n in (1, threads))
    assert {name: array.tobytes() for name, array in one.items()} == {
        name: array.tobytes() for name, array in several.items()
    }


@pytest.mark.parametrize(
    ("field", "nodes", "mean", "largest"),
    [
        ("genus_two", 64, 1.395177e-02, 4.636112e-02),
        ("genus_two", 128, 3.507705e-03, 1.169017e-02),
        ("iwp", 64, 1.825822e-02, 1.530685e-01),
    ],
)
def test_the_deviation_from_the_papers_fields(extract, field, nodes, mean, largest):
    """Figures of an independent implementation in double precision, over the vertices of all active cells."""
    found = deviations(extract, field, nodes, method="nets")
    assert found.mean() == pytest.approx(mean, rel=2e-3 if field == "iwp" else 1e-5)
    assert found.max() == pytest.approx(largest, rel=1e-4)


def test_it_is_the_same_mesh_as_that_of_the_oracle_at_ties(extract):
    assert_at_means(extract, paper_field("steiner", 32), 0.0)
