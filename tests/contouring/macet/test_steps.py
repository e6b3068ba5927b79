"""Each step of the way is that of the oracle: to the surface, towards the neighbours, back to the edges."""

import numpy as np
import pytest

from dmc_cli.settings import SurfaceSettings
from tests.contouring.macet.stages import stages_of
from tests.fields import paper_field, smooth_noise, sphere, volume_of, white_noise
from tests.oracle.edge_mesh import ordered_edges
from tests.oracle.grid import cut_grid
from tests.oracle.moved_edges import FAR, NEAR, middles, neighbor_means, settled, towards
from tests.triangles import radii_ratios


def with_hole():
    values = smooth_noise(14).values.copy()
    values[4:7, 5:9, 6:9] = np.nan
    return volume_of(values)


MAKERS = {
    "sphere": lambda: sphere(14),
    "smooth": lambda: smooth_noise(14),
    "hole": with_hole,
    "genus two": lambda: paper_field("genus_two", 24),
    "integers": lambda: volume_of((smooth_noise(14).values * 1e4).astype(np.int16)),
    "tiny": lambda: volume_of(smooth_noise(10).values.astype(float) * 1e-300),
    "huge": lambda: volume_of(smooth_noise(10).values.astype(float) * 1e300),
}


@pytest.fixture(params=MAKERS)
def volume(request):
    return MAKERS[request.param]()


@pytest.fixture(params=["open", "closed"])
def chosen(request):
    return SurfaceSettings(isovalue=0.0, method="macet", border=request.param)


def scaled_grid(volume, chosen):
    """The grid with numbers whose squares double precision holds: only ratios count."""
    grid = cut_grid(volume, chosen)
    size = np.nanmax(np.abs(grid.distance))
    return type(grid)(grid.distance / size, grid.data, grid.padded)


def assert_close(found, expected, share=0.002):
    """Fail unless all steps are alike but some at a limit, where rounding decides."""
    is_off = np.abs(found - expected).max(axis=1) > 2e-4
    assert is_off.mean() <= share, np.flatnonzero(is_off)


def test_middles_settle_as_the_oracle_has_it(device, volume, chosen):
    grid = scaled_grid(volume, chosen)
    edges = ordered_edges(grid)
    between = stages_of(device, volume, chosen)
    stay = (between.crossing - 0.5)[:, None] * np.eye(3)[edges[:, 0]]
    assert_close(between.first, settled(grid, edges, np.zeros((len(edges), 3)), stay, NEAR))


def test_neighbours_draw_as_the_oracle_has_it(device, volume, chosen):
    grid = scaled_grid(volume, chosen)
    edges = ordered_edges(grid)
    between = stages_of(device, volume, chosen)
    means = neighbor_means(middles(edges) + between.first, between.first_faces)
    start = towards(grid, edges, between.first.astype(float), means)
    assert_close(between.smooth, settled(grid, edges, start, between.first.astype(float), FAR))


@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (0.5, 2.0, 1.25)])
@pytest.mark.parametrize("make", [lambda: white_noise(12), lambda: smooth_noise(14)])
def test_vertices_of_bad_triangles_are_drawn_back_in_thirds(device, make, spacing):
    affine = np.diag([*spacing, 1.0])
    volume = volume_of(make().values, affine=affine)
    chosen = SurfaceSettings(isovalue=0.0, method="macet")
    edges = ordered_edges(cut_grid(volume, chosen))
    between = stages_of(device, volume, chosen)
    thirds = between.states >> 2
    assert (between.states & 3 == edges[:, 0]).all()
    on_edge = np.clip(between.crossing - 0.5, -0.1, 0.1)[:, None] * np.eye(3)[edges[:, 0]]
    expected = on_edge + (1 - thirds / 3)[:, None] * (between.smooth - on_edge)
    np.testing.assert_allclose(between.last, expected, atol=1e-6)
    assert (between.last[thirds == 0] == between.smooth[thirds == 0]).all()
    shapes, possible = (
        radii_ratios((middles(edges) + step) * spacing, between.faces) for step in (between.last, on_edge)
    )
    assert (shapes >= np.minimum(0.4, possible) - 2e-3).all()
    for vertex in np.flatnonzero(thirds):  # only vertices that had reason to
        assert thirds[vertex] <= 3


def test_vertices_beside_missing_cells_have_good_shapes(extract):
    """On their edges the guard can draw them to better places, in the cells that exist."""
    surface = extract(with_hole(), method="macet")
    assert radii_ratios(surface.mesh.positions.numpy(), surface.mesh.faces.numpy()).min() >= 0.36
