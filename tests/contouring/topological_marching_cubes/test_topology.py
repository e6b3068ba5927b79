"""What holds of every mesh: a manifold, the interpolant's Euler characteristic, the same bytes."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from dmc_cli.contouring import compute_normals
from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import as_arrays, extract_on
from tests.contouring.edge_agreement import assert_vertices
from tests.contouring.stages.closed_form import decided_euler_characteristic
from tests.fields import paper_field, smooth_noise, volume_of, white_noise
from tests.oracle.edge_mesh import edges_with_two_fans
from tests.oracle.edges import pair_use, pinched_vertices
from tests.oracle.faces import decide_faces
from tests.oracle.grid import Grid, cut_grid
from tests.oracle.trilinear import distances_at
from tests.strategies import noise_volumes, volumes
from tests.triangles import euler_characteristic

EXAMPLES = 3 * settings.default.max_examples


def assert_trilinear(surface, volume, chosen):
    """Fail unless the mesh is a manifold with the Euler characteristic of the closed form."""
    grid = cut_grid(volume, chosen)
    assert_vertices(surface, grid)
    faces = surface.mesh.faces.numpy()
    local = surface.placement.local.numpy()
    assert ((local >= 0) & (local <= 1)).all()
    if len(faces) == 0:
        return
    count = len(surface.placement.cell)
    assert len(np.unique(faces[:, :3])) == count, "a vertex belongs to no triangle"
    assert pair_use(faces[:, :3]).max() <= 2
    assert not pinched_vertices(faces[:, :3], count).any()
    found = decided_euler_characteristic(grid, decide_faces(grid))
    assert euler_characteristic(faces) == found - 2 * surface.counts.tunnel_cells


@settings(max_examples=EXAMPLES, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_volume_gives_a_manifold_with_the_topology_of_the_interpolant(device, data):
    volume = data.draw(st.one_of(volumes(), noise_volumes()))
    level = data.draw(st.sampled_from([0.0, 0.5, 1.0, 1.75, 2.0, 3.0]))
    chosen = SurfaceSettings(
        isovalue=volume.slope * level + volume.intercept,
        method="tmc",
        inside=data.draw(st.sampled_from(["above", "below"])),
        border=data.draw(st.sampled_from(["open", "closed"])),
        triangulation=data.draw(st.sampled_from(["best", "standard"])),
    )
    assert_trilinear(extract_on(device, volume, chosen), volume, chosen)


def random_cells(count, seed, values):
    """Single cells apart from each other, in a row of layers with outside nodes between them."""
    rng = np.random.default_rng(seed)
    across = 12
    layers = -(-count // across**2)
    field = np.full((3 * layers + 1, 3 * across + 1, 3 * across + 1), -1.0)
    for n in range(count):
        i, j, k = (1 + 3 * (n // across**a % across) for a in range(3))
        field[k : k + 2, j : j + 2, i : i + 2] = values(rng)
    return volume_of(field)


KINDS = {
    "uniform": lambda rng: rng.uniform(-1, 1, (2, 2, 2)),
    "ties": lambda rng: rng.integers(-3, 3, (2, 2, 2)) + 0.5,
    "labels": lambda rng: rng.choice([-0.5, 0.5], (2, 2, 2)),
    "alternating": lambda rng: rng.uniform(0.01, 1, (2, 2, 2)) * (1 - 2 * (CORNER_SUMS % 2)),
    "opposite corners": lambda rng: rng.uniform(0.01, 1, (2, 2, 2)) * np.where(CORNER_SUMS % 3, -0.2, 1),
}
CORNER_SUMS = np.indices((2, 2, 2)).sum(axis=0)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("sign", [1, -1])
def test_random_cells_are_manifold_with_the_topology_of_the_interpolant(extract, kind, sign):
    for seed in range(2):
        volume = random_cells(430, seed, lambda rng: sign * KINDS[kind](rng))
        assert_trilinear(extract(volume, method="tmc"), volume, chosen_for())


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_ten_thousand_random_cells_are_manifold(extract, kind):
    for seed in range(24):
        volume = random_cells(430, 100 + seed, KINDS[kind])
        assert_trilinear(extract(volume, method="tmc"), volume, chosen_for())


def chosen_for(**chosen):
    return SurfaceSettings(isovalue=0.0, method="tmc", **chosen)


def torn(shape, share):
    values = np.random.default_rng(shape[2]).standard_normal(shape).astype(np.float32)
    values[np.random.default_rng(1).random(shape) < share] = np.nan
    return volume_of(values)


@pytest.mark.parametrize("shape", [(6, 7, 31), (6, 7, 33), (5, 4, 66)])
@pytest.mark.parametrize("share", [0.03, 0.1, 0.2])
def test_noise_with_missing_nodes_is_manifold(extract, shape, share):
    volume = torn(shape, share)
    assert edges_with_two_fans(cut_grid(volume, chosen_for()))
    for triangulation in ("best", "standard"):
        surface = extract(volume, method="tmc", triangulation=triangulation)
        assert_trilinear(surface, volume, chosen_for(triangulation=triangulation))


@pytest.mark.parametrize("make", [lambda: white_noise(14), lambda: white_noise(9, seed=3)])
@pytest.mark.parametrize("border", ["open", "closed"])
def test_white_noise_is_manifold(extract, make, border):
    volume = make()
    assert_trilinear(extract(volume, method="tmc", border=border), volume, chosen_for(border=border))


def test_vertices_lie_on_the_surface(extract):
    volume = paper_field("iwp", 32)
    isovalue = -1 / 1024
    surface = extract(volume, isovalue, method="tmc")
    grid = Grid(volume.values.astype(float) - isovalue, np.ones(volume.values.shape, bool), padded=False)
    away = distances_at(grid, surface.placement.cell.numpy(), surface.placement.local.numpy())
    assert np.abs(away).max() < 1e-6
    assert surface.counts.tunnel_cells == 729


@pytest.mark.parametrize("threads", [2, 3])
@pytest.mark.parametrize("make", [lambda: white_noise(30), lambda: smooth_noise(70)])
def test_any_number_of_threads_makes_the_same_bytes(extract, make, threads):
    volume = make()
    one, several = (
        as_arrays(extract(volume, method="tmc", border="closed", threads=n)) for n in (1, threads)
    )
    for name, array in one.items():
        assert array.tobytes() == several[name].tobytes(), name


def test_without_special_cells_it_is_marching_cubes(extract):
    one, other = (as_arrays(extract(paper_field("genus_two", 32), method=name)) for name in ("mc", "tmc"))
    for name, array in one.items():
        assert array.tobytes() == other[name].tobytes(), name


@pytest.mark.parametrize("orientation", ["outward", "gradient"])
def test_triangles_run_the_same_way_and_with_the_normals(extract, orientation):
    chosen = chosen_for(border="closed", orientation=orientation)
    surface = extract(white_noise(12), method="tmc", border="closed", orientation=orientation)
    corners = surface.mesh.faces.numpy()[:, :3].astype(np.int64)
    sides = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    count = len(surface.placement.cell)
    assert sorted(sides @ [count, 1]) == sorted(sides @ [1, count])
    points = surface.mesh.positions.numpy()[corners]
    volume = np.einsum("fc,fc->", points[:, 0], np.cross(points[:, 1], points[:, 2])) / 6
    assert (volume > 0) == (orientation == "outward")
    assert np.isfinite(compute_normals(surface.placement, chosen).numpy()).all()
