"""The papers' placements: where an oracle puts the vertices, and table 6 of the paper of 2021."""

import numpy as np
import pytest

from dmc_cli.contouring import kernel_modules
from dmc_cli.reproduction.paper_tables import IWP_512, DataSet
from dmc_cli.reproduction.reproduce_run import measure_data_sets
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import SurfaceSettings
from tests.fields import paper_field, smooth_noise, volume_of, white_noise
from tests.oracle.grid import cut_grid
from tests.oracle.placement import PLACEMENTS, corner_distances, interpolate
from tests.oracle.surface import extract_oracle_surface
from tests.oracle.trilinear import distances_at

VOLUMES = {
    "white noise": lambda: white_noise(9),
    "smooth noise": lambda: smooth_noise(12, sigma=1.0),
    "genus two": lambda: paper_field("genus_two", 20),
    "integers": lambda: volume_of(np.random.default_rng(3).integers(-50, 50, (8, 8, 8)).astype(np.int16)),
}
NEAR = 2e-4
"""Distance in cells between a point in single and in double precision."""


@pytest.fixture(params=VOLUMES)
def volume(request):
    return VOLUMES[request.param]()


@pytest.fixture(params=["asymptotic", "manifold"])
def topology(request):
    return request.param


def polygons_of_vertices(surface, oracle):
    """The cell and the polygon of each vertex, by the quads, which both have in the same order."""
    cells = surface.placement.cell.numpy()
    found = {}
    for corners, (_, expected) in zip(surface.mesh.faces.numpy().tolist(), oracle.quads, strict=True):
        by_cell = {oracle.grid.linear_index(vertex.cell): vertex for vertex in expected}
        found.update({corner: by_cell[cells[corner]] for corner in corners})
    return found


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_vertices_lie_where_the_oracle_puts_them(extract, volume, placement, topology):
    surface = extract(volume, placement=placement, topology=topology, threads=2)
    settings = SurfaceSettings(isovalue=0.0, placement=placement, topology=topology)
    oracle = extract_oracle_surface(volume, settings)
    polygons = polygons_of_vertices(surface, oracle)
    local = surface.placement.local.numpy()
    assert len(polygons) == len(local)
    elsewhere = failed = 0
    for v, vertex in polygons.items():
        f = corner_distances(oracle.grid, vertex.cell)
        expected, is_mean = PLACEMENTS[placement](f, vertex.polygon)
        elsewhere += np.abs(expected - local[v]).max() > NEAR
        failed += is_mean
    assert elsewhere <= 0.004 * len(local)  # two samples at the same distance, a solution at the box's edge
    assert abs(surface.counts.fallback_vertices - failed) <= 0.01 * len(
        local
    )  # |F| that is 0 but for rounding


def test_sampled_vertices_lie_on_the_surface_but_for_the_fallbacks(extract, volume):
    surface = extract(volume, placement="sampled")
    grid = cut_grid(volume, SurfaceSettings(isovalue=0.0))
    distance = np.abs(distances_at(grid, surface.placement.cell.numpy(), surface.placement.local.numpy()))
    off = np.count_nonzero(distance > 1e-5 * np.ptp(volume.values.astype(float)))
    assert off <= surface.counts.fallback_vertices


def test_iterative_lies_between_the_mean_and_the_surface(extract, volume):
    grid = cut_grid(volume, SurfaceSettings(isovalue=0.0))
    mean = {}
    for placement in ("centroid", "iterative"):
        surface = extract(volume, placement=placement)
        distance = distances_at(grid, surface.placement.cell.numpy(), surface.placement.local.numpy())
        mean[placement] = np.abs(distance).mean()
    assert 0 < mean["iterative"] < 0.4 * mean["centroid"]


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_placement_changes_nothing_but_positions(extract, volume, placement):
    exact, other = extract(volume), extract(volume, placement=placement)
    np.testing.assert_array_equal(exact.mesh.faces.numpy(), other.mesh.faces.numpy())
    np.testing.assert_array_equal(exact.placement.cell.numpy(), other.placement.cell.numpy())
    assert np.abs(exact.mesh.positions.numpy() - other.mesh.positions.numpy()).max() <= 1.0


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_one_thread_and_three_place_alike(extract, placement):
    one, three = (extract(white_noise(24), placement=placement, threads=n) for n in (1, 3))
    assert one.placement.local.numpy().tobytes() == three.placement.local.numpy().tobytes()


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_a_mesh_without_special_cells_and_one_without_any(extract, placement):
    assert len(extract(paper_field("genus_two", 32), placement=placement).mesh.faces) == 2372
    assert len(extract(white_noise(8), 50.0, placement=placement).mesh.faces) == 0


def test_a_run_loads_the_kernels_that_it_needs_only():
    chosen = [SurfaceSettings(isovalue=0.0, placement=name) for name in ("exact", "sampled")]
    exact, sampled = (
        {module.__name__.rpartition(".")[2] for module in kernel_modules(settings)} for settings in chosen
    )
    assert exact - sampled == {"exact_simd", "exact_scalar"}
    assert sampled - exact == {"paper"}


def test_the_interpolant_has_the_corner_values():
    f = np.arange(8.0)
    corners = np.array([(c & 1, c >> 1 & 1, c >> 2) for c in range(8)], dtype=float)
    np.testing.assert_array_equal(interpolate(f, corners), f)


def test_sampled_on_genus_two_64_has_the_papers_shapes():
    data = DataSet(field="genus_two", nodes=64)
    found = measure_data_sets(select_device("cpu", 2), [data], "sampled")[data.name, "dmc"]
    assert found["shape"] == pytest.approx(0.854, abs=5e-4)
    assert found["mean_ratio"] == pytest.approx(0.866, abs=5e-4)
    assert found["mean_deviation"] == pytest.approx(1.5e-2, rel=0.02)


@pytest.mark.slow
def test_sampled_on_iwp_512_has_the_papers_deviation():
    found = measure_data_sets(select_device("cpu", 2), [IWP_512], "sampled")[IWP_512.name, "dmc"]
    assert found["mean_deviation_1e4"] == pytest.approx(0.970, abs=5e-4)
    assert found["shape"] == pytest.approx(0.890, abs=5e-4)
    assert found["mean_ratio"] == pytest.approx(0.841, abs=5e-4)
