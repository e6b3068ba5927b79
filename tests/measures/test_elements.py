"""Verdict's measures of each face against VTK, the radius ratio against plain formulas, figures by hand."""

import math
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from dmc_cli.measures.elements import measure_elements
from dmc_cli.measures.lists import list_elements
from dmc_cli.measures.quality import measure_quality
from dmc_cli.runtime.device import Device
from tests import shapes
from tests.measures.verdict_cells import random_faces, vtk_measure
from tests.mesh.meshes import on_device

QUADS = {
    "scaled_jacobian": "ScaledJacobian",
    "aspect_ratio": "AspectRatio",
    "skew": "Skew",
    "taper": "Taper",
    "stretch": "Stretch",
}
TRIANGLES = {
    "scaled_jacobian": "ScaledJacobian",
    "aspect_ratio": "AspectRatio",
    "min_angle": "MinAngle",
    "max_angle": "MaxAngle",
}


def listed(shape, device="cpu", threads=2):
    return list_elements(on_device(shape, Device(device, threads)))


def measured(shape, device="cpu", threads=2):
    return measure_elements(on_device(shape, Device(device, threads)))


@pytest.mark.parametrize("name", QUADS)
@pytest.mark.parametrize("seed", range(2))
def test_each_quad_has_verdict_s_value(device, name, seed):
    shape = random_faces(seed, 4)
    expected = vtk_measure(shape, QUADS[name])
    assert listed(shape, device)[name] == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_each_quad_has_verdict_s_warpage_and_angles(device, seed):
    shape = random_faces(seed, 4)
    found = listed(shape, device)
    assert np.cos(np.radians(found["warpage"])) ** 3 == pytest.approx(vtk_measure(shape, "Warpage"), abs=1e-9)
    plain = found["scaled_jacobian"] > 0  # of a reflex corner VTK takes the angle on the other side
    assert plain.sum() > 200
    assert found["min_angle"][plain] == pytest.approx(vtk_measure(shape, "MinAngle")[plain], abs=1e-6)
    assert found["max_angle"][plain] == pytest.approx(vtk_measure(shape, "MaxAngle")[plain], abs=1e-6)


@pytest.mark.parametrize("name", TRIANGLES)
@pytest.mark.parametrize("seed", range(2))
def test_each_triangle_has_verdict_s_value(device, name, seed):
    shape = random_faces(seed, 3)
    expected = vtk_measure(shape, TRIANGLES[name])
    assert listed(shape, device)[name] == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_the_radius_ratio_is_the_inverse_of_verdict_s(device):
    shape = random_faces(5, 3)
    found = listed(shape, device)["radius_ratio"]
    assert 1 / found[:, 0] == pytest.approx(vtk_measure(shape, "RadiusRatio"), rel=1e-9)
    assert np.isnan(found[:, 1]).all()


def test_flat_quads_have_the_shape_of_verdict(device):
    points, faces = random_faces(3, 4)
    shape = points * (1, 1, 0), faces
    expected = vtk_measure(shape, "Shape")
    convex = vtk_measure(shape, "ScaledJacobian") > 0.01
    assert convex.sum() > 200
    assert listed(shape, device)["shape"][convex] == pytest.approx(expected[convex], rel=1e-6, abs=1e-6)


def plain_ratios(a, b, c):
    """Mean ratio and radius ratio of a triangle by the definitions."""
    sides = [math.dist(a, b), math.dist(b, c), math.dist(c, a)]
    s = sum(sides) / 2
    area = np.linalg.norm(np.cross(np.subtract(b, a), np.subtract(c, a))) / 2
    inscribed, circumscribed = area / s, math.prod(sides) / (4 * area)
    return 4 * math.sqrt(3) * area / sum(x * x for x in sides), 2 * inscribed / circumscribed


def test_ratios_are_those_of_the_two_triangles():
    points = np.array([[0, 0, 0], [2, 0, 0], [2.5, 1, 0.5], [0.25, 1, 0]])
    found = listed((points, np.array([[0, 1, 2, 3]], np.int32)))
    splits = [((0, 1, 2), (0, 2, 3)), ((1, 2, 3), (1, 3, 0))]
    expected = [np.array([plain_ratios(*points[list(t)]) for t in split]) for split in splits]
    columns = np.column_stack([found["mean_ratio"][0], found["radius_ratio"][0]])
    assert any(columns == pytest.approx(rows, rel=1e-12) for rows in expected)


def test_means_and_ends_are_those_of_the_list(device):
    shape = shapes.joined(random_faces(1, 4, 700), random_faces(2, 3, 600))
    rows, found, quality = (
        listed(shape, device),
        measured(shape, device),
        measure_quality(on_device(shape, Device(device))),
    )
    quads, triangles = np.arange(700), np.arange(700, 1300)
    for name in ("scaled_jacobian", "aspect_ratio", "skew", "taper", "stretch", "warpage"):
        assert getattr(found, f"{name}_mean") == pytest.approx(rows[name][quads].mean(), rel=1e-12)
    for name in ("aspect_ratio", "skew", "taper"):
        assert getattr(found, f"{name}_max") == rows[name][quads].max()
    assert found.stretch_min == rows["stretch"][quads].min()
    assert quality.scaled_jacobian_min == pytest.approx(rows["scaled_jacobian"][quads].min(), abs=1e-9)
    assert found.triangle_scaled_jacobian_mean == pytest.approx(
        rows["scaled_jacobian"][triangles].mean(), rel=1e-12
    )
    assert found.triangle_scaled_jacobian_min == rows["scaled_jacobian"][triangles].min()
    assert found.triangle_aspect_ratio_mean == pytest.approx(
        rows["aspect_ratio"][triangles].mean(), rel=1e-12
    )
    assert found.triangle_aspect_ratio_max == rows["aspect_ratio"][triangles].max()
    ratios = rows["radius_ratio"][~np.isnan(rows["radius_ratio"])]
    assert len(ratios) == 2 * 700 + 600
    assert found.radius_ratio_mean == pytest.approx(ratios.mean(), rel=1e-12)
    assert found.radius_ratio_min == ratios.min()
    assert found.mean_ratio_min == np.nanmin(rows["mean_ratio"])
    assert quality.mean_ratio_mean == pytest.approx(np.nanmean(rows["mean_ratio"]), rel=1e-12)


def test_a_cube_is_perfect(device):
    found = measured(shapes.cube(), device)
    best = {"scaled_jacobian_mean": 1, "aspect_ratio_mean": 1, "aspect_ratio_max": 1, "skew_max": 0}
    best |= {"taper_max": 0, "stretch_min": 1, "warpage_mean": 0, "radius_ratio_min": 2 * math.sqrt(2) - 2}
    for name, value in best.items():
        assert getattr(found, name) == pytest.approx(value, abs=1e-12)
    assert found.triangle_scaled_jacobian_mean is None


def test_equilateral_triangles_are_perfect(device):
    points = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], float)
    found = measured((points, shapes.tetrahedron()[1]), device)
    for name in ("radius_ratio_mean", "radius_ratio_min", "mean_ratio_min", "triangle_scaled_jacobian_min"):
        assert getattr(found, name) == pytest.approx(1.0)
    assert found.triangle_aspect_ratio_max == pytest.approx(1.0)
    assert found.skew_mean is None


def test_without_faces_there_is_nothing(device):
    found = measured((np.zeros((0, 3)), np.zeros((0, 4), np.int32)), device)
    assert set(asdict(found).values()) == {None}


@given(hnp.arrays(np.float64, (6, 3), elements=st.floats(-10, 10, width=32)))
def test_any_points_give_figures_in_range(points):
    found = asdict(measured((points, np.array([[0, 1, 2, 3], [2, 3, 4, 5], [0, 4, 1, -1]], np.int32))))
    for name, value in found.items():
        if "aspect_ratio" in name:
            assert value >= 1 - 1e-12
        elif "taper" in name or "stretch" in name:
            assert value >= 0
        elif name == "warpage_mean":
            assert 0 <= value <= 180
        else:
            assert -1 - 1e-12 <= value <= 1 + 1e-12


def test_threads_do_not_show(device):
    shape = shapes.moved(shapes.torus(211, 97), (3, 1, 4))
    one = measured(shape, device, threads=1)
    assert all(measured(shape, device, threads=n) == one for n in (2, 3, 5))
