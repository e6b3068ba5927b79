"""Ten thousand random volumes: Euler characteristic, Betti numbers and tunnels are those of the interpolant.

The volumes lie side by side in one grid, so that one mesh has them all.
"""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dmc_cli.settings import ReadSettings, SurfaceSettings
from dmc_cli.volume_io import read_volume
from tests.contouring.dual_marching_cubes.real import REAL_VOLUMES, read_real_volume
from tests.contouring.methods_counts import REAL_NAMES
from tests.fields import volume_of
from tests.oracle.edges import vertex_pairs
from tests.oracle.grid import Grid, cut_grid
from tests.oracle.trilinear_topology import Topology, topology_of_blocks
from tests.reference import table

PITCH = 8
"""Nodes from one volume to the next: five, two of a closed border, and one without data."""

KINDS = {
    "uniform": lambda rng, shape: rng.uniform(-1, 1, shape),
    "normal": lambda rng, shape: rng.normal(0.3, 1.0, shape),
    "ties": lambda rng, shape: rng.integers(-2, 3, shape),
    "half ties": lambda rng, shape: rng.integers(-3, 3, shape) + 0.5,
    "alternating": lambda rng, shape: (
        rng.uniform(0.01, 1, shape) * (1 - 2 * (np.indices(shape).sum(axis=0) % 2))
    ),
}


def random_volumes(count, seed):
    """So many volumes of two to five nodes an axis, every kind in turn, every second one closed."""
    rng, kinds = np.random.default_rng(seed), list(KINDS.values())
    for number in range(count):
        values = kinds[number % len(kinds)](rng, rng.integers(2, 6, 3)).astype(np.float32)
        yield np.pad(values, 1, constant_values=-1) if number // len(kinds) % 2 else values


def side_by_side(volumes):
    """One field of all volumes, nodes without data between them, and the volume of each cell [k, j, i]."""
    volumes = list(volumes)
    across = int(np.ceil(len(volumes) ** (1 / 3)))
    field = np.full((across * PITCH,) * 3, np.nan, np.float32)
    place = np.arange(across * PITCH - 1) // PITCH
    blocks = (place[:, None, None] * across + place[:, None]) * across + place
    for number, values in enumerate(volumes):
        k, j, i = (PITCH * int(n) for n in np.unravel_index(number, (across,) * 3))
        field[k : k + values.shape[0], j : j + values.shape[1], i : i + values.shape[2]] = values
    return volume_of(field), blocks, across**3


def mesh_topology(surface, grid, block_of_cell, blocks):
    """The topology of each block's part of the mesh."""
    corners, count = surface.mesh.faces.numpy()[:, :3].astype(np.int64), len(surface.placement.cell)
    k, j, i = np.unravel_index(surface.placement.cell.numpy(), grid.distance.shape)
    block = block_of_cell[k, j, i]
    pairs, uses = np.unique(vertex_pairs(corners), return_counts=True)
    assert uses.max() <= 2
    size = corners.max() + 1
    ends = np.stack([pairs // size, pairs % size])
    graph = coo_array((np.ones(len(pairs)), tuple(ends)), shape=(count, count))
    number, component = connected_components(graph, directed=False)
    is_open = np.zeros(number, bool)
    is_open[component[ends[0][uses == 1]]] = True
    block_of_component = np.zeros(number, int)
    block_of_component[component] = block

    def of_blocks(parts):
        return np.bincount(parts, minlength=blocks)

    euler = of_blocks(block) - of_blocks(block[ends[0]]) + of_blocks(block[corners[:, 0]])
    b0, b2 = of_blocks(block_of_component), of_blocks(block_of_component[~is_open])
    return Topology(euler=euler, b0=b0, b1=b0 + b2 - euler, b2=b2, tunnels=np.zeros(blocks, int))


def assert_right(extract, volumes, triangulation):
    volume, block_of_cell, blocks = side_by_side(volumes)
    chosen = SurfaceSettings(isovalue=0.0, method="tmc", triangulation=triangulation)
    grid = cut_grid(volume, chosen)
    expected = topology_of_blocks(grid, block_of_cell, blocks)
    surface = extract(volume, method="tmc", triangulation=triangulation)
    found = mesh_topology(surface, grid, block_of_cell, blocks)
    np.testing.assert_array_equal(found.rows()[:, :4], expected.rows()[:, :4])
    assert surface.counts.tunnel_cells == expected.tunnels.sum()
    return expected


def test_the_closed_form_is_that_of_the_reference_volumes():
    """Betti numbers that were found by refining the volumes, without decider or lines."""
    names = ("euler", "b0", "b1", "b2", "tunnel_cells")
    volumes, rows = [], table("betti_random.csv")
    for row in rows:
        n = int(row["n"])
        values = np.random.default_rng(int(row["seed"])).uniform(-1, 1, (n, n, n)).astype(np.float32)
        volumes.append(np.pad(values, 1, constant_values=-1) if row["border"] == "closed" else values)
    volume, block_of_cell, blocks = side_by_side(volumes)
    grid = Grid(volume.values.astype(float), np.isfinite(volume.values), padded=False)
    found = topology_of_blocks(grid, block_of_cell, blocks).rows()[: len(rows)]
    np.testing.assert_array_equal(found, [[int(row[name]) for name in names] for row in rows])


@pytest.mark.parametrize("triangulation", ["best", "standard"])
def test_some_volumes(extract, triangulation):
    expected = assert_right(extract, random_volumes(300, 1), triangulation)
    assert expected.tunnels.sum() > 10


@pytest.mark.slow
@pytest.mark.parametrize("triangulation", ["best", "standard"])
def test_ten_thousand_volumes(extract, triangulation):
    expected = assert_right(extract, random_volumes(10_000, 7), triangulation)
    assert expected.tunnels.sum() > 1000


def assert_right_as_a_whole(extract, volume, isovalue, border):
    grid = cut_grid(volume, SurfaceSettings(isovalue=isovalue, method="tmc", border=border))
    expected = topology_of_blocks(grid, np.zeros(grid.cell_shape[::-1], int), 1)
    surface = extract(volume, isovalue, method="tmc", border=border, threads=2)
    found = mesh_topology(surface, grid, np.zeros(grid.distance.shape, int), 1)
    assert found.rows()[0, :4].tolist() == expected.rows()[0, :4].tolist()
    assert surface.counts.tunnel_cells == expected.tunnels[0]
    return expected


@pytest.mark.real
def test_a_tooth(extract, sample_data):
    volume = read_volume(str(sample_data / "nrrd" / "tooth.nrrd"), ReadSettings())
    assert_right_as_a_whole(extract, volume, 500.0, "closed")


@pytest.mark.slow
@pytest.mark.real
@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("name", ["tooth", "bone", "engine", "fetal"])
def test_scans(extract, shared_data, name, border):
    place = REAL_NAMES[name]
    assert_right_as_a_whole(extract, read_real_volume(shared_data, place), REAL_VOLUMES[place][0], border)
