"""A bound that is proven holds at every sample, and what is well within the bound is proven."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.measures.nearest import NearestFaces
from dmc_cli.measures.proximity import BATCH, SLACK_SHARE, prove_proximity
from dmc_cli.measures.sampling import sample_surface
from dmc_cli.runtime.device import Device
from tests import shapes
from tests.mesh.meshes import on_device


def proximity(shape, other, bound, threads=2):
    device = Device("cpu", threads)
    return prove_proximity(on_device(shape, device), NearestFaces(on_device(other, device)), bound)


def raised(shape, height):
    return np.asarray(shape[0], float) + np.array([0, 0, height]), shape[1]


def sheet(count, size=1.0):
    """A square of count x count quads in the plane z = 0."""
    places = np.linspace(0, size, count + 1)
    points = np.array([(x, y, 0) for y in places for x in places])
    n = count + 1
    faces = [
        (j * n + i, j * n + i + 1, (j + 1) * n + i + 1, (j + 1) * n + i)
        for j in range(count)
        for i in range(count)
    ]
    return points, np.array(faces, np.int32)


@pytest.mark.parametrize(("bound", "share"), [(0.31, 0), (0.29, 1)])
def test_sheets_are_as_far_apart_as_they_are(bound, share):
    fine, coarse = sheet(7), raised(sheet(1), 0.3)
    for one, other in ((fine, coarse), (coarse, fine)):
        found = proximity(one, other, bound)
        assert found.beyond.mean() == share
        assert (len(found.near_beyond) > 0) == share
        assert found.samples >= 2 * len(one[1])


def test_what_is_to_blame_is_named_on_both_meshes():
    """A tent's top is beyond; no corner of the large square is, which samples at vertices would miss."""
    points, faces = sheet(8)
    points[4 * 9 + 4, 2] = 0.5
    tent = (points, faces)
    found = proximity(tent, sheet(1), 0.25)
    assert np.flatnonzero(found.beyond).tolist() == [27, 28, 35, 36]
    assert found.near_beyond.tolist() == [0]
    back = proximity(sheet(1), tent, 0.25)
    assert back.beyond.tolist() == [False]  # the tent's slopes are near enough


def test_more_pieces_than_a_batch_are_all_judged():
    found = proximity(sheet(1, 40.0), raised(sheet(1, 40.0), 0.001), 0.0011)
    assert not found.beyond.any()
    fine = sheet(300)
    assert 2 * len(fine[1]) > BATCH
    assert proximity(fine, raised(sheet(1), 0.3), 0.29).beyond.all()


@given(st.integers(0, 1000), st.floats(0.05, 0.5))
def test_the_verdict_is_that_of_dense_samples(seed, bound):
    rng = np.random.default_rng(seed)
    points, faces = shapes.sphere(5)
    rough = np.asarray(points, float) * rng.uniform(0.8, 1.2, (len(points), 1))
    device = Device("cpu", 2)
    mesh, other = on_device((rough, faces), device), NearestFaces(on_device((points, faces), device))
    found = prove_proximity(mesh, other, bound)
    largest = other.distances(sample_surface(mesh, 3000.0)).max()
    if not found.beyond.any():
        assert largest <= bound
    if largest <= (1 - 2 * SLACK_SHARE) * bound - 0.02:
        assert not found.beyond.any()


def test_a_mesh_is_within_any_bound_of_itself():
    shape = shapes.torus(23, 11)
    assert not proximity(shape, shape, 1e-9).beyond.any()


def test_the_same_on_any_number_of_threads():
    first, second = shapes.torus(23, 11), shapes.torus(11, 7)
    found = [proximity(first, second, 0.1, threads) for threads in (1, 2, 3)]
    for other in found[1:]:
        np.testing.assert_array_equal(found[0].beyond, other.beyond)
        np.testing.assert_array_equal(found[0].near_beyond, other.near_beyond)
        assert found[0].samples == other.samples
