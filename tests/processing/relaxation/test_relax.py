"""Relaxation: better shapes, the same quads, no fold, and every vertex still on the surface."""

import numpy as np
import pytest
from hypothesis import given, settings

from dmc_cli.contouring import connect_faces
from dmc_cli.field import upload_volume
from dmc_cli.measures import list_elements
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.contouring.dual_marching_cubes.real import REAL_VOLUMES, read_real_volume
from tests.fields import (
    one_cell,
    one_inside_node,
    paper_field,
    plane,
    smooth_noise,
    sphere,
    volume_of,
    white_noise,
)
from tests.mesh.meshes import relaxed as relaxed_by
from tests.oracle.grid import cut_grid
from tests.oracle.trilinear import distances_at
from tests.strategies import volumes_with_settings

OBLIQUE = np.array([[0.3, 0.1, 0, -100], [-0.1, 0.3, 0.2, 50], [0, 0.05, -2, 7], [0, 0, 0, 1]])


def oblique_noise():
    return volume_of(smooth_noise(20, sigma=1.5).values, affine=OBLIQUE)


def noise_with_holes():
    values = smooth_noise(24, sigma=1.5, seed=3).values.copy()
    values[np.random.default_rng(0).random(values.shape) < 0.01] = np.nan
    return volume_of(values)


def integers():
    rng = np.random.default_rng(5)
    return volume_of(np.cumsum(rng.integers(-2, 3, (16, 17, 18)), axis=0).astype(np.int16))


VOLUMES = {
    "sphere": (sphere, 0.0),
    "iwp": (lambda: paper_field("iwp", 48), 0.0),
    "genus two": (lambda: paper_field("genus_two", 64), 0.0),
    "smooth noise": (lambda: smooth_noise(32, sigma=1.5), 0.0),
    "white noise": (lambda: white_noise(16), 0.0),
    "oblique noise": (oblique_noise, 0.0),
    "holes": (noise_with_holes, 0.0),
    "integers": (integers, 1.0),
}


@pytest.fixture(params=VOLUMES)
def volume_and_isovalue(request):
    make, isovalue = VOLUMES[request.param]
    return make(), isovalue


@pytest.fixture(params=["open", "closed"])
def border(request):
    return request.param


def quad_shapes(surface):
    """Equation 9, negative at a corner that turns against its quad, (Q,)."""
    p = surface.mesh.positions.numpy().astype(np.float64)[surface.mesh.faces.numpy()]
    after = np.roll(p, -1, axis=1) - p
    before = np.roll(after, 1, axis=1)
    normal = np.cross(after[:, 0] - after[:, 2], after[:, 1] - after[:, 3])
    cross = np.cross(before, after)
    sign = np.where((cross * normal[:, None]).sum(axis=-1) < 0, -1.0, 1.0)
    squares = (before**2).sum(axis=-1) + (after**2).sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        shapes = np.where(squares > 0, 2 * sign * np.linalg.norm(cross, axis=-1) / squares, 0.0)
    return shapes.min(axis=1)


def folded_corners(surface, grid):
    """How many corners turn against the surface's gradient at their vertex."""
    gradient = gradients(surface, grid)[surface.mesh.faces.numpy()]
    p = surface.mesh.positions.numpy().astype(np.float64)[surface.mesh.faces.numpy()]
    after = np.roll(p, -1, axis=1) - p
    cross = np.cross(np.roll(after, 1, axis=1), after)
    return int(((cross * gradient).sum(axis=-1) > 0).sum())  # outward: towards lower values


def gradients(surface, grid):
    """The gradient of the trilinear interpolant at the vertices, in the output space."""
    cells, local = surface.placement.cell.numpy(), surface.placement.local.numpy().astype(np.float64)
    slopes = []
    for axis in range(3):
        low, high = local.copy(), local.copy()
        low[:, axis], high[:, axis] = 0.0, 1.0
        slopes.append(distances_at(grid, cells, high) - distances_at(grid, cells, low))
    return np.stack(slopes, axis=1) @ np.linalg.inv(surface.placement.frame.affine[:3, :3])


def relaxed(surface, steps=5):
    return relaxed_by(connect_faces(surface), steps)


def test_shapes_get_better_and_none_is_worse_than_the_worst(extract, volume_and_isovalue, border):
    surface = extract(*volume_and_isovalue, border=border, threads=2)
    before, after = quad_shapes(surface), quad_shapes(relaxed(surface))
    assert after.mean() > before.mean() + 0.001
    assert after.min() >= before.min() - 1e-5


def test_vertices_stay_on_the_surface_and_in_cells_with_data(extract, volume_and_isovalue, border):
    volume, isovalue = volume_and_isovalue
    surface = relaxed(extract(volume, isovalue, border=border, threads=2))
    grid = cut_grid(volume, SurfaceSettings(isovalue=isovalue, border=border))
    local = surface.placement.local.numpy()
    distance = np.abs(distances_at(grid, surface.placement.cell.numpy(), local))
    assert distance.max() <= 1e-5 * np.ptp(volume.values[np.isfinite(volume.values)].astype(float))
    assert local.min() >= 0
    assert local.max() <= 1


def test_positions_are_cell_plus_local_through_the_affine(extract, volume_and_isovalue):
    surface = relaxed(extract(*volume_and_isovalue))
    nx, ny = surface.placement.frame.grid.nx, surface.placement.frame.grid.ny
    cells = surface.placement.cell.numpy()
    index = (
        np.stack([cells % nx, cells // nx % ny, cells // nx // ny], axis=1) + surface.placement.local.numpy()
    )
    expected = index @ surface.placement.frame.affine[:3, :3].T + surface.placement.frame.affine[:3, 3]
    np.testing.assert_allclose(surface.mesh.positions.numpy(), expected, rtol=0, atol=2e-5)


def test_no_corner_turns_against_the_surface(extract, volume_and_isovalue):
    volume, isovalue = volume_and_isovalue
    surface = extract(volume, isovalue)
    grid = cut_grid(volume, SurfaceSettings(isovalue=isovalue))
    assert folded_corners(relaxed(surface), grid) <= folded_corners(surface, grid)


def folds_shapes_and_warps(surface):
    """Sides where two quads are over 90 degrees apart, each twice, and the quads' shapes and warps."""
    corners = surface.mesh.positions.numpy().astype(np.float64)[surface.mesh.faces.numpy()]
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    twin = surface.mesh.require_halfedges().twin.numpy()
    sides = np.flatnonzero(twin >= 0)
    is_fold = (normals[sides // 4] * normals[twin[sides] // 4]).sum(axis=1) < 0
    elements = list_elements(surface.mesh)
    return set(sides[is_fold].tolist()), elements["shape"], np.nan_to_num(elements["warpage"])


def assert_not_spoilt(before, after):
    """Fail if two quads fold that did not, or a quad but a sliver comes to be warped beyond the limit."""
    folds, shapes, warps = folds_shapes_and_warps(before)
    more, _, worse = folds_shapes_and_warps(after)
    assert more <= folds
    assert not ((worse > 30.01) & (warps <= 29.99) & ~(shapes <= 0.41)).any()


@pytest.mark.parametrize("nodes", [4, 5, 12])
def test_no_two_quads_fold_and_none_is_warped_beyond_the_limit(extract, nodes):
    """White noise on a few nodes is all folds: what is not one before is none afterwards."""
    for seed in range(6):
        surface = connect_faces(extract(white_noise(nodes, seed), border="closed" if seed % 2 else "open"))
        for steps in (1, 5):
            assert_not_spoilt(surface, relaxed_by(surface, steps))


def test_quads_stay_and_boundary_vertices_do_not_move(extract, volume_and_isovalue):
    surface = extract(*volume_and_isovalue)
    surface = connect_faces(surface)
    halfedges = surface.mesh.halfedges
    before, after = surface.mesh.positions.numpy().copy(), relaxed_by(surface, 3)
    np.testing.assert_array_equal(surface.mesh.faces.numpy(), after.mesh.faces.numpy())
    np.testing.assert_array_equal(surface.mesh.positions.numpy(), before)  # the caller's array
    open_halfedges = np.flatnonzero(halfedges.twin.numpy() < 0)
    corners = surface.mesh.faces.numpy().ravel()
    on_boundary = np.union1d(
        corners[open_halfedges], np.roll(surface.mesh.faces.numpy(), -1, 1).ravel()[open_halfedges]
    )
    np.testing.assert_array_equal(after.mesh.positions.numpy()[on_boundary], before[on_boundary])


def test_the_mean_shape_never_falls(extract):
    surface = extract(oblique_noise())
    means = [quad_shapes(relaxed(surface, steps)).mean() for steps in (0, 1, 2, 4, 30)]
    assert means == sorted(means)
    assert means[0] == quad_shapes(surface).mean()


def test_vertices_move_by_less_than_half_a_cell_a_step(extract, volume_and_isovalue):
    surface = extract(*volume_and_isovalue)
    way = relaxed(surface, 1).mesh.positions.numpy() - surface.mesh.positions.numpy()
    assert np.abs(way @ np.linalg.inv(surface.placement.frame.affine[:3, :3]).T).max() <= 0.5 + 1e-4


@pytest.mark.parametrize("turned", [{"orientation": "gradient"}, {"inside": "below"}, {}])
@pytest.mark.parametrize("mirrored", [False, True])
def test_orientation_and_mirrors_change_nothing(extract, turned, mirrored):
    values = paper_field("genus_two", 32).values
    plain = relaxed(extract(volume_of(values)))
    affine = np.diag([-1.0 if mirrored else 1.0, 1.0, 1.0, 1.0])
    other = relaxed(extract(volume_of(values, affine=affine), **turned))
    difference = np.abs(other.mesh.positions.numpy() @ affine[:3, :3] - plain.mesh.positions.numpy())
    assert np.quantile(difference, 0.9) < 1e-5  # a rounding may decide whether a step is halved
    assert difference.max() < 0.02


def test_the_same_bytes_on_one_thread_and_three(extract):
    one, three = (relaxed(extract(white_noise(20), threads=n)) for n in (1, 3))
    assert one.mesh.positions.numpy().tobytes() == three.mesh.positions.numpy().tobytes()
    for name in ("cell", "local"):
        found, expected = (getattr(other.placement, name).numpy() for other in (one, three))
        assert found.tobytes() == expected.tobytes()


@pytest.mark.parametrize(
    "volume",
    [one_cell(1), one_inside_node(), plane(3), white_noise(3)],
    ids=["none", "box", "one quad", "few"],
)
@pytest.mark.parametrize("topology", ["manifold", "asymptotic"])
def test_the_smallest_meshes_pass(extract, volume, topology):
    surface = extract(volume, topology=topology)
    after = relaxed(surface)
    assert after.mesh.vertex_count == surface.mesh.vertex_count
    assert np.isfinite(after.mesh.positions.numpy()).all()


def test_a_box_round_one_node_becomes_no_worse(extract):
    surface = extract(one_inside_node())
    assert quad_shapes(relaxed(surface)).min() >= quad_shapes(surface).min() - 1e-6


@given(volumes_with_settings())
@settings(max_examples=60)
def test_any_small_volume_passes_and_stays_on_its_surface(drawn):
    volume, chosen = drawn
    surface = extract_on("cpu", volume, chosen)
    surface = connect_faces(surface)
    after = relaxed(surface, 2)
    assert_not_spoilt(surface, after)
    local = after.placement.local.numpy()
    assert ((local >= 0) & (local <= 1)).all()
    if not surface.mesh.face_count:
        return
    assert quad_shapes(after).min() >= quad_shapes(surface).min() - 1e-4
    grid = cut_grid(volume, chosen)
    distance = np.abs(distances_at(grid, after.placement.cell.numpy(), local))
    assert distance.max() <= 1e-5 * np.ptp(grid.distance[grid.data])


@pytest.mark.parametrize("placement", ["sampled", "centroid"])
def test_vertices_off_the_surface_come_onto_it(extract, placement):
    volume = smooth_noise(24, sigma=2.0)
    surface = relaxed(extract(volume, placement=placement, border="closed"), 10)
    grid = cut_grid(volume, SurfaceSettings(isovalue=0.0, border="closed"))
    distance = np.abs(distances_at(grid, surface.placement.cell.numpy(), surface.placement.local.numpy()))
    assert np.median(distance) <= 1e-6 * np.ptp(volume.values)


def test_uneven_slices_are_relaxed_in_the_output_space(device):
    from dmc_cli.contouring import extract_surface
    from dmc_cli.runtime.device import select_device

    depths = np.concatenate([[0.0], np.cumsum(np.random.default_rng(1).uniform(0.6, 2.0, 24))])
    x, y, z = np.arange(33.0) - 16.0, np.arange(35.0) - 17.0, depths - depths.mean()
    values = 10.0 - np.sqrt(z[:, None, None] ** 2 + y[None, :, None] ** 2 + x[None, None, :] ** 2)
    affine = np.diag([1.0, 1.0, 1.5, 1.0])
    affine[:3, 3] = -16.0, -17.0, -depths.mean()
    volume = Volume(values=values, affine=affine, space="LPS", slice_positions=depths)
    surface = extract_surface(upload_volume(volume, select_device(device)), SurfaceSettings(isovalue=0.0))
    after = relaxed(surface, 10)
    assert np.abs(np.linalg.norm(after.mesh.positions.numpy(), axis=1) - 10.0).max() < 0.1
    assert quad_shapes(after).mean() > quad_shapes(surface).mean() + 0.02


QUICK_VOLUMES = ("nrrd_tooth/tooth.nhdr", "raw_microct_bone")


@pytest.mark.real
@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=() if n in QUICK_VOLUMES else pytest.mark.slow) for n in REAL_VOLUMES],
)
def test_real_volumes(extract, name, shared_data):
    volume, isovalue = read_real_volume(shared_data, name), REAL_VOLUMES[name][0]
    surface = extract(volume, isovalue, border="closed", threads=2)
    after = relaxed(surface)
    before_shape, after_shape = quad_shapes(surface), quad_shapes(after)
    assert after_shape.mean() > before_shape.mean() + 0.02
    assert after_shape.min() >= before_shape.min() - 1e-5
    grid = cut_grid(volume, SurfaceSettings(isovalue=isovalue, border="closed"))
    distance = distances_at(grid, after.placement.cell.numpy(), after.placement.local.numpy())
    low, high = volume.value_range()
    assert np.abs(distance).max() <= 1e-5 * (high - low)
