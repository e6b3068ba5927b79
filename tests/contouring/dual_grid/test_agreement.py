"""The dual of the grid is the oracle's: its cells, its quads, its counts, whatever places the vertices."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_grid.agreement import assert_same_dual
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import NON_MANIFOLD_ISOVALUES, non_manifold_volume, volume_of
from tests.oracle.dual import extract_oracle_dual
from tests.oracle.edges import pair_use
from tests.strategies import FLOAT_TYPES, INTEGER_TYPES, volumes_with_settings

DUAL_METHODS = ["nets", "dc"]
EXAMPLES = 3 * settings.default.max_examples
WIDTHS = (2, 31, 32, 33, 64, 65)
"""Nodes along x: words of bits hold 32."""


@pytest.fixture(params=DUAL_METHODS)
def method(request):
    return request.param


@pytest.fixture(params=["open", "closed"])
def border(request):
    return request.param


def assert_agrees(extract, volume, isovalue=0.0, **chosen):
    oracle = extract_oracle_dual(volume, SurfaceSettings(isovalue=isovalue, **chosen))
    surface = extract(volume, isovalue, **chosen)
    assert_same_dual(surface, oracle)
    local = surface.placement.local.numpy()
    assert ((local >= 0) & (local <= 1)).all()


@given(volumes_with_settings(), st.sampled_from(DUAL_METHODS))
@settings(max_examples=EXAMPLES, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_small_volume(device, drawn, method):
    volume, drawn_settings = drawn
    shared = ("isovalue", "inside", "border", "orientation")
    chosen = SurfaceSettings(method=method, **{name: getattr(drawn_settings, name) for name in shared})
    surface = extract_on(device, volume, chosen)
    assert_same_dual(surface, extract_oracle_dual(volume, chosen))
    local = surface.placement.local.numpy()
    assert ((local >= 0) & (local <= 1)).all()


@pytest.mark.parametrize("nx", WIDTHS)
def test_noise_of_any_width(extract, nx, method, border):
    noise = np.random.default_rng(nx).standard_normal((4, 5, nx)).astype(np.float32)
    assert_agrees(extract, volume_of(noise), method=method, border=border)


@pytest.mark.parametrize("share", [0.1, 0.4])
@pytest.mark.parametrize("nx", [31, 33, 65])
def test_noise_with_missing_nodes_of_any_width(extract, nx, share, method, border):
    rng = np.random.default_rng(nx)
    noise = rng.standard_normal((6, 7, nx)).astype(np.float32)
    noise[rng.random(noise.shape) < share] = np.nan
    assert_agrees(extract, volume_of(noise), method=method, border=border)


@pytest.mark.parametrize("slope", [1.0, -1.0])
@pytest.mark.parametrize("dtype", INTEGER_TYPES + FLOAT_TYPES)
def test_noise_of_any_type(extract, dtype, slope, method, border):
    values = np.random.default_rng(1).integers(0, 100, (6, 7, 40)).astype(dtype)
    volume = volume_of(values, slope=slope, padding=(0, 1))
    assert_agrees(extract, volume, slope * 50.0, method=method, border=border, inside="below")


@pytest.mark.parametrize("name", NON_MANIFOLD_ISOVALUES)
def test_non_manifold_volumes(extract, name, method, border):
    volume = non_manifold_volume(name)
    assert_agrees(extract, volume, NON_MANIFOLD_ISOVALUES[name], method=method, border=border)


@pytest.mark.parametrize("nx", [31, 64])
def test_every_edge_of_a_closed_surface_has_two_or_four_quads(extract, nx, method):
    noise = np.random.default_rng(nx).standard_normal((9, 8, nx)).astype(np.float32)
    use = pair_use(extract(volume_of(noise), method=method, border="closed").mesh.faces.numpy())
    assert set(use.tolist()) == {2, 4}
