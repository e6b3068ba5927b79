"""The kernels agree with the oracle: same counts, same polygons, same quads."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import assert_same_surface, extract_on
from tests.fields import (
    NON_MANIFOLD_ISOVALUES,
    non_manifold_volume,
    one_inside_node,
    plane,
    touching_nodes,
    volume_of,
    white_noise,
)
from tests.oracle.realizations import realizable_cells
from tests.oracle.surface import extract_oracle_surface
from tests.strategies import FLOAT_TYPES, INTEGER_TYPES, volumes_with_settings

EXAMPLES = 5 * settings.default.max_examples
"""Small volumes are cheap to cut: many more than the profile's number."""

WIDTHS = (2, 31, 32, 33, 64, 65)
FURTHER_WIDTHS = (3, 34, 63, 95, 96, 97)
"""Nodes along x: words of bits hold 32."""


def packed_cells():
    """Every case with every set of decisions in one volume, outside nodes between them."""
    cells = realizable_cells()
    across = 9
    values = np.full((3 * (-(-len(cells) // across**2)) + 1, 3 * across + 1, 3 * across + 1), -0.7)
    for number, (_, _, corners) in enumerate(cells):
        i, j, k = (1 + 3 * (number // across**n % across) for n in range(3))
        values[k : k + 2, j : j + 2, i : i + 2] = corners.reshape(2, 2, 2)
    return volume_of(values.astype(np.float32))


def assert_agrees(extract, volume, isovalue=0.0, **chosen):
    oracle = extract_oracle_surface(volume, SurfaceSettings(isovalue=isovalue, **chosen))
    assert_same_surface(extract(volume, isovalue, **chosen), oracle)


@pytest.fixture(params=["asymptotic", "manifold"])
def topology(request):
    return request.param


@pytest.fixture(params=["open", "closed"])
def border(request):
    return request.param


@pytest.fixture(params=["above", "below"])
def inside(request):
    return request.param


def test_every_case_under_all_decisions(extract, topology, inside):
    assert_agrees(extract, packed_cells(), topology=topology, inside=inside)


@pytest.mark.parametrize("make", [one_inside_node, touching_nodes, plane])
def test_simple_volumes(extract, make, topology, border, inside):
    assert_agrees(extract, make(), topology=topology, border=border, inside=inside)


@pytest.mark.parametrize("name", NON_MANIFOLD_ISOVALUES)
def test_non_manifold_volumes(extract, name, topology, border):
    isovalue = NON_MANIFOLD_ISOVALUES[name]
    assert_agrees(extract, non_manifold_volume(name), isovalue, topology=topology, border=border)


@given(volumes_with_settings())
@settings(max_examples=EXAMPLES, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_small_volume(device, drawn):
    volume, chosen = drawn
    assert_same_surface(extract_on(device, volume, chosen), extract_oracle_surface(volume, chosen))


@pytest.mark.parametrize("nx", [*WIDTHS, *(pytest.param(n, marks=pytest.mark.slow) for n in FURTHER_WIDTHS)])
def test_noise_of_any_width(extract, nx, topology, border):
    noise = np.random.default_rng(nx).standard_normal((4, 5, nx)).astype(np.float32)
    assert_agrees(extract, volume_of(noise), topology=topology, border=border)


@pytest.mark.parametrize("share", [pytest.param(0.02, marks=pytest.mark.slow), 0.1])
@pytest.mark.parametrize("nx", [31, 33, 65])
def test_noise_with_missing_nodes_of_any_width(extract, nx, share, topology, border):
    rng = np.random.default_rng(nx)
    noise = rng.standard_normal((6, 7, nx)).astype(np.float32)
    noise[rng.random(noise.shape) < share] = np.nan
    assert_agrees(extract, volume_of(noise), topology=topology, border=border)


@pytest.mark.parametrize("slope", [1.0, -1.0])
@pytest.mark.parametrize("dtype", INTEGER_TYPES + FLOAT_TYPES)
def test_noise_of_any_type(extract, dtype, slope, border):
    values = np.random.default_rng(1).integers(0, 100, (6, 7, 40)).astype(dtype)
    volume = volume_of(values, slope=slope, padding=(0, 1))
    assert_agrees(extract, volume, slope * 50.0, border=border)


@pytest.mark.parametrize("dtype", ["int8", "int16", "int32", "int64", "float32", "float64"])
def test_noise_of_negative_values(extract, dtype):
    values = np.random.default_rng(2).integers(-100, 100, (6, 7, 40)).astype(dtype)
    assert_agrees(extract, volume_of(values), -3.0, border="closed")


@pytest.mark.parametrize("dtype", ["uint8", "int8", "uint16", "int16", "uint32", "int32"])
def test_noise_over_the_whole_range_of_a_type(extract, dtype):
    limits = np.iinfo(dtype)
    values = np.random.default_rng(3).integers(limits.min, limits.max, (6, 7, 40), dtype, endpoint=True)
    assert_agrees(extract, volume_of(values), (limits.min + limits.max) / 2.0, border="closed")


@pytest.mark.slow
def test_white_noise(extract, topology, border):
    assert_agrees(extract, white_noise(40), topology=topology, border=border)
