"""The kernels agree with the oracle: the same vertices in the same order, each polygon triangulated."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.contouring.dual_marching_cubes.test_agreement import packed_cells
from tests.contouring.edge_agreement import assert_marching_cubes
from tests.fields import one_inside_node, plane, smooth_noise, touching_nodes, volume_of, white_noise
from tests.oracle.edge_mesh import edges_with_two_fans
from tests.oracle.grid import cut_grid
from tests.strategies import FLOAT_TYPES, INTEGER_TYPES, LEVELS, noise_volumes, volumes

EXAMPLES = 3 * settings.default.max_examples


def assert_agrees(extract, volume, isovalue=0.0, **chosen):
    surface = extract(volume, isovalue, method="mc", **chosen)
    assert_marching_cubes(surface, volume, SurfaceSettings(isovalue=isovalue, method="mc", **chosen))


@pytest.fixture(params=["best", "standard"])
def triangulation(request):
    return request.param


@pytest.fixture(params=["open", "closed"])
def border(request):
    return request.param


@st.composite
def settings_for(draw, volume):
    return SurfaceSettings(
        isovalue=volume.slope * draw(st.sampled_from(LEVELS)) + volume.intercept,
        method="mc",
        inside=draw(st.sampled_from(["above", "below"])),
        triangulation=draw(st.sampled_from(["best", "standard"])),
        border=draw(st.sampled_from(["open", "closed"])),
        orientation=draw(st.sampled_from(["outward", "gradient"])),
    )


@settings(max_examples=EXAMPLES, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_volume_with_any_settings_agrees(device, data):
    volume = data.draw(st.one_of(volumes(), noise_volumes()))
    chosen = data.draw(settings_for(volume))
    assert_marching_cubes(extract_on(device, volume, chosen), volume, chosen)


@pytest.mark.parametrize("method", ["mc", "tmc"])
def test_nodes_without_data_are_on_the_isovalue_where_the_largest_value_is(extract, method):
    values = np.zeros((2, 2, 2), np.float32)
    values[1, 1] = 1, 3
    volume, chosen = volume_of(values, padding=(0.0, 0.0)), {"inside": "below", "border": "closed"}
    surface = extract(volume, 3.0, method=method, **chosen)
    assert_marching_cubes(surface, volume, SurfaceSettings(isovalue=3.0, method=method, **chosen))


def test_every_case_agrees(extract, triangulation, border):
    assert_agrees(extract, packed_cells(), triangulation=triangulation, border=border)


@pytest.mark.parametrize("make", [one_inside_node, touching_nodes, plane, lambda: white_noise(14)])
def test_plain_shapes_agree(extract, make, border):
    assert_agrees(extract, make(), border=border)


@pytest.mark.parametrize("nx", [2, 3, 31, 32, 33, 63, 64, 65, 257, 258, 512, 513, 545])
def test_rows_of_any_length_agree(extract, nx, border):
    values = np.random.default_rng(nx).standard_normal((3, 4, nx)).astype(np.float32)
    assert_agrees(extract, volume_of(values), border=border)


@pytest.mark.parametrize("dtype", INTEGER_TYPES + FLOAT_TYPES)
def test_values_of_every_type_agree(extract, dtype, border):
    values = np.random.default_rng(3).integers(0, 7, (7, 8, 40)).astype(dtype)
    assert_agrees(extract, volume_of(values), 3.0, border=border)


@pytest.mark.parametrize("inside", ["above", "below"])
def test_holes_agree(extract, inside, border):
    values = smooth_noise(12).values.copy()
    values[np.random.default_rng(2).random(values.shape) < 0.04] = np.nan
    assert_agrees(extract, volume_of(values), border=border, inside=inside)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("is_far", [True, False])
def test_two_fans_at_an_edge_have_a_vertex_each(extract, axis, is_far, triangulation):
    """Of the four cells at the edge in the middle only two exist, opposite each other."""
    values = np.full((3, 3, 3), -1.0, np.float32)
    values[1, 1, 1] = 1.0
    a, b = (n for n in range(3) if n != axis)
    for side, other in [(0, 2), (2, 0)] if is_far else [(0, 0), (2, 2)]:
        hole = [1, 1, 1]
        hole[2 - a], hole[2 - b] = side, other
        hole[2 - axis] = slice(None)
        values[tuple(hole)] = np.nan
    volume = volume_of(values)
    grid = cut_grid(volume, SurfaceSettings(isovalue=0.0, method="mc"))
    assert len(edges_with_two_fans(grid)) == 2
    surface = extract(volume, method="mc", triangulation=triangulation)
    assert_agrees(extract, volume, triangulation=triangulation)
    assert len(surface.placement.cell) == surface.counts.crossed_edges + 2
