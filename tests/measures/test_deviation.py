"""Deviation against plain interpolation in NumPy, and on fields with known distances."""

import numpy as np
import pytest
import warp as wp
from hypothesis import given, strategies as st
from scipy.ndimage import map_coordinates

from dmc_cli.field.field import make_field, upload_volume
from dmc_cli.field.grid import grid_affine, grid_of
from dmc_cli.field.slices import slice_depths
from dmc_cli.measures.deviation import measure_deviation
from dmc_cli.measures.lists import list_deviation
from dmc_cli.mesh.placement import Placement, SurfaceFrame
from dmc_cli.runtime.device import Device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume


def make_volume(values, affine=None, slope=1.0, intercept=0.0):
    affine = np.eye(4) if affine is None else affine
    return Volume(values=values, affine=affine, space="none", slope=slope, intercept=intercept)


def placed(volume, isovalue, indices, local, device="cpu", border="open", threads=2):
    """Vertices in cells with these lowest nodes (i, j, k) of the grid."""
    on_device = Device(device, threads)
    uploaded = upload_volume(volume, on_device)
    settings = SurfaceSettings(isovalue=isovalue, border=border)
    grid = grid_of(volume.shape, 1 if border == "closed" else 0)
    i, j, k = np.asarray(indices).reshape(-1, 3).T
    cells = (i + grid.nx * (j + grid.ny * k)).astype(np.int64)
    depths = slice_depths(volume, grid, on_device)
    affine = grid_affine(volume.affine, grid)
    frame = SurfaceFrame(make_field(uploaded, settings), grid, affine, depths, 1.0, on_device)
    return Placement(
        wp.array(cells, dtype=wp.int64, device=device),
        wp.array(np.asarray(local).reshape(-1, 3), dtype=wp.vec3f, device=device),
        frame,
    )


def deviation_of(volume, isovalue, indices, local, device="cpu", border="open", threads=2):
    """Deviation of vertices in cells with these lowest nodes (i, j, k) of the grid."""
    placement = placed(volume, isovalue, indices, local, device, border, threads)
    return measure_deviation(placement, volume, volume.value_range())


def random_case(seed, count=700, shape=(5, 6, 7)):
    rng = np.random.default_rng(seed)
    indices = np.stack([rng.integers(0, n - 1, count) for n in shape[::-1]], axis=1)
    return rng, indices, rng.random((count, 3)).astype(np.float32)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32, np.float64])
def test_deviation_is_the_interpolants(dtype, device):
    rng, indices, local = random_case(5)
    values = (200 * rng.random((5, 6, 7))).astype(dtype)
    at = (indices + local.astype(float))[:, ::-1].T
    expected = np.abs(map_coordinates(values.astype(float), at, order=1) - 100.3)
    found = deviation_of(make_volume(values), 100.3, indices, local, device)
    rounding = 1e-5 if dtype == np.float32 else 1e-10
    assert found.mean == pytest.approx(expected.mean(), abs=rounding)
    assert found.rms == pytest.approx(np.sqrt((expected**2).mean()), abs=rounding)
    assert found.max == pytest.approx(expected.max(), abs=rounding)
    extent = float(values.max()) - float(values.min())
    assert found.max_relative == pytest.approx(expected.max() / extent, rel=1e-5)


def test_a_plane_gives_distances_in_millimetres_whatever_the_affine(device):
    rng, indices, local = random_case(6)
    affine = np.eye(4)
    affine[:3, :3] = rng.standard_normal((3, 3)) + 2 * np.eye(3)
    affine[:3, 3] = [10, -20, 30]
    normal = np.array([0.48, -0.6, 0.64])
    k, j, i = np.indices((5, 6, 7))
    nodes = np.stack([i, j, k], axis=-1) @ affine[:3, :3].T + affine[:3, 3]
    heights = nodes @ normal
    found = deviation_of(make_volume(3.0 * heights, affine), 7.5, indices, local, device)
    world = (indices + local.astype(float)) @ affine[:3, :3].T + affine[:3, 3]
    expected = np.abs(world @ normal - 2.5)
    assert found.mean_mm == pytest.approx(expected.mean(), rel=1e-9)
    assert found.max_mm == pytest.approx(expected.max(), rel=1e-9)
    assert found.max == pytest.approx(3 * expected.max(), rel=1e-9)


@pytest.mark.parametrize("slope", [2.0, -0.5])
def test_slope_and_intercept_give_physical_values(slope):
    rng, indices, local = random_case(7)
    values = rng.integers(0, 1000, (5, 6, 7)).astype(np.int16)
    plain = deviation_of(make_volume(values), 500.25, indices, local)
    scaled = deviation_of(
        make_volume(values, slope=slope, intercept=-40.0), slope * 500.25 - 40, indices, local
    )
    assert scaled.mean == pytest.approx(abs(slope) * plain.mean, rel=1e-12)
    assert scaled.max_relative == pytest.approx(plain.max_relative, rel=1e-12)
    assert scaled.mean_mm == pytest.approx(plain.mean_mm, rel=1e-12)


def test_an_integer_isovalue_is_measured_where_it_was_cut():
    values = np.zeros((2, 2, 2), dtype=np.uint8)
    values[:, :, 1] = 10
    found = deviation_of(make_volume(values), 5, [[0, 0, 0]], [[0.45, 0.2, 0.9]])
    assert found.max == pytest.approx(0.0, abs=1e-6)


def test_caps_of_a_closed_border_lie_half_a_cell_outside(device):
    values = np.full((2, 2, 2), 8.0, dtype=np.float32)
    values[0, 0, 0] = 0.0
    found = deviation_of(make_volume(values), 3.0, [[2, 1, 1]], [[0.5, 0.5, 0.5]], device, border="closed")
    assert found.max == pytest.approx(0.0, abs=1e-12)


def test_vertices_without_a_gradient_have_no_distance():
    flat = np.full((2, 2, 3), 4.0)
    flat[:, :, 2] = 6.0
    one = deviation_of(make_volume(flat), 5.0, [[0, 0, 0]], [[0.5, 0.5, 0.5]])
    assert (one.mean, one.mean_mm, one.max_mm) == (1.0, None, None)
    both = deviation_of(make_volume(flat), 5.0, [[0, 0, 0], [1, 0, 0]], [[0.5, 0.5, 0.5], [1.0, 0, 0]])
    assert (both.mean_mm, both.max_mm) == (0.5, 0.5)


def test_a_constant_volume_has_no_relative_deviation():
    found = deviation_of(make_volume(np.full((2, 2, 2), 4.0)), 5.0, [[0, 0, 0]], [[0.5, 0.5, 0.5]])
    assert (found.max, found.max_relative) == (1.0, None)


def test_no_vertices_have_no_deviation():
    found = deviation_of(make_volume(np.zeros((2, 2, 2))), 5.0, [], [])
    assert (found.mean, found.max, found.max_mm) == (None, None, None)


@given(st.integers(0, 10**6), st.sampled_from(["open", "closed"]))
def test_threads_do_not_show(seed, border):
    rng, indices, local = random_case(seed, count=300, shape=(3, 4, 3))
    volume = make_volume(rng.standard_normal((3, 4, 3)).astype(np.float32))
    one = deviation_of(volume, 0.1, indices, local, border=border, threads=1)
    assert deviation_of(volume, 0.1, indices, local, border=border, threads=3) == one
    assert one.mean <= one.rms <= one.max


def test_between_uneven_slices_millimetres_are_those_of_the_place(device):
    _, indices, local = random_case(8)
    positions = np.cumsum([0.0, 0.5, 3.0, 0.25, 1.0])
    heights = np.broadcast_to(positions[:, None, None], (5, 6, 7))
    affine = np.diag([2.0, 3.0, 0.75, 1.0])
    volume = Volume(values=2.0 * heights, affine=affine, space="none", slice_positions=positions)
    found = deviation_of(volume, 4.0, indices, local, device)
    k, w = indices[:, 2], local[:, 2].astype(float)
    expected = np.abs(positions[k] + w * np.diff(positions)[k] - 2.0)
    assert found.mean_mm == pytest.approx(expected.mean(), rel=1e-9)
    assert found.max_mm == pytest.approx(expected.max(), rel=1e-9)


@pytest.mark.parametrize("exponent", [-1040, -600, -160, 160, 600, 1010])
def test_values_of_any_size_have_the_same_distances(exponent):
    rng, indices, local = random_case(9)
    values = rng.standard_normal((5, 6, 7))
    plain = deviation_of(make_volume(values), 0.0, indices, local)
    found = deviation_of(make_volume(np.ldexp(values, exponent)), 0.0, indices, local)
    assert found.max_relative == pytest.approx(plain.max_relative, rel=1e-6)
    assert found.mean_mm == pytest.approx(plain.mean_mm, rel=1e-6)
    assert found.rms / found.mean == pytest.approx(plain.rms / plain.mean, rel=1e-3)


def test_a_vertex_beside_a_node_without_data_is_left_out():
    values = np.array([[[0.0, 4.0, np.nan]] * 2] * 2)
    found = deviation_of(make_volume(values), 1.0, [[0, 0, 0], [1, 0, 0]], [[0.5, 0.5, 0.5]] * 2)
    assert (found.mean, found.rms, found.max, found.mean_mm) == (1.0, 1.0, 1.0, 0.25)
    none = deviation_of(make_volume(values), 1.0, [[1, 0, 0]], [[0.5, 0.5, 0.5]])
    assert (none.mean, none.max, none.max_mm) == (None, None, None)


def test_a_vertex_on_the_surface_is_no_distance_away_though_there_is_no_gradient():
    flat = np.full((2, 2, 3), 5.0)
    flat[:, :, 2] = 7.0
    found = deviation_of(make_volume(flat), 5.0, [[0, 0, 0], [1, 0, 0]], [[0.5, 0.5, 0.5], [0.5, 0, 0]])
    assert (found.mean, found.mean_mm, found.max_mm) == (0.5, 0.25, 0.5)


@pytest.mark.parametrize("slope", [1.0, -0.5])
def test_the_list_has_the_deviation_of_each_vertex(device, slope):
    _, indices, local = random_case(9)
    values = 200 * np.random.default_rng(9).random((5, 6, 7))
    at = (indices + local.astype(float))[:, ::-1].T
    expected = np.abs(slope * (map_coordinates(values, at, order=1) - 100.3))
    volume = make_volume(values, slope=slope)
    placement = placed(volume, slope * 100.3, indices, local, device)
    found = list_deviation(placement, volume)
    assert found == pytest.approx(expected, abs=1e-10)
    assert found.max() == pytest.approx(measure_deviation(placement, volume, volume.value_range()).max)


def test_the_list_has_no_number_beside_a_node_without_data():
    values = np.array([[[0.0, 4.0, np.nan]] * 2] * 2)
    volume = make_volume(values)
    found = list_deviation(placed(volume, 1.0, [[0, 0, 0], [1, 0, 0]], [[0.5, 0.5, 0.5]] * 2), volume)
    assert found[0] == 1.0
    assert np.isnan(found[1])


def test_in_a_crossed_cell_the_surface_is_no_farther_than_the_cells_diagonal(device):
    """Near a saddle the quotient grows beyond any bound; where the surface is elsewhere it stays."""
    saddle = np.array([[1.1, -0.9], [-0.9, 1.1]])
    near = [0.5, 0.5 + 1e-4, 0.5]
    affine = np.diag([1.0, 2.0, 2.0, 1.0])
    crossed = make_volume(np.stack([saddle, saddle]), affine)
    assert deviation_of(crossed, 0.0, [0, 0, 0], near, device).max_mm == pytest.approx(3.0)
    slices = Volume(
        values=np.stack([saddle] * 3), affine=affine, space="none", slice_positions=np.array([0.0, 2.0, 8.0])
    )
    assert deviation_of(slices, 0.0, [0, 0, 1], near, device).max_mm == pytest.approx(np.sqrt(1 + 4 + 36))
    apart = make_volume(np.stack([saddle, saddle]) + 2, affine)
    assert deviation_of(apart, 0.0, [0, 0, 0], near, device).max_mm > 1000
