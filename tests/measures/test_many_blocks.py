"""Meshes of more faces and points than one thread looks at are measured like small ones."""

import numpy as np
import pytest
import warp as wp

import tests.measures.meshes as plain
from dmc_cli.measures import components, quality
from dmc_cli.mesh.twins import pair_halfedges
from dmc_cli.runtime.device import Device
from tests import shapes
from tests.mesh.meshes import on_device


@pytest.fixture(scope="module")
def sieve():
    """Return a patch of 60 x 50 squares of which a fifth is missing, in no order."""
    rng = np.random.default_rng(5)
    points, quads = shapes.grid(60, 50)
    kept = rng.permutation(len(quads))[: len(quads) * 4 // 5]
    return points, np.ascontiguousarray(quads[kept])


@pytest.mark.parametrize("threads", [1, 3])
def test_a_patch_with_many_holes_agrees_with_plain_counting(sieve, threads):
    points, quads = sieve
    twins = pair_halfedges(quads)
    assert twins.size > 2 * int(components.BLOCK)
    found = plain.topology_of(sieve, twins=twins, threads=threads)
    links = [(h // 4, twin // 4) for h, twin in enumerate(twins.tolist()) if twin >= 0]
    valences = plain.plain_valences(quads, len(points))
    values, counts = np.unique(valences[valences > 0], return_counts=True)
    assert found.boundary_edges == np.count_nonzero(twins < 0)
    assert found.components == plain.plain_classes(range(len(quads)), links) > 1
    assert found.boundary_loops == plain.plain_loops(quads, twins) > found.components
    assert found.valence_histogram == dict(zip(values.tolist(), counts.tolist(), strict=True))
    assert found.unused_vertices == np.count_nonzero(valences == 0) > 0
    assert (
        found.irregular_percent == 100 * np.count_nonzero(valences[valences > 0] != 4) / (valences > 0).sum()
    )
    edges = np.count_nonzero(twins < 0) + np.count_nonzero(twins >= 0) // 2
    assert found.euler_characteristic == np.count_nonzero(valences) - edges + len(quads)
    assert found.non_manifold_vertices == plain.plain_split_vertices(quads, twins, len(points)) > 0


@pytest.mark.parametrize("labels", [components.label_components, None])
def test_a_class_is_labelled_by_its_least_member(sieve, labels):
    twins = pair_halfedges(sieve[1])
    device, arrays = Device("cpu", 2), [wp.array(a, dtype=wp.int32) for a in (sieve[1].ravel(), twins)]
    if labels is not None:
        parents = labels(device, arrays[1]).numpy()
        pairs = np.array([(h // 4, twin // 4) for h, twin in enumerate(twins.tolist()) if twin >= 0])
    else:
        boundary = components.list_boundary(device, *arrays)
        assert boundary.numpy().tolist() == np.flatnonzero(twins < 0).tolist()
        parents = components.label_loops(device, *arrays, boundary).numpy()
        pairs = np.zeros((0, 2), dtype=int)
    root = np.arange(len(parents))
    for _step in range(len(parents)):
        above = parents[root]
        if (above == root).all():
            break
        root = above
    assert (root[pairs[:, 0]] == root[pairs[:, 1]]).all()
    for least in np.unique(root):
        assert least == np.flatnonzero(root == least)[0]


@pytest.mark.parametrize("count", [1, 255, 256, 257, 600])
def test_bounds_are_those_of_all_points_wherever_the_extremes_are(count):
    rng = np.random.default_rng(count)
    faces = np.zeros((1, 4))
    for place in {0, count // 2, max(count - 2, 0), count - 1}:
        points = rng.uniform(-1, 1, (count, 3)).astype(np.float32)
        points[place] = (7, -8, 9) if place % 2 else (-7, 8, -9)
        found = measured((points, faces)).bounds
        assert np.array_equal(found, [points.min(axis=0), points.max(axis=0)])


@pytest.mark.parametrize("place", [0, 255, 256, 511, 512, 599])
def test_the_worst_quad_counts_wherever_it_is(place):
    points, quads = shapes.grid(30, 20)
    corners = points[quads].reshape(-1, 3).copy()
    corners[4 * place : 4 * place + 4] = [(0, 0, 0), (2, -1, 0), (0.5, 0, 0), (2, 1, 0.2)]
    separate = (corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 4))
    single = (corners[4 * place : 4 * place + 4], np.arange(4, dtype=np.int32).reshape(1, 4))
    found, worst = (measured(shape) for shape in (separate, single))
    assert found.shape_min == worst.shape_min < 1
    assert found.scaled_jacobian_min == pytest.approx(worst.scaled_jacobian_min, abs=1e-12)
    assert found.warpage_max == pytest.approx(worst.warpage_max)
    assert (found.min_angle, found.max_angle) == pytest.approx((worst.min_angle, worst.max_angle))
    assert found.shape_mean == pytest.approx((599 + worst.shape_mean) / 600)
    assert found.mean_ratio_mean == pytest.approx((599 * 3**0.5 / 2 + worst.mean_ratio_mean) / 600)
    assert found.area == pytest.approx(599 + worst.area)
    assert sum(found.shape_histogram) == 600


def measured(shape):
    return quality.measure_quality(on_device(shape, Device("cpu", 2)))


@pytest.mark.parametrize("shape", [0.0, 0.049, 0.051, 0.4999, 0.5001, 0.949, 0.951, 1.0])
def test_a_quad_is_in_its_bin(shape):
    """A rectangle with sides 1 and a has the shape 2 a / (1 + a^2)."""
    a = 0.0 if shape == 0 else (1 - (1 - shape * shape) ** 0.5) / shape
    points = np.array([(0, 0, 0), (1, 0, 0), (1, a, 0), (0, a, 0)])
    found = measured((points, np.array([[0, 1, 2, 3]], dtype=np.int32)))
    assert found.shape_min == pytest.approx(shape, abs=1e-6)
    assert np.flatnonzero(found.shape_histogram).tolist() == [min(int(shape * 20), 19)]
