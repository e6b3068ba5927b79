"""`--placement exact`, attempt by attempt, against plain NumPy in double precision."""

from collections import Counter

import numpy as np
import pytest
import warp as wp

from dmc_cli.contouring.dual_marching_cubes.placement.exact import (
    fall_back,
    measure_polygon,
    place_vertex,
    place_with_care,
    root_on_segment,
)
from dmc_cli.field.crossings import edge_set
from dmc_cli.field.trilinear import CornerValues
from dmc_cli.runtime.device import select_device
from tests.oracle import placement as oracle
from tests.oracle.cube import EDGES

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

NEAR = 1e-4
FALLBACKS = ("axis in the cell", "segment")


@wp.kernel
def place_kernel(
    first: wp.int32,
    values: wp.array(dtype=CornerValues),
    edges: wp.array(dtype=wp.uint32),
    whole_out: wp.array(dtype=wp.vec4),
    care_out: wp.array(dtype=wp.vec4),
    last_out: wp.array(dtype=wp.vec3),
):
    n = first + wp.tid()
    whole_out[n] = place_vertex(values[n], edge_set(edges[n]))
    care_out[n] = place_with_care(values[n], edge_set(edges[n]))
    last_out[n] = fall_back(values[n], measure_polygon(values[n], edge_set(edges[n])))


@wp.kernel
def segment_kernel(
    first: wp.int32,
    values: wp.array(dtype=CornerValues),
    starts: wp.array(dtype=wp.vec3),
    ends: wp.array(dtype=wp.vec3),
    root_out: wp.array(dtype=wp.vec3),
):
    n = first + wp.tid()
    root_out[n] = root_on_segment(values[n], starts[n], ends[n])


def crossed(f):
    return frozenset(e for e, (a, b) in enumerate(EDGES) if (f[a] >= 0) != (f[b] >= 0))


def wild_cells(count):
    """Corner values without any order, many of them small, and three or all of their crossed edges.

    These are no polygons that tracing finds: their means lie far off the surface, so every attempt is made.
    """
    rng = np.random.default_rng(11)
    values = rng.standard_normal((count, 8)) * 10.0 ** rng.uniform(-5, 0, (count, 8))
    values = values.astype(np.float32)
    values = values[[0 < np.count_nonzero(f >= 0) < 8 for f in values]]
    polygons = [sorted(crossed(f)) for f in values.astype(float)]
    few = [p if n % 3 == 0 else rng.choice(p, 3, replace=False).tolist() for n, p in enumerate(polygons)]
    return values, [frozenset(p) for p in few]


def run(kernel, device, inputs, kinds):
    """Launch a kernel on inputs, each beside its type; return its outputs, one of each of `kinds`."""
    count = len(inputs[0][0])
    arrays = [wp.array(values, dtype=kind, device=device) for values, kind in inputs]
    outputs = [wp.zeros(count, dtype=kind, device=device) for kind in kinds]
    select_device(device, 1).launch(kernel, count, arrays, outputs)
    return [output.numpy() for output in outputs]


@pytest.fixture(scope="module")
def cells():
    return wild_cells(1800)


def placed(cells, device):
    values, polygons = cells
    bits = np.array([sum(1 << e for e in polygon) for polygon in polygons], np.uint32)
    inputs = [(values, CornerValues), (bits, wp.uint32)]
    return run(place_kernel, device, inputs, (wp.vec4, wp.vec4, wp.vec3))


def test_every_attempt_finds_what_the_oracle_finds(cells, device):
    whole, care, _ = placed(cells, device)
    values, polygons = cells
    expected = [oracle.place_exactly(f.astype(float), p) for f, p in zip(values, polygons, strict=True)]
    attempts = Counter(attempt for _, attempt in expected)
    assert min(attempts[name] for name in ("axis", "coarse lattice", "fine lattice", *FALLBACKS)) > 5
    for name in attempts:
        chosen = np.array([attempt == name for _, attempt in expected])
        points = np.array([point for point, attempt in expected if attempt == name])
        for found in (whole[chosen], care[chosen]):
            same = np.abs(found[:, :3] - points).max(axis=1) < NEAR
            assert same.mean() > 0.9, name  # two solutions at the same distance, one at the box's edge
            assert (found[same, 3] == (name in FALLBACKS)).mean() > 0.98, name


def test_the_first_attempt_alone_finds_what_all_of_them_find(cells, device):
    whole, care, _ = placed(cells, device)
    np.testing.assert_allclose(whole, care, rtol=0, atol=2e-6)


def test_every_vertex_is_on_the_surface_and_in_its_cell(cells, device):
    whole, care, _ = placed(cells, device)
    for found in (whole, care):
        for f, p in zip(cells[0].astype(float), found[:, :3].astype(float), strict=True):
            assert (p >= 0).all()
            assert (p <= 1).all()
            assert abs(oracle.interpolate(f, p)) < 1e-6 * np.abs(f).max()


def test_the_last_resort_alone_is_on_the_surface_too(cells, device):
    _, _, last = placed(cells, device)
    for f, polygon, p in zip(cells[0].astype(float), cells[1], last.astype(float), strict=True):
        assert (p >= 0).all()
        assert (p <= 1).all()
        assert abs(oracle.interpolate(f, p)) < 1e-6 * np.abs(f).max(), polygon


def test_the_root_on_a_segment_is_the_nearest_that_a_sixteenth_of_it_tells(cells, device):
    values, polygons = (items[:600] for items in cells)
    points = [oracle.crossings(f, p) for f, p in zip(values.astype(float), polygons, strict=True)]
    starts = np.array([p.mean(axis=0) for p in points], np.float32)
    ends = np.array([p[0] for p in points], np.float32)
    inputs = [(values, CornerValues), (starts, wp.vec3), (ends, wp.vec3)]
    (roots,) = run(segment_kernel, device, inputs, [wp.vec3])
    ways = ends.astype(float) - starts
    expected = [
        oracle.root_on_segment(f, a, b)
        for f, a, b in zip(values.astype(float), starts.astype(float), ends.astype(float), strict=True)
    ]
    wrong = np.abs(roots - expected).max(axis=1) > 1e-5
    inside = np.linalg.norm(expected - ends, axis=1) > 1e-3 * np.linalg.norm(ways, axis=1)
    assert inside.sum() > 50
    assert wrong.mean() < 0.005  # where the interpolant is 0 but for rounding


@pytest.mark.parametrize(("second", "expected"), [(0.0615, 1.0), (0.0635, 0.055)])
def test_two_roots_between_samples_are_not_seen(second, expected, device):
    """Along a cell's diagonal the interpolant is a cubic, whose Bernstein coefficients the corners are."""
    roots = np.poly([0.055, second, 1.0])[::-1]  # coefficients of 1, t, t^2, t^3
    bernstein = [
        roots[0],
        roots[0] + roots[1] / 3,
        roots[0] + 2 * roots[1] / 3 + roots[2] / 3,
        roots.sum(),
    ]
    values = np.array([[bernstein[bin(c).count("1")] for c in range(8)]], np.float32)
    ends = [(np.full((1, 3), x, np.float32), wp.vec3) for x in (0.0, 1.0)]
    (root,) = run(segment_kernel, device, [(values, CornerValues), *ends], [wp.vec3])
    np.testing.assert_allclose(root[0], np.full(3, expected), atol=1e-4)
