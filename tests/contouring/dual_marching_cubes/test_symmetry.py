"""Reruns, threads, scale and rotation do not change the surface; the complement changes it as it should."""

import numpy as np
import pytest

from tests.contouring.dual_marching_cubes.agreement import as_arrays
from tests.fields import paper_field, smooth_noise, volume_of, white_noise
from tests.oracle.grid import Grid
from tests.oracle.trilinear import cell_indices

VOLUMES = {
    "iwp": lambda: paper_field("iwp", 64),
    "white noise": lambda: white_noise(40),
    "smooth noise": lambda: smooth_noise(70),
}


@pytest.fixture(params=VOLUMES)
def volume(request):
    return VOLUMES[request.param]()


@pytest.fixture(params=["open", "closed"])
def border(request):
    return request.param


def cells_of_quads(surface, volume):
    """The cells of every quad's corners as indices, shape (Q, 4, 3), open border."""
    grid = Grid(volume.values, np.ones(volume.values.shape, dtype=bool), padded=False)
    return cell_indices(grid, surface.placement.cell.numpy())[surface.mesh.faces.numpy()]


def canonical(quads):
    """Quads as numbers of their cells, without regard to order: each starts at its least cell."""
    numbers = quads @ np.array([1, 1000, 1000000])
    turned = (np.arange(4) + numbers.argmin(axis=1)[:, None]) % 4
    turned = np.take_along_axis(numbers, turned, axis=1)
    return turned[np.lexsort(turned.T[::-1])]


@pytest.mark.parametrize("threads", [2, 3])
def test_the_bytes_are_the_same_for_any_number_of_threads(extract, volume, border, threads):
    alone, shared = (as_arrays(extract(volume, border=border, threads=n)) for n in (1, threads))
    for name, array in alone.items():
        assert array.tobytes() == shared[name].tobytes(), name


def test_the_bytes_are_the_same_on_a_rerun(extract, volume, border):
    first, second = (as_arrays(extract(volume, border=border)) for _ in range(2))
    for name, array in first.items():
        assert array.tobytes() == second[name].tobytes(), name


def test_doubling_the_spacing_doubles_the_coordinates(extract, volume):
    plain = extract(volume)
    doubled = extract(volume_of(volume.values, affine=np.diag([2.0, 2.0, 2.0, 1.0])))
    np.testing.assert_array_equal(2 * plain.mesh.positions.numpy(), doubled.mesh.positions.numpy())


def test_doubling_the_values_changes_nothing(extract, volume):
    plain, doubled = (as_arrays(extract(volume_of(factor * volume.values))) for factor in (1, 2))
    for name, array in plain.items():
        np.testing.assert_array_equal(array, doubled[name], name)


def test_slope_and_intercept_move_the_isovalue_only(extract, volume):
    plain = as_arrays(extract(volume))
    scaled = as_arrays(extract(volume_of(volume.values, slope=2.0, intercept=-1024.0), -1024.0))
    for name, array in plain.items():
        np.testing.assert_array_equal(array, scaled[name], name)


def test_negating_the_values_only_turns_the_quads_round(extract, volume):
    plain = extract(volume, topology="asymptotic")
    negated = extract(volume_of(-volume.values), topology="asymptotic")
    turned = cells_of_quads(negated, volume)[:, ::-1]
    np.testing.assert_array_equal(canonical(turned), canonical(cells_of_quads(plain, volume)))


def test_a_negative_slope_is_the_same_as_negated_values(extract, volume, border):
    negated = as_arrays(extract(volume_of(-volume.values), border=border))
    slope = as_arrays(extract(volume_of(volume.values, slope=-1.0), border=border))
    for name, array in negated.items():
        np.testing.assert_array_equal(array, slope[name], name)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_turning_the_volume_by_90_degrees_turns_its_quads(extract, axis):
    volume = volume_of(white_noise(20).values[:, :17, :14])
    first, second = [a for a in range(3) if a != axis]
    turned_values = np.rot90(volume.values, axes=(2 - first, 2 - second))
    turned = volume_of(turned_values)
    cells = cells_of_quads(extract(volume, topology="asymptotic"), volume)
    moved = cells.copy()
    # rot90 moves what was at (f, s) along the two axes to (length of s - 1 - s, f)
    moved[..., first] = volume.shape[second] - 2 - cells[..., second]
    moved[..., second] = cells[..., first]
    found = cells_of_quads(extract(turned, topology="asymptotic"), turned)
    np.testing.assert_array_equal(canonical(found), canonical(moved))
