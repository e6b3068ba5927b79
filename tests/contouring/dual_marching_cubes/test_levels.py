"""Nodes are inside, and have data, by the rules also at the ends of types and between their numbers."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.contouring.stages.classification import find_inside
from dmc_cli.field import upload_volume
from dmc_cli.field.field import make_field, nodata_value
from dmc_cli.field.grid import grid_of
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import SurfaceSettings
from tests.fields import volume_of, white_noise
from tests.oracle.grid import cut_grid
from tests.oracle.trilinear import distances_at
from tests.strategies import FLOAT_TYPES

NARROW = ("uint8", "int8", "uint16", "int16", "uint32", "int32")


def bits_of(words, count):
    """Rows of words as rows of `count` booleans."""
    return np.unpackbits(words.view(np.uint8), axis=1, bitorder="little")[:, :count].astype(bool)


def inside_of(volume, isovalue, device, **settings):
    """Inside bits of the grid's nodes, data bits or None, and the number of nodes without data."""
    chosen = SurfaceSettings(isovalue=isovalue, **settings)
    on_device = select_device(device, 1)
    grid = grid_of(volume.shape, int(chosen.border == "closed"))
    found = find_inside(upload_volume(volume, on_device), chosen, grid)
    on_device.finish()
    data = None if found.data is None else bits_of(found.data.numpy(), grid.nx)
    return bits_of(found.inside.rows.numpy(), grid.nx), data, found.no_data_count


@pytest.mark.parametrize("slope", [1.0, -1.0])
@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("dtype", NARROW)
def test_isovalues_at_and_beyond_the_ends_of_integers(device, dtype, border, slope):
    ends = np.iinfo(dtype)
    values = np.random.default_rng(1).choice([ends.min, ends.min + 1, ends.max - 1, ends.max], (2, 3, 70))
    volume = volume_of(values.astype(dtype), slope=slope)
    for level in (
        ends.min - 1,
        ends.min - 0.5,
        ends.min,
        ends.min + 1,
        ends.max,
        ends.max + 0.5,
        ends.max + 1,
        1e300,
    ):
        settings = SurfaceSettings(isovalue=slope * level, border=border)
        found, data, absent = inside_of(volume, slope * level, device, border=border)
        expected = cut_grid(volume, settings).inside
        np.testing.assert_array_equal(found, expected.reshape(found.shape), str(level))
        assert (data, absent) == (None, 0)


@pytest.mark.parametrize("slope", [1.0, -1.0])
@pytest.mark.parametrize("dtype", FLOAT_TYPES)
@pytest.mark.parametrize(
    "ends", [(0.7, 0.7), (0.3, 0.3), (0.3, 0.7), (0.7, 0.9), (-0.3, 0.1), (-1e300, -0.7)]
)
def test_padding_between_the_numbers_of_a_type_takes_no_number_more(device, dtype, ends, slope):
    number = np.dtype(dtype).type
    near = [step for end in ends for step in neighbours(number, end)]
    values = np.resize(np.array([*near, 0.5, -5.0, 5.0], dtype), (2, 3, 40))
    volume = volume_of(values, slope=slope, padding=ends)
    _, data, absent = inside_of(volume, slope * 0.5, device)
    exact = values.astype(float)
    expected = (exact < ends[0]) | (exact > ends[1])
    assert absent == np.count_nonzero(~expected)
    if absent:
        np.testing.assert_array_equal(data, expected.reshape(data.shape))


def neighbours(number, value):
    """Return the numbers of a type nearest to a value, five in a row."""
    with np.errstate(over="ignore"):
        middle = number(value)
    below, above = np.nextafter(middle, number(-np.inf)), np.nextafter(middle, number(np.inf))
    found = [np.nextafter(below, number(-np.inf)), below, middle, above, np.nextafter(above, number(np.inf))]
    return [x for x in found if np.isfinite(x)] or [number(-6.0)]


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("padding", [(-3, -3), (250, 300), (-10, 10), (255, 255), (0, 254), (256, 300)])
def test_padding_at_and_beyond_the_ends_of_bytes(device, padding, border):
    values = np.random.default_rng(2).integers(0, 256, (3, 4, 65)).astype(np.uint8)
    volume = volume_of(values, padding=padding)
    found, data, absent = inside_of(volume, 128, device, border=border)
    grid = cut_grid(volume, SurfaceSettings(isovalue=128, border=border))
    np.testing.assert_array_equal(found, grid.inside.reshape(found.shape))
    has_data = (values < padding[0]) | (values > padding[1])
    assert absent == np.count_nonzero(~has_data)
    if border == "closed" or not absent:
        assert data is None
    else:
        np.testing.assert_array_equal(data, has_data.reshape(data.shape))


@pytest.mark.parametrize("row", range(4))
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", FLOAT_TYPES)
def test_one_bad_node_anywhere_in_a_row_is_counted(device, dtype, bad, row):
    for i in (0, 1, 31, 32, 63, 64, 69):
        values = np.ones((2, 2, 70), dtype)
        values[row // 2, row % 2, i] = bad
        found, data, absent = inside_of(volume_of(values), 0.5, device)
        assert absent == 1
        np.testing.assert_array_equal(data, np.isfinite(values).reshape(4, 70))
        assert not found[row, i]
        assert np.count_nonzero(found) == found.size - 1


@pytest.mark.parametrize("inside", ["above", "below"])
@pytest.mark.parametrize(("slope", "intercept"), [(1.0, 0.0), (-2.0, 3.0), (0.5, -1000.0)])
@pytest.mark.parametrize("dtype", ["int16", "float32", "float64"])
def test_vertices_beside_nodes_without_data_are_on_the_surface_of_the_extreme_value(
    extract, dtype, slope, intercept, inside
):
    values = np.clip(100 + 60 * white_noise(14).values, -300, 400).astype(dtype)
    values[np.random.default_rng(3).random(values.shape) < 0.05] = 999
    volume = volume_of(values, slope=slope, intercept=intercept, padding=(999, 999))
    settings = SurfaceSettings(isovalue=slope * 110.3 + intercept, border="closed", inside=inside)
    surface = extract(volume, settings.isovalue, border="closed", inside=inside)
    cells, local = surface.placement.cell.numpy(), surface.placement.local.numpy()
    distance = np.abs(distances_at(cut_grid(volume, settings), cells, local))
    assert distance.max() < 1e-5 * 700


@pytest.mark.parametrize(("inside", "expected"), [("above", -30.0), ("below", 10.0)])
@pytest.mark.parametrize("slope", [1.0, -1.0])
def test_without_data_a_node_is_as_far_as_the_extreme_off_the_object(inside, expected, slope):
    values = slope * np.array([[[-20.0, 5.0], [20.0, np.nan]], [[0.0, 0.0], [0.0, 0.0]]])
    volume = volume_of(values, slope=slope)
    uploaded = upload_volume(volume, select_device("cpu", 1))
    field = make_field(uploaded, SurfaceSettings(isovalue=10.0, inside=inside, border="closed"))
    assert nodata_value(volume, field) == expected
    assert (field.sign, field.outside) == (slope, -1.0 if inside == "above" else 1.0)


def test_where_all_nodes_are_without_data_one_is_a_unit_off_the_object():
    volume = volume_of(np.full((2, 2, 2), np.nan))
    uploaded = upload_volume(volume, select_device("cpu", 1))
    for inside, expected in (("above", -1.0), ("below", 1.0)):
        field = make_field(uploaded, SurfaceSettings(isovalue=0.0, inside=inside))
        assert nodata_value(volume, field) == expected


@pytest.mark.parametrize(
    ("dtype", "isovalue", "step"),
    [
        ("float32", 1.0, 2.0**-24),
        ("float32", 3.0, 2.0**-22),
        ("float64", 1.0, 2.0**-53),
        ("uint8", 1.0, 2.0**-54),
    ],
)
def test_the_least_step_is_that_to_the_next_lower_number(dtype, isovalue, step):
    uploaded = upload_volume(volume_of(np.zeros((2, 2, 2), dtype)), select_device("cpu", 1))
    assert make_field(uploaded, SurfaceSettings(isovalue=isovalue)).least == step
    assert make_field(uploaded, SurfaceSettings(isovalue=isovalue, inside="below")).least == 0


def test_the_values_are_handed_over_without_a_copy_and_kept_alive():
    values = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
    uploaded = upload_volume(volume_of(values), select_device("cpu", 1))
    assert uploaded.bytes.ptr == values.ctypes.data
    assert uploaded.bytes.shape == (6, 16)
    assert isinstance(uploaded.values, wp.array)


@pytest.mark.parametrize("dtype", FLOAT_TYPES)
def test_the_largest_number_may_be_the_isovalue_of_a_negative_slope(device, dtype):
    largest = float(np.finfo(dtype).max)
    values = np.full((2, 2, 40), largest, dtype)
    values[0, 0, 3] = 1.0
    found, _, absent = inside_of(volume_of(values, slope=-1.0), -largest, device)
    assert (found.all(), absent) == (True, 0)
