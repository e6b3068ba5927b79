"""The contour spectrum: what surfaces a volume has over the range of its values."""

import json

import numpy as np
import pytest

from dmc_cli.app import contour_spectrum
from dmc_cli.app.spectrum import MOST_STEPS, round_levels
from tests.fields import volume_of


def test_spheres_have_the_area_of_spheres():
    x, y, z = np.meshgrid(*[np.arange(-30.0, 31.0)] * 3)
    distance = np.sqrt(x * x + y * y + z * z)
    rows = contour_spectrum(volume_of((30 - distance).astype(np.float32)), [0.5, 10, 20, 31])
    assert [row["isovalue"] for row in rows] == [0.5, 10, 20, 31]
    assert [row["components"] for row in rows] == [1, 1, 1, 0]
    areas = [4 * np.pi * radius**2 for radius in (29.5, 20, 10)]
    np.testing.assert_allclose([row["area_mm2"] for row in rows], [*areas, 0.0], rtol=1e-2)
    assert rows[3] == {"isovalue": 31, "active_cells": 0, "active_percent": 0, "area_mm2": 0, "components": 0}


def test_active_cells_and_components_are_those_of_the_surface():
    values = np.zeros((6, 6, 20), np.uint8)
    values[2:4, 2:4, 2:4] = 10
    values[2:4, 2:4, 10:14] = 20
    low, high = contour_spectrum(volume_of(values), [5, 15])
    assert (low["components"], high["components"]) == (2, 1)
    assert (low["active_cells"], high["active_cells"]) == (3 * 3 * 3 - 1 + 3 * 3 * 5 - 3, 3 * 3 * 5 - 3)
    assert high["active_percent"] == pytest.approx(100 * high["active_cells"] / (5 * 5 * 19))


@pytest.mark.parametrize(
    ("ends", "levels"),
    [
        ((0.0, 1.0), [n / 20 for n in range(1, 20)]),
        ((-1024.0, 3063.0), list(range(-1000, 3001, 200))),
        ((0.0, 255.0), list(range(20, 241, 20))),
        ((0.1, 0.2), None),
        ((-3e-7, 5e8), None),
        ((5.0, 5.0), []),
        (None, []),
    ],
)
def test_levels_are_round_and_inside_the_range(ends, levels):
    found = list(round_levels(ends))
    assert len(found) <= MOST_STEPS
    assert ends is None or all(ends[0] < level < ends[1] for level in found)
    if levels is None:
        assert len(found) >= 8
        assert all(len(f"{level:.15g}") < 12 for level in found)
    else:
        assert found == pytest.approx(levels)


def test_info_lists_them_as_a_table_and_as_json(run):
    table = run("info", "synth:torus:24", "--isovalues").stdout
    assert "active cells" in table
    assert table.count("█") > 24
    told = json.loads(run("info", "synth:torus:24", "--isovalues", "-i", "-0.1:0.1:0.1", "--json").stdout)
    assert [row["isovalue"] for row in told["isovalues"]] == [-0.1, 0.0, 0.1]
    assert "isovalues" not in json.loads(run("info", "synth:torus:24", "--json").stdout)


def test_isovalues_with_nothing_to_list_are_refused(run):
    result = run("info", "synth:torus:24", "-i", 0)
    assert result.exit_code == 2
    assert "expected --isovalues" in result.stderr
