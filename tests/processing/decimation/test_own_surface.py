"""Without a field the mesh itself is the surface, whatever made it."""

import numpy as np
import pytest

from dmc_cli.contouring import connect_faces
from dmc_cli.measures.distance import measure_distance
from dmc_cli.measures.intersections import count_intersections
from dmc_cli.measures.quality import measure_quality
from dmc_cli.mesh import connect
from dmc_cli.processing.decimation import decimate
from dmc_cli.runtime import select_device
from tests import shapes
from tests.fields import paper_field
from tests.mesh.meshes import Placed, on_device
from tests.processing.remeshing.test_rounds import assert_whole, turned_pairs


@pytest.fixture
def sphere(device):
    return connect(on_device(shapes.sphere(24), select_device(device)))


def reduced(mesh, quads):
    """Return a mesh with fewer quads, and check that it is as sound as before."""
    before = Placed(mesh, None)
    result = decimate(mesh, None, quads)
    assert_whole(before, result)
    assert result.placement is None
    assert set(result.mesh.vertex_values) == set(result.mesh.face_values) == set()
    return result


@pytest.mark.parametrize("share", [2, 4, 10])
def test_vertices_stay_on_a_sphere(sphere, share):
    wanted = sphere.face_count // share
    result = reduced(sphere, wanted)
    assert result.mesh.face_count == wanted
    radii = np.linalg.norm(result.mesh.positions.numpy(), axis=1)
    # Vertices are up to 0.083 apart; 0.09 beside one its plane is 0.09^2 / 2 above the sphere
    assert np.abs(radii - 1).max() < 0.004
    assert np.abs(radii - 1).mean() < 0.0004
    assert turned_pairs(result) == 0
    assert count_intersections(result.mesh) == 0


def test_it_is_as_near_as_on_the_field(extract):
    surface = connect_faces(extract(paper_field("genus_two", 40), border="closed", threads=2))
    quads = surface.mesh.face_count // 4
    own, on_field = (decimate(surface.mesh, place, quads) for place in (None, surface.placement))
    found, expected = (measure_distance(one.mesh, surface.mesh) for one in (own, on_field))
    assert found.to_other.mean < 1.05 * expected.to_other.mean
    assert found.from_other.mean < 1.05 * expected.from_other.mean
    qualities = [measure_quality(one.mesh).shape_mean for one in (own, on_field)]
    assert qualities[0] > qualities[1] - 0.02


def test_a_flat_patch_stays_in_its_plane_and_keeps_its_boundary(device):
    points, quads = shapes.grid(12, 9)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    mesh = connect(on_device((points @ turn, quads), select_device(device)))
    result = reduced(mesh, 60)
    assert result.mesh.face_count < mesh.face_count
    assert np.abs((result.mesh.positions.numpy() @ turn.T)[:, 2]).max() < 1e-5
    assert measure_quality(result.mesh).area == pytest.approx(108, rel=1e-5)


@pytest.mark.parametrize("offset", [1e3, 1e5])
def test_far_from_the_origin_it_is_as_far_as_rounding_lets(sphere, device, offset):
    points, quads = shapes.sphere(24)
    far = connect(on_device((points + offset, quads), select_device(device)))
    result = reduced(far, sphere.face_count // 4)
    radii = np.linalg.norm(result.mesh.positions.numpy().astype(float) - offset, axis=1)
    assert np.abs(radii - 1).max() < 0.004 + 2.4e-7 * offset


def test_units_make_no_difference(device):
    points, quads = shapes.torus(48, 32)
    shapes_found, faces = [], []
    for scale in (1.0, 2.0**-4, 2.0**4, 2.0**-40, 2.0**40):
        mesh = connect(on_device((points * scale, quads), select_device(device)))
        result = reduced(mesh, len(quads) // 3)
        faces.append(result.mesh.faces.numpy())
        shapes_found.append(measure_quality(result.mesh).shape_mean)
        assert measure_distance(result.mesh, mesh).both.max < 0.1 * scale
    assert np.array_equal(faces[0], faces[1])
    assert np.array_equal(faces[0], faces[2])
    assert max(shapes_found) - min(shapes_found) < 0.03


def test_any_number_of_threads_makes_the_same_mesh():
    found = []
    for threads in (1, 2):
        mesh = connect(on_device(shapes.torus(64, 40), select_device("cpu", threads)))
        result = decimate(mesh, None, mesh.face_count // 5)
        found.append((result.mesh.positions.numpy().tobytes(), result.mesh.faces.numpy().tobytes()))
    assert found[0] == found[1]


@pytest.mark.parametrize(
    "name", ["cube", "moebius_strip", "pinched_vertex", "corner_to_corner_cubes", "torus"]
)
def test_small_and_odd_meshes_are_left_sound(device, name):
    mesh = connect(on_device(getattr(shapes, name)(), select_device(device)))
    result = decimate(mesh, None, 1)
    assert 0 < result.mesh.face_count <= mesh.face_count
    assert np.isfinite(result.mesh.positions.numpy()).all()


def test_quads_of_no_area_are_no_surface_to_stay_on(device):
    points, quads = shapes.sphere(8)
    mesh = connect(on_device((points * [1, 1, 0], quads), select_device(device)))
    result = decimate(mesh, None, len(quads) // 2)
    assert np.abs(result.mesh.positions.numpy()[:, 2]).max() == 0
