"""Curvature where it is known, against plain sums over triangles, and by the theorem of Gauss and Bonnet."""

import math

import numpy as np
import pytest

from dmc_cli.measures.curvature import list_curvature, measure_curvature
from dmc_cli.measures.topology import measure_topology
from dmc_cli.runtime.device import Device
from tests import shapes
from tests.measures.meshes import face_rings
from tests.measures.splits import split_triangles
from tests.mesh.meshes import on_device


def listed(shape, device="cpu", threads=2):
    return list_curvature(on_device(shape, Device(device, threads)))


def measured(shape, device="cpu", threads=2):
    return measure_curvature(on_device(shape, Device(device, threads)))


def test_a_sphere_has_the_reciprocals_of_its_radius(device):
    points, quads = shapes.sphere(40)
    found = measured((2.5 * points, quads), device)
    assert found.vertices == len(points)
    assert found.mean.mean == pytest.approx(1 / 2.5, rel=1e-3)
    assert found.gaussian.mean == pytest.approx(1 / 2.5**2, rel=1e-3)
    assert found.mean.rms == pytest.approx(1 / 2.5, rel=2e-2)
    turned = measured((2.5 * points, quads[:, ::-1]), device)
    assert turned.mean.mean == pytest.approx(-1 / 2.5, rel=1e-3)
    assert turned.gaussian.mean == pytest.approx(1 / 2.5**2, rel=1e-3)


def test_a_torus_bends_as_its_formulas_say(device):
    n, m = 120, 80
    shape = shapes.torus(n, m, big=2.0, small=0.5)
    mean, gaussian, area = listed(shape, device)
    turn = np.cos(2 * np.pi * (np.arange(n * m) % m) / m)
    assert mean == pytest.approx((2 + 2 * 0.5 * turn) / (2 * 0.5 * (2 + 0.5 * turn)), rel=2e-2)
    assert gaussian == pytest.approx(turn / (0.5 * (2 + 0.5 * turn)), abs=2e-2)
    assert area.sum() == pytest.approx(4 * np.pi**2 * 2 * 0.5, rel=2e-3)


def test_a_plane_is_flat_and_its_boundary_has_none(device):
    mean, gaussian, _ = listed(shapes.halved(shapes.grid(5, 4), 3), device)
    inner = ~np.isnan(mean)
    assert inner.sum() == 4 * 3
    assert mean[inner] == pytest.approx(0, abs=1e-12)
    assert gaussian[inner] == pytest.approx(0, abs=1e-12)


def crooked(shape, seed=2):
    points, faces = shape
    return points + np.random.default_rng(seed).normal(0, 0.03, points.shape), faces


@pytest.mark.parametrize(
    "shape",
    [
        crooked(shapes.torus(13, 9)),
        crooked(shapes.halved(shapes.sphere(4), 2)),
        crooked(shapes.house()),
        crooked(shapes.tetrahedron()),
        crooked(shapes.two_components()),
    ],
)
def test_the_integral_is_two_pi_times_the_euler_characteristic(device, shape):
    euler = measure_topology(on_device(shape, Device(device, 2))).euler_characteristic
    assert measured(shape, device).total_gaussian == pytest.approx(2 * math.pi * euler, abs=1e-9)


def plain_curvature(shape):
    """Mean curvature by its length, Gaussian curvature and mixed area, triangle by triangle."""
    points, count = np.asarray(shape[0], np.float32).astype(float), len(shape[0])
    edges, angles, areas = np.zeros((count, 3)), np.zeros(count), np.zeros(count)
    for triangle in split_triangles(shape):
        for k in range(3):
            i, j, l = (triangle[(k + step) % 3] for step in range(3))  # noqa: E741
            a, b, c = points[[i, j, l]]
            corner = [angle(a, b, c), angle(b, c, a), angle(c, a, b)]
            area = np.linalg.norm(np.cross(b - a, c - a)) / 2
            edges[i] += (a - b) / math.tan(corner[2]) + (a - c) / math.tan(corner[1])
            angles[i] += corner[0]
            if max(corner) <= math.pi / 2:
                squares = (a - b) @ (a - b) / math.tan(corner[2]) + (a - c) @ (a - c) / math.tan(corner[1])
                areas[i] += squares / 8
            else:
                areas[i] += area / 2 if corner[0] > math.pi / 2 else area / 4
    return np.linalg.norm(edges, axis=1) / (4 * areas), (2 * math.pi - angles) / areas, areas


def angle(a, b, c):
    """The angle at a."""
    cosine = (b - a) @ (c - a) / (np.linalg.norm(b - a) * np.linalg.norm(c - a))
    return math.acos(cosine)


@pytest.mark.parametrize(
    "shape", [crooked(shapes.torus(9, 7)), crooked(shapes.house()), crooked(shapes.sphere(3))]
)
def test_curvature_is_that_of_plain_sums(device, shape):
    mean, gaussian, area = listed(shape, device)
    expected = plain_curvature(shape)
    assert np.abs(mean) == pytest.approx(expected[0], rel=1e-9)
    assert gaussian == pytest.approx(expected[1], rel=1e-9, abs=1e-9)
    assert area == pytest.approx(expected[2], rel=1e-9)


def test_vertices_that_are_no_inner_ones_have_none(device):
    for shape in (shapes.pinched_vertex(), shapes.corner_to_corner_cubes()):
        mean, gaussian, area = listed(shape, device)
        rings = face_rings(shape[1])
        shared = [v for v in range(len(shape[0])) if sum(v in ring for ring in rings) == 6]
        assert np.isnan(mean[shared]).all()
        assert (np.isnan(mean) == np.isnan(gaussian)).all()
        assert (np.isnan(mean) == np.isnan(area)).all()
    assert measured(shapes.corner_to_corner_cubes(), device).vertices == 14
    assert measured(shapes.pinched_vertex(), device).vertices == 0


def test_without_vertices_there_is_none(device):
    found = measured((np.zeros((0, 3)), np.zeros((0, 4), np.int32)), device)
    assert (found.vertices, found.total_gaussian, found.mean.mean) == (0, 0.0, None)


def test_faces_without_an_area_add_nothing(device):
    points, quads = shapes.sphere(3)
    points = points.copy()
    points[quads[0]] = points[quads[0, 0]]
    found = measured((points, quads), device)
    assert math.isfinite(found.mean.rms)
    assert math.isfinite(found.gaussian.rms)


def test_threads_do_not_show(device):
    shape = crooked(shapes.torus(97, 61))
    one = measured(shape, device, threads=1)
    assert all(measured(shape, device, threads=n) == one for n in (2, 3, 5))
