"""A bound on the distance holds everywhere and both ways, or the mesh stays what it was."""

import numpy as np
import pytest

from dmc_cli.app.fine_mesh import FineMesh
from dmc_cli.contouring import connect_faces
from dmc_cli.measures.distance import measure_distance
from dmc_cli.measures.quality import measure_quality
from dmc_cli.processing.decimation import Bound, decimate
from tests.contouring.dual_marching_cubes.agreement import as_arrays
from tests.fields import paper_field, smooth_noise, sphere
from tests.processing.remeshing.test_rounds import assert_whole, turned_pairs


def quad_area(surface):
    """The mean area of a quad."""
    return measure_quality(surface.mesh).area / surface.mesh.face_count


def bounded(surface, error, quads=1):
    fine = FineMesh(surface.mesh, np.eye(3), error)
    bound = Bound(error, fine.find_beyond)
    return decimate(surface.mesh, surface.placement, quads, bound=bound)


@pytest.fixture
def genus_two(extract):
    return connect_faces(extract(paper_field("genus_two", 24), border="closed", threads=2))


@pytest.mark.parametrize("share", [0.1, 0.5])
def test_dense_samples_are_within_the_bound_both_ways(genus_two, share):
    side = np.sqrt(quad_area(genus_two))
    result = bounded(genus_two, share * side)
    assert result.mesh.face_count < genus_two.mesh.face_count * (0.6 if share > 0.2 else 1)
    found = measure_distance(result.mesh, genus_two.mesh)
    assert found.both.max <= share * side
    assert_whole(genus_two, result)
    assert turned_pairs(result) == 0


def test_a_number_stops_it_before_the_bound(genus_two):
    wanted = genus_two.mesh.face_count // 2
    assert bounded(genus_two, 10.0, wanted).mesh.face_count == wanted


def test_what_is_never_proven_is_returned_as_it_was(genus_two):
    calls = []

    def find_beyond(mesh):
        calls.append(mesh.face_count)
        return np.ones(mesh.face_count, bool)

    result = decimate(genus_two.mesh, genus_two.placement, 1, bound=Bound(1.0, find_beyond))
    np.testing.assert_array_equal(result.mesh.faces.numpy(), genus_two.mesh.faces.numpy())
    np.testing.assert_array_equal(result.mesh.positions.numpy(), genus_two.mesh.positions.numpy())
    assert len(calls) < 10


def test_quads_that_are_to_blame_are_left_as_they_were(extract):
    """Where x is positive every quad that is no longer one of the sphere's own counts as beyond."""
    surface = connect_faces(extract(sphere(24), threads=2))
    points, faces = surface.mesh.positions.numpy(), surface.mesh.faces.numpy()
    middle = points.mean(axis=0)
    own = {row.tobytes() for row in np.sort(points[faces].reshape(len(faces), 12), axis=1)}

    def find_beyond(mesh):
        corners = mesh.positions.numpy()[mesh.faces.numpy()]
        rows = np.sort(corners.reshape(len(corners), 12), axis=1)
        is_new = np.array([row.tobytes() not in own for row in rows])
        return is_new & (corners[..., 0].min(axis=1) > middle[0] + 4)

    result = decimate(surface.mesh, surface.placement, 1, bound=Bound(2.0, find_beyond))
    assert not find_beyond(result.mesh).any()
    assert result.mesh.face_count < surface.mesh.face_count
    assert_whole(surface, result)


def test_the_same_bytes_on_any_number_of_threads(extract):
    found = []
    for threads in (1, 2, 3):
        surface = connect_faces(extract(smooth_noise(14, 2.0), border="closed", threads=threads))
        found.append(as_arrays(bounded(surface, 0.3 * np.sqrt(quad_area(surface)))))
    for other in found[1:]:
        for key, value in found[0].items():
            np.testing.assert_array_equal(value, other[key], err_msg=key)
