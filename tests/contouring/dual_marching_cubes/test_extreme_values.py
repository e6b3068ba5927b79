"""Values of any size and type give vertices in their cells, and a closed mesh where the border is closed."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from dmc_cli.contouring import compute_normals
from dmc_cli.contouring.stages import outcome
from dmc_cli.errors import EmptySurfaceError, MeshInvariantError
from dmc_cli.mesh.placement import refuse_lost
from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import as_arrays, extract_on
from tests.fields import smooth_noise, volume_of
from tests.strategies import FLOAT_TYPES, INTEGER_TYPES, shapes

EXAMPLES = 5 * settings.default.max_examples


def numbers(dtype):
    """Return numbers of a type at its ends, at 0 and 1 and next to them; of floats what is none, too."""
    if dtype.kind != "f":
        ends = np.iinfo(dtype)
        near = [0, 1, 2, ends.min, ends.min + 1, ends.max - 1, ends.max]
        return [number for number in near if ends.min <= number <= ends.max]
    ends = np.finfo(dtype)
    sizes = [0.0, ends.smallest_subnormal, 3 * ends.smallest_subnormal, ends.tiny, ends.max, ends.max / 2]
    sizes += [1.0, 1.0 + ends.eps, 1e-16, 1e-31, 1e16, 1e-20, 1e20, math.sqrt(ends.tiny), math.sqrt(ends.max)]
    both = [float(sign * dtype.type(size)) for size in sizes for sign in (1, -1)]
    return [*both, math.nan, math.inf, -math.inf]


@st.composite
def extreme_volumes(draw):
    """Draw a small volume of a few extreme numbers of its type, and settings that cut it at one of them."""
    dtype = np.dtype(draw(st.sampled_from(INTEGER_TYPES + FLOAT_TYPES)))
    known = numbers(dtype)
    some = draw(st.lists(st.sampled_from(known), min_size=1, max_size=4))
    values = draw(arrays(np.dtype(object), draw(shapes), elements=st.sampled_from(some), fill=st.nothing()))
    slope = draw(st.sampled_from([1.0, -1.0, 0.5, 1e300, -1e300, 1e-300, -1e-310]))
    intercept = draw(st.sampled_from([0.0, -1024.0, 1e-310, 1e308, -1e308]))
    level = draw(st.sampled_from([number for number in known + some if math.isfinite(number)]))
    isovalue = slope * float(level) + intercept
    assume(math.isfinite(isovalue))
    padding = draw(st.sampled_from([None, None, *[(n, n) for n in some if not math.isnan(n)]]))
    volume = volume_of(values.astype(dtype), slope=slope, intercept=intercept, padding=padding)
    return volume, SurfaceSettings(
        isovalue=isovalue,
        border=draw(st.sampled_from(["closed", "open"])),
        inside=draw(st.sampled_from(["above", "below"])),
        placement=draw(st.sampled_from(["exact", "exact", "sampled", "iterative", "centroid"])),
    )


def sides_of(quads):
    """Return the sides of quads as they run, (4 Q, 2)."""
    return np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)


def enclosed_volume(surface):
    """Return the volume that the quads enclose, in cells; positive if they look outwards."""
    a, b, c, d = (
        surface.mesh.positions.numpy().astype(float)[surface.mesh.faces.numpy()[:, n]] for n in range(4)
    )
    middle = 0.25 * (a + b + c + d)
    return sum(np.sum(middle * np.cross(p, q)) for p, q in ((a, b), (b, c), (c, d), (d, a))) / 6.0


def assert_sound(surface, is_closed):
    """Fail unless vertices are in their cells and the mesh is a manifold, closed if it is to be."""
    local, quads = surface.placement.local.numpy(), surface.mesh.faces.numpy()
    assert ((local >= 0) & (local <= 1)).all()
    assert np.isfinite(surface.mesh.positions.numpy()).all()
    sides = sides_of(quads)
    once, counts = np.unique(sides, axis=0, return_counts=True)
    assert (counts == 1).all(), "two quads run the same way along a side"
    if is_closed:
        assert {tuple(side) for side in once.tolist()} == {(b, a) for a, b in once.tolist()}
        assert enclosed_volume(surface) >= -1e-6


@given(extreme_volumes())
@settings(max_examples=EXAMPLES, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_value_of_any_type(device, drawn):
    volume, chosen = drawn
    try:
        surface = extract_on(device, volume, chosen)
    except EmptySurfaceError:
        stored = (chosen.isovalue - volume.intercept) / volume.slope
        assert (
            not abs(stored) <= np.finfo(volume.values.dtype if volume.values.dtype.kind == "f" else float).max
        )
    else:
        assert_sound(surface, is_closed=chosen.border == "closed")


def block(dtype, size=1.0, nodes=17):
    """Return a solid whose values rise from 0 at all its faces."""
    along = np.minimum(np.arange(nodes), np.arange(nodes)[::-1])
    depth = np.minimum.reduce(np.meshgrid(along, along, along))
    return volume_of((size * depth).astype(dtype))


@pytest.mark.parametrize("size", [1.0, 0.0, 1e-40])
@pytest.mark.parametrize("dtype", FLOAT_TYPES)
def test_the_cap_of_border_nodes_at_the_isovalue_lies_on_them(extract, dtype, size):
    surface = extract(block(dtype, size), 0.0, border="closed")
    assert_sound(surface, is_closed=True)
    assert enclosed_volume(surface) == pytest.approx(16.0**3, rel=1e-6)


@pytest.mark.parametrize("dtype", FLOAT_TYPES)
def test_no_data_beside_the_extreme_value_leaves_vertices_in_their_cells(extract, dtype):
    values = block(dtype, nodes=7).values.copy()
    values[3, 3, 3] = np.nan
    surface = extract(volume_of(values), 0.0, border="closed")
    assert_sound(surface, is_closed=True)
    assert enclosed_volume(surface) == pytest.approx(6.0**3)  # next to the isovalue, it takes a point away


@pytest.mark.parametrize("inside", ["above", "below"])
@pytest.mark.parametrize("dtype", FLOAT_TYPES)
def test_the_lowest_number_may_be_the_isovalue(extract, dtype, inside):
    lowest = float(np.finfo(dtype).min)
    values = np.full((3, 3, 3), lowest, dtype=dtype)
    values[1, 1, 1] = 1.0
    surface = extract(volume_of(values), lowest, border="closed", inside=inside)
    assert_sound(surface, is_closed=True)
    assert (enclosed_volume(surface) > 7.9) == (inside == "above")


@pytest.mark.parametrize("exponent", [-1060, -1000, -520, -120, -60, 60, 120, 500, 1010])
@pytest.mark.parametrize("border", ["open", "closed"])
def test_values_times_a_power_of_two_give_the_same_surface(extract, exponent, border):
    values = np.ldexp(np.round(np.ldexp(smooth_noise(14, sigma=1.0).values.astype(float), 10)), -10)
    plain = extract(volume_of(values), border=border)
    scaled = extract(volume_of(np.ldexp(values, exponent)), border=border)
    assert scaled.counts == plain.counts
    np.testing.assert_array_equal(scaled.mesh.faces.numpy(), plain.mesh.faces.numpy())
    moved = np.abs(scaled.placement.local.numpy() - plain.placement.local.numpy()).max(axis=1) > 1e-4
    assert np.mean(moved) < 0.005  # where two axes are as steep as each other


@pytest.mark.parametrize("dtype", ["uint8", "int32", "float32", "float64"])
def test_an_isovalue_beyond_every_number_is_told(extract, dtype):
    volume = volume_of(np.zeros((3, 3, 3), dtype), intercept=1e308, slope=1e-10)
    with pytest.raises(EmptySurfaceError, match=f"beyond every {dtype} number"):
        extract(volume, -1e308)


@pytest.mark.parametrize("isovalue", [1e308, 0.0])
def test_a_range_beyond_float64_has_a_surface(extract, isovalue):
    values = np.full((4, 4, 4), -1.5e308)
    values[1:3, 1:3, 1:3] = 1.5e308
    surface = extract(volume_of(values), isovalue)
    assert_sound(surface, is_closed=True)
    assert surface.placement.local.numpy().min() > 0
    normals = compute_normals(surface.placement, SurfaceSettings(isovalue=isovalue)).numpy()
    outwards = surface.mesh.positions.numpy() - 1.5
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    assert np.sum(normals * outwards, axis=1).min() > 0.9
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)


@pytest.mark.parametrize("placement", ["exact", "sampled", "iterative", "centroid"])
def test_a_vertex_outside_its_cell_is_never_kept(extract, placement, monkeypatch):
    monkeypatch.setattr(outcome, "nodata_value", lambda *_: math.nan)
    values = block("float32", nodes=6).values.copy()
    values[2, 3, 2] = np.nan
    with pytest.raises(MeshInvariantError, match=r"vertex \d+ lies at \(.*\) of its cell, one of \d+"):
        extract(volume_of(values), 0.5, border="closed", placement=placement)


def test_the_first_vertex_outside_its_cell_is_named():
    local = np.array([[0, 0.5, 1], [0.25, 1.5, 0], [np.nan, 0, 0]], np.float32)
    with pytest.raises(MeshInvariantError, match=r"vertex 1 lies at \(0.25, 1.5, 0\) of its cell, one of 2 "):
        refuse_lost(local)
    refuse_lost(local[:1])


def test_threads_place_extreme_values_alike(extract):
    values = np.random.default_rng(4).choice(numbers(np.dtype("float64")), (9, 10, 11))
    one, three = (extract(volume_of(values), border="closed", threads=n) for n in (1, 3))
    for name, array in as_arrays(one).items():
        assert array.tobytes() == as_arrays(three)[name].tobytes(), name
