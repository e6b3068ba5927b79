"""With an index of bricks nodes are inside, and have data, exactly as without one, whatever came before."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.contouring.stages import indexed_classification
from dmc_cli.contouring.stages.classification import find_inside
from dmc_cli.field import grid_of, upload_volume
from dmc_cli.runtime import select_device
from dmc_cli.settings import SurfaceSettings
from tests.fields import volume_of, white_noise
from tests.strategies import FLOAT_TYPES, INTEGER_TYPES, settings_for, volumes


def bits(volume, settings):
    """Inside bits of the nodes there are, data bits or None, nodes without data.

    What the bits beyond a row's last node are means nothing: no cell there is ever active.
    """
    grid = grid_of(volume.volume.shape, int(settings.border == "closed"))
    found = find_inside(volume, settings, grid)
    volume.device.finish()
    data = None if found.data is None else found.data.numpy()
    of_nodes = np.packbits(np.arange(32 * grid.words) < grid.nx, bitorder="little").view(np.uint32)
    return found.inside.rows.numpy() & of_nodes, data, found.no_data_count


def assert_same(volume, settings, device="cpu", threads=2):
    """Each of the settings in turn gives the same bits with an index as without one."""
    on_device = select_device(device, threads)
    plain, indexed = upload_volume(volume, on_device), upload_volume(volume, on_device, indexed=True)
    for chosen in settings:
        for expected, found in zip(bits(plain, chosen), bits(indexed, chosen), strict=True):
            np.testing.assert_array_equal(expected, found)


@pytest.fixture(autouse=True)
def index_always(monkeypatch):
    """Look at the ranges however many bricks are crossed."""
    monkeypatch.setattr(indexed_classification, "MOST_CROSSED", 2.0)


@given(st.data())
def test_small_volumes_with_ties_padding_and_what_is_not_finite(data):
    volume = data.draw(volumes())
    assert_same(volume, [data.draw(settings_for(volume)) for _ in range(3)])


def test_bits_beyond_the_rows_of_a_padded_volume_mean_nothing(device):
    """Where padding is looked for and found nowhere, the last of these once had other bits there."""
    volume = volume_of(np.zeros((2, 2, 2), np.uint8), padding=(4.0, 4.0))
    assert_same(volume, [SurfaceSettings(isovalue=0.0, inside=side) for side in ("above", "above", "below")])


def blobs(dtype, shape):
    """Values in large pieces, so that bricks of all kinds are there; the ends are not on words."""
    coarse = np.random.default_rng(5).integers(0, 4, [-(-n // 9) for n in shape])
    values = coarse.repeat(9, 0).repeat(9, 1).repeat(9, 2)[tuple(map(slice, shape))]
    return values.astype(dtype)


@pytest.mark.parametrize("dtype", [*INTEGER_TYPES, *FLOAT_TYPES])
@pytest.mark.parametrize("border", ["open", "closed"])
def test_bricks_of_all_kinds(device, dtype, border):
    values = blobs(dtype, (19, 21, 100))
    for slope, padding, inside in ((1.0, None, "above"), (-1.0, (2.0, 2.0), "above"), (1.0, (3, 9), "below")):
        if np.dtype(dtype).kind == "f":
            values[3, 4, 37] = np.nan
            values[12] = np.inf
        volume = volume_of(values, slope=slope, padding=padding)
        levels = [slope * level for level in (0.5, 2.0, 99.0, -99.0, 1.5)]
        settings = [SurfaceSettings(isovalue=level, border=border, inside=inside) for level in levels]
        assert_same(volume, settings, device)


@pytest.mark.parametrize("shape", [(2, 2, 2), (8, 8, 32), (9, 9, 33), (2, 17, 31), (17, 2, 65)])
def test_ends_of_bricks(device, shape):
    values = np.random.default_rng(1).standard_normal(shape)
    levels = [0.0, 2.5, -2.5, 0.1]
    for border in ("open", "closed"):
        assert_same(volume_of(values), [SurfaceSettings(isovalue=x, border=border) for x in levels], device)


def test_ranges_are_those_of_the_bricks():
    values = np.random.default_rng(2).integers(-500, 500, (17, 20, 70)).astype(np.int16)
    volume = upload_volume(volume_of(values), select_device("cpu", 2), indexed=True)
    bits(volume, SurfaceSettings(isovalue=0.0))
    low, high = volume.index.ranges.low.numpy(), volume.index.ranges.high.numpy()
    assert low.shape == (3 * 3, 3)
    for row in range(9):
        for word in range(3):
            j, k, i = row % 3 * 8, row // 3 * 8, word * 32
            brick = values[k : k + 8, j : j + 8, i : i + 32]
            assert (low[row, word], high[row, word]) == (brick.min(), brick.max())


def test_where_most_bricks_are_crossed_all_values_are_read(monkeypatch):
    monkeypatch.setattr(indexed_classification, "MOST_CROSSED", 0.2)
    launched = []
    device = select_device("cpu", 2)
    volume = upload_volume(white_noise(20), device, indexed=True)
    begin = type(device).begin
    monkeypatch.setattr(
        type(device),
        "begin",
        lambda self, kernel, *rest: (launched.append(kernel.key), begin(self, kernel, *rest)),
    )
    for isovalue in (0.0, 0.1, 5.0):
        bits(volume, SurfaceSettings(isovalue=isovalue))
    names = [name.rpartition(".")[2] for name in launched]
    assert names == ["find_inside_and_ranges_kernel", "find_inside_kernel", "find_inside_by_ranges_kernel"]
