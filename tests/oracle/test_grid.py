"""The isovalue in stored values, inside bits, no data and the closed border of the oracle."""

import numpy as np
import pytest

from dmc_cli.settings import SurfaceSettings
from tests.fields import volume_of
from tests.oracle.grid import cut_grid
from tests.oracle.inside import distances, stored_isovalue

INT16, FLOAT32 = np.dtype(np.int16), np.dtype(np.float32)


def cut(values, isovalue=0.0, **settings):
    attributes = {key: settings.pop(key) for key in ("slope", "padding") if key in settings}
    return cut_grid(volume_of(np.array(values), **attributes), SurfaceSettings(isovalue=isovalue, **settings))


def row(*values, dtype=np.float32):
    """Two by two equal rows along x."""
    return np.broadcast_to(np.array(values, dtype=dtype), (2, 2, len(values)))


@pytest.mark.parametrize(
    ("dtype", "isovalue", "slope", "intercept", "expected"),
    [
        (INT16, 300.0, 1.0, 0.0, 299.5),
        (INT16, 300.0, -1.0, 0.0, -299.5),
        (INT16, 300.25, 1.0, 0.0, 300.25),
        (INT16, 300.0, 2.0, -1000.0, 649.5),
        (INT16, 301.0, 2.0, -1000.0, 650.5),
        (INT16, 301.5, 2.0, -1000.0, 650.75),
        (FLOAT32, 300.0, 1.0, 0.0, 300.0),
        (FLOAT32, 0.1, 1.0, 0.0, float(np.float32(0.1))),
    ],
)
def test_the_stored_isovalue_avoids_integers_and_takes_the_type_of_floats(
    dtype, isovalue, slope, intercept, expected
):
    assert stored_isovalue(dtype, isovalue, slope, intercept) == expected


def test_a_node_at_the_isovalue_is_inside():
    assert (distances(np.array([1.0, 2.0, 3.0]), 2.0, 1.0) >= 0).tolist() == [False, True, True]


@pytest.mark.parametrize("slope", [1.0, -1.0, 0.5, -0.5])
def test_inside_integers_are_those_whose_physical_value_is_at_least_the_isovalue(slope):
    stored = np.arange(-20, 21, dtype=np.int16)
    for isovalue in (-3.0, 0.0, 0.25, 4.5, 5.0):
        inside = distances(stored, stored_isovalue(INT16, isovalue, slope, 0.0), slope) >= 0
        assert inside.tolist() == (slope * stored >= isovalue).tolist()


def test_nan_and_infinity_hold_no_data():
    assert cut(row(1, np.nan, np.inf, -np.inf)).data[0, 0].tolist() == [True, False, False, False]


def test_values_in_the_closed_padding_range_hold_no_data():
    grid = cut(row(-5, -4, -3, -2, dtype=np.int16), padding=(-4, -3))
    assert grid.data[0, 0].tolist() == [True, False, False, True]


def test_a_cell_with_a_corner_without_data_does_not_exist():
    values = np.zeros((2, 2, 4), dtype=np.float32)
    values[1, 0, 1] = np.nan
    assert cut(values).existing_cells()[0, 0].tolist() == [False, False, True]


def test_the_open_border_adds_no_node():
    assert cut(row(1, 2, 3)).distance.shape == (2, 2, 3)


def test_the_closed_border_mirrors_distances_to_the_outside():
    grid = cut(row(-3, 2, 5), border="closed")
    assert grid.distance.shape == (4, 4, 5)
    assert grid.distance[1, 1].tolist() == [-3, -3, 2, 5, -5]


def test_the_closed_border_of_a_node_at_the_isovalue_is_the_next_lower_number():
    grid = cut(row(1, 1, 1), isovalue=1.0, border="closed")
    assert grid.distance[0, 0, 0] == np.nextafter(np.float32(1), np.float32(0)) - 1.0


def test_the_closed_border_is_inside_bits_where_the_object_is_below():
    grid = cut(row(-3, 2, 5), inside="below", border="closed")
    assert grid.distance[1, 1].tolist() == [3, -3, 2, 5, 5]


def test_nodes_without_data_lie_at_the_lowest_finite_value_behind_a_closed_border():
    grid = cut(row(-3, np.nan, 5), border="closed")
    assert grid.distance[1, 1].tolist() == [-3, -3, -3, 5, -5]
    assert grid.data.all()


def test_nodes_without_data_lie_at_the_highest_finite_value_where_the_object_is_below():
    grid = cut(row(-3, np.nan, 5), inside="below", border="closed")
    assert grid.distance[1, 1].tolist() == [3, -3, 5, 5, 5]


def test_nodes_without_data_are_outside_even_if_every_finite_value_is_inside():
    grid = cut(row(3, np.nan, 5), border="closed")
    assert grid.distance[1, 1].tolist() == [-3, 3, -3, 5, -5]


def test_a_negative_slope_turns_distances_round():
    assert cut(row(-3, 2, 5), slope=-1.0).distance[0, 0].tolist() == [3, -2, -5]


@pytest.mark.parametrize("inside", ["above", "below"])
def test_a_volume_without_data_has_no_surface_behind_a_closed_border(inside):
    grid = cut(row(np.nan, np.nan, np.nan), border="closed", inside=inside)
    assert len(set(grid.inside.ravel().tolist())) == 1
