"""Smooth surfaces of labels keep the volume of their nodes, fold nowhere and do not intersect themselves."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.contouring.label_surfaces.nets import (
    assert_closed_manifold,
    ball,
    enclosed,
    least_jacobian,
    mesh_of,
    normals_error,
    shells_of,
)

ANISOTROPIC = (1.0, 1.0, 3.0)


@pytest.mark.parametrize(
    ("radius", "spacing", "percent", "degrees"),
    [
        (20, (1, 1, 1), 0.05, 2.5),
        (8, (1, 1, 1), 0.1, 4.5),
        (3, (1, 1, 1), 0.5, 12.0),
        (20, ANISOTROPIC, 0.1, 4.0),
    ],
)
def test_balls_keep_their_volume_and_lose_their_stairs(radius, spacing, percent, degrees):
    errors = []
    for seed in range(3):
        labels, centre = ball(radius, seed, spacing)
        (shell,) = shells_of(mesh_of(labels, spacing))
        nodes = labels.sum() * np.prod(spacing)
        assert abs(enclosed(shell) / nodes - 1) * 100 <= percent
        errors.append(normals_error(shell, centre))
    assert np.mean(errors) <= degrees


def test_a_tube_two_nodes_across_stays_one_piece():
    labels = np.zeros((40, 40, 40), np.uint8)
    for n in range(30):  # along a diagonal, so that it has stairs
        labels[5 + n, 5 + n // 2 : 7 + n // 2, 10 + n // 3 : 12 + n // 3] = 1
    (shell,) = shells_of(mesh_of(labels))
    assert_closed_manifold(shell.faces, len(shell.points))
    assert abs(enclosed(shell) / labels.sum() - 1) <= 0.02
    assert components(shell) == 1


def components(shell):
    """How many pieces a shell has."""
    lowest = np.arange(len(shell.points))
    while True:
        before = lowest.copy()
        np.minimum.at(lowest, shell.faces, lowest[shell.faces].min(axis=1)[:, None])
        if np.array_equal(before, lowest):
            return len(np.unique(lowest))


def test_a_ball_in_three_parts_shares_its_walls_to_the_bit():
    labels, centre = ball(14, 0)
    _, j, i = np.meshgrid(*[np.arange(n) for n in labels.shape], indexing="ij")
    sector = np.digitize(np.arctan2(j - centre[1] - 0.3, i - centre[0] + 0.2), [-1.1, 1.3]) + 1
    labels = np.where(labels == 1, sector, 0).astype(np.int32)
    mesh = mesh_of(labels)
    shells = shells_of(mesh)
    for n, shell in enumerate(shells, 1):
        assert_closed_manifold(shell.faces, len(shell.points))
        assert abs(enclosed(shell) / (labels == n).sum() - 1) <= 0.001
    places = [{point.tobytes() for point in shell.points} for shell in shells]
    shared = mesh.sides.min(axis=1) > 0
    on_walls = {point.tobytes() for point in mesh.points[np.unique(mesh.faces[shared])]}
    assert on_walls <= places[0] | places[1] | places[2]
    assert len(places[0] & places[1] & places[2]) >= 10  # the curve along which all three meet
    assert least_jacobian(mesh.points, mesh.faces) >= 0.1


def test_specks_keep_their_volume_exactly():
    labels = np.zeros((12, 12, 12), np.uint8)
    labels[2, 2, 2] = labels[5:7, 5:7, 5:7] = 1
    labels[9, 3:6, 9] = 2
    one, two = shells_of(mesh_of(labels))
    assert enclosed(one) == pytest.approx(9, abs=1e-5)
    assert enclosed(two) == pytest.approx(3, abs=1e-5)


@pytest.mark.parametrize("labels", [2, 4])
def test_white_noise_neither_folds_nor_intersects(labels):
    noise = np.random.default_rng(labels).integers(0, labels, (13, 14, 15), np.uint8)
    mesh = mesh_of(noise)
    assert mesh.intersections == 0
    assert least_jacobian(mesh.points, mesh.faces) > 0
    for code, shell in enumerate(shells_of(mesh), 1):
        assert_closed_manifold(shell.faces, len(shell.points))
        assert abs(enclosed(shell) / (noise == code).sum() - 1) <= 0.03


def test_smooth_regions_meet_without_folds_or_intersections():
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(3)
    fields = [gaussian_filter(rng.standard_normal((40, 44, 48)), 3) for _ in range(5)]
    labels = np.argmax(fields, axis=0).astype(np.uint8)
    mesh = mesh_of(labels)
    assert mesh.intersections == 0
    assert least_jacobian(mesh.points, mesh.faces) >= 0.05
    for code, shell in enumerate(shells_of(mesh), 1):
        assert abs(enclosed(shell) / (labels == code).sum() - 1) <= 0.002


def rough_map(seed, count, sigma, noise, shape):
    """Regions of several labels whose borders are noisy."""
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(seed)
    fields = [gaussian_filter(rng.standard_normal(shape), sigma) for _ in range(count)]
    noisy = [field / field.std() + noise * rng.standard_normal(shape) for field in fields]
    return np.argmax(noisy, axis=0).astype(np.uint8)


@pytest.mark.parametrize(("sigma", "noise", "percent"), [(3, 0.1, 0.1), (2, 0.3, 0.15), (1, 0.0, 0.15)])
def test_rough_maps_keep_their_volumes_without_a_fold_or_an_intersection(sigma, noise, percent):
    labels = rough_map(7, 6, sigma, noise, (19, 20, 21))
    mesh = mesh_of(labels)
    assert mesh.intersections == 0
    assert least_jacobian(mesh.points, mesh.faces) >= 0.149
    for code, shell in enumerate(shells_of(mesh), 1):
        assert_closed_manifold(shell.faces, len(shell.points))
        assert abs(enclosed(shell) / (labels == code).sum() - 1) * 100 <= percent


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(2, 9),
    sigma=st.floats(0, 3),
    noise=st.floats(0, 1),
    spacing=st.sampled_from([(1.0, 1.0, 1.0), ANISOTROPIC, (1.0, 0.4, 2.0)]),
)
def test_no_map_folds_or_intersects(seed, count, sigma, noise, spacing):
    labels = rough_map(seed, count, sigma, noise, (9, 11, 13))
    mesh = mesh_of(labels, spacing)
    assert mesh.intersections == 0
    if len(mesh.faces):
        assert least_jacobian(mesh.points, mesh.faces) > 0.1
    for shell in shells_of(mesh):
        assert_closed_manifold(shell.faces, len(shell.points))


@pytest.mark.pool
def test_threads_make_no_difference():
    labels = ball(9, 1)[0]
    one, two = mesh_of(labels, threads=1), mesh_of(labels, threads=2)
    assert one.points.tobytes() == two.points.tobytes()
