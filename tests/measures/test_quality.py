"""Quality on figures of known shape, and against VTK, trimesh and plain formulas."""

import math

import numpy as np
import pytest
import trimesh
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from dmc_cli.measures.quality import choose_diagonals, measure_quality
from dmc_cli.runtime.device import Device
from tests import shapes
from tests.measures.meshes import corner_angles, face_rings
from tests.mesh.meshes import on_device


def quality_of(shape, device="cpu", threads=2):
    return measure_quality(on_device(shape, Device(device, threads)))


def one_quad(*corners):
    points = np.zeros((4, 3))
    points[:, : len(corners[0])] = corners
    return points, np.array([[0, 1, 2, 3]], dtype=np.int32)


@pytest.fixture
def measure(device):
    return lambda shape: quality_of(shape, device)


def test_a_cube_is_perfect(measure):
    found = measure(shapes.cube())
    assert found.shape_mean == found.shape_min == found.scaled_jacobian_min == 1.0
    assert found.shape_histogram == (*[0] * 19, 6)
    assert (found.min_angle, found.max_angle, found.warpage_max) == (90.0, 90.0, 0.0)
    assert found.area == pytest.approx(6.0)
    assert found.signed_volume == pytest.approx(1.0)
    assert found.bounds == ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))


def test_half_a_square_has_the_mean_ratio_of_equation_8(measure):
    assert measure(shapes.cube()).mean_ratio_mean == pytest.approx(4 * math.sqrt(3) * 0.5 / 4)


def test_a_rectangle_has_the_shape_of_equation_9(measure):
    found = measure(one_quad((0, 0), (3, 0), (3, 1), (0, 1)))
    assert found.shape_min == pytest.approx(2 * 3 / (9 + 1))
    assert found.scaled_jacobian_min == pytest.approx(1.0)


def test_a_rhombus_is_split_along_its_short_diagonal(measure):
    tall = one_quad((0, -2), (1, 0), (0, 2), (-1, 0))
    wide = one_quad((-1, 0), (0, -2), (1, 0), (0, 2))
    assert [diagonals_of(q).tolist() for q in (tall, wide)] == [[1], [0]]
    assert measure(tall).mean_ratio_mean == pytest.approx(measure(wide).mean_ratio_mean)


def diagonals_of(shape):
    return choose_diagonals(on_device(shape, Device("cpu"))).numpy()


@pytest.mark.parametrize("turn", np.linspace(0.1, 6.2, 7))
def test_a_tie_goes_along_corners_0_and_2(turn):
    square = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]]) @ [
        [np.cos(turn), -np.sin(turn)],
        [np.sin(turn), np.cos(turn)],
    ]
    assert diagonals_of(one_quad(*(square + 100))).tolist() == [0]


def test_a_reflex_corner_has_more_than_180_degrees_and_a_negative_jacobian(measure):
    found = measure(one_quad((0, 0), (2, -1), (0.5, 0), (2, 1)))
    assert found.max_angle == pytest.approx(360 - 2 * math.degrees(math.atan2(1, 1.5)), abs=1e-4)
    assert found.scaled_jacobian_min < 0


def test_warpage_is_the_angle_between_opposite_corner_normals(measure):
    bent = one_quad((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 1))
    assert measure(bent).warpage_max == pytest.approx(60.0, abs=1e-4)


def test_a_collapsed_quad_has_shape_0(measure):
    found = measure(one_quad((0, 0), (0, 0), (0, 0), (0, 0)))
    assert (found.shape_min, found.scaled_jacobian_min, found.mean_ratio_mean) == (0.0, 0.0, 0.0)
    assert found.area == 0.0


def test_triangles_take_part_but_not_in_the_quads_measures(measure):
    found = measure(shapes.tetrahedron())
    assert found.shape_mean is None
    assert found.shape_histogram is None
    assert found.signed_volume == pytest.approx(1 / 6)
    assert found.min_angle == pytest.approx(45.0)
    house = measure(shapes.house())
    assert house.signed_volume == pytest.approx(1 + 0.5 / 3)
    assert sum(house.shape_histogram) == 5


def test_no_faces_have_no_quality(measure):
    found = measure((np.zeros((0, 3)), np.zeros((0, 4), dtype=np.int32)))
    assert found.bounds is None
    assert found.mean_ratio_mean is None
    assert found.min_angle is None
    assert (found.area, found.signed_volume) == (0.0, 0.0)


def test_area_and_volume_of_a_sphere_are_approached_from_below(measure):
    found = measure(shapes.sphere(64))
    assert 0.998 * 4 * math.pi < found.area < 4 * math.pi
    assert 0.998 * 4 / 3 * math.pi < found.signed_volume < 4 / 3 * math.pi


def test_the_volume_of_a_torus_does_not_depend_on_where_it_is(measure):
    near = measure(shapes.torus(300, 200))
    far = measure(shapes.moved(shapes.torus(300, 200), (512, -512, 1024)))
    assert near.signed_volume == pytest.approx(2 * math.pi**2 * 2, rel=1e-3)
    assert near.area == pytest.approx(4 * math.pi**2 * 2, rel=1e-3)
    assert far.signed_volume == pytest.approx(near.signed_volume, rel=1e-5)


def random_quads(seed, count=400, bend=0.3, irregularity=0.35):
    rng = np.random.default_rng(seed)
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    points = square + rng.uniform(-irregularity, irregularity, (count, 4, 3)) * (1, 1, bend)
    turns = np.linalg.qr(rng.standard_normal((count, 3, 3)))[0]
    points = (points @ turns * rng.uniform(0.1, 10, (count, 1, 1))).astype(np.float32)
    return points.reshape(-1, 3).astype(float), np.arange(4 * count, dtype=np.int32).reshape(-1, 4)


def vtk_measure(shape, name):
    """Verdict's value of each quad by VTK."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersVerdict import vtkCellQuality

    points, quads = shape
    mesh, at, cells = vtkPolyData(), vtkPoints(), vtkCellArray()
    at.SetData(numpy_to_vtk(points, deep=True))
    rows = np.column_stack([np.full(len(quads), 4), quads]).astype(np.int64).ravel()
    cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(rows, deep=True))
    mesh.SetPoints(at)
    mesh.SetPolys(cells)
    judge = vtkCellQuality()
    judge.SetInputData(mesh)
    getattr(judge, f"SetQualityMeasureTo{name}")()
    judge.Update()
    return vtk_to_numpy(judge.GetOutput().GetCellData().GetArray("CellQuality"))


@pytest.mark.parametrize("seed", range(3))
def test_quads_are_measured_as_verdict_does(seed):
    shape = random_quads(seed)
    jacobians = vtk_measure(shape, "ScaledJacobian")
    keep = jacobians > 0.02
    shape = shape[0], shape[1][keep]
    found = quality_of(shape)
    assert keep.sum() > 300
    assert found.scaled_jacobian_min == pytest.approx(jacobians[keep].min(), abs=1e-9)
    assert found.min_angle == pytest.approx(vtk_measure(shape, "MinAngle").min(), abs=1e-6)
    assert found.max_angle == pytest.approx(vtk_measure(shape, "MaxAngle").max(), abs=1e-6)
    cosine = math.cos(math.radians(found.warpage_max))
    assert cosine**3 == pytest.approx(vtk_measure(shape, "Warpage").min(), abs=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_flat_quads_have_the_shape_of_verdict(seed):
    shape = random_quads(seed, bend=0.0)
    keep = vtk_measure(shape, "ScaledJacobian") > 0.02
    shape = shape[0], shape[1][keep]
    values = vtk_measure(shape, "Shape")
    found = quality_of(shape)
    assert found.shape_mean == pytest.approx(values.mean(), abs=1e-6)
    assert found.shape_min == pytest.approx(values.min(), abs=1e-6)
    assert found.shape_histogram == tuple(np.histogram(values, bins=20, range=(0, 1))[0])
    assert found.area == pytest.approx(vtk_measure(shape, "Area").sum(), rel=1e-6)


def plain_split(points, quad):
    """The two triangles of the MaxMin-angle split."""
    a, b, c, d = quad
    halves = [[(a, b, c), (a, c, d)], [(a, b, d), (b, c, d)]]
    least = [min(min(corner_angles(points, t)) for t in half) for half in halves]
    return halves[0] if least[0] >= least[1] else halves[1]


@pytest.mark.parametrize("seed", range(2))
def test_split_quads_have_the_ratio_area_and_volume_of_their_triangles(seed):
    points, quads = random_quads(seed, count=120, bend=1.0)
    triangles = np.array([t for quad in quads for t in plain_split(points, quad)])
    mesh = trimesh.Trimesh(points, triangles, process=False)
    edges = points[triangles] - points[np.roll(triangles, 1, axis=1)]
    ratios = 4 * math.sqrt(3) * mesh.area_faces / (edges**2).sum(axis=(1, 2))
    found = quality_of((points, quads))
    assert found.mean_ratio_mean == pytest.approx(ratios.mean(), rel=1e-9)
    assert found.area == pytest.approx(mesh.area, rel=1e-9)


@given(hnp.arrays(np.float64, (6, 3), elements=st.floats(-10, 10, width=32)))
def test_any_points_give_finite_figures_in_range(points):
    found = quality_of((points, np.array([[0, 1, 2, 3], [2, 3, 4, 5], [0, 4, 1, -1]], dtype=np.int32)))
    assert 0.0 <= found.shape_min <= found.shape_mean <= 1.0
    assert -1.0 - 1e-12 <= found.scaled_jacobian_min <= 1.0
    assert 0.0 <= found.mean_ratio_mean <= 1.0 + 1e-12
    assert 0.0 <= found.min_angle <= found.max_angle <= 360.0
    assert 0.0 <= found.warpage_max <= 180.0
    assert math.isfinite(found.area)
    assert math.isfinite(found.signed_volume)


def test_angles_of_a_mixed_mesh_are_those_of_its_corners(measure):
    points, faces = shapes.house()
    angles = [a for ring in face_rings(faces) for a in corner_angles(points, ring)]
    found = measure((points, faces))
    assert found.min_angle == pytest.approx(min(angles), abs=1e-4)
    assert found.max_angle == pytest.approx(max(angles), abs=1e-4)


def test_threads_do_not_show(device):
    shape = shapes.moved(shapes.torus(211, 97), (3, 1, 4))
    one = quality_of(shape, device, threads=1)
    assert all(quality_of(shape, device, threads=n) == one for n in (2, 3, 5))
