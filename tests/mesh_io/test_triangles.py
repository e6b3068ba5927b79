"""Quads are split along the better diagonal: held against plain angles, and what area is measured by."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.measures.quality import choose_diagonals
from dmc_cli.mesh import mesh_of_file
from dmc_cli.mesh_io.glb.ngons import apart, can_be_told, put_together
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.triangles import fans, triangle_chunks, triangle_count, triangles_of, unit_normals
from dmc_cli.runtime import select_device
from tests import shapes
from tests.mesh_io.layouts import rings, turned
from tests.mesh_io.mixed import faces_of


def least_angle(*points):
    """The smallest angle of a triangle, in radians."""
    angles = []
    for p, q, r in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        a, b = points[q] - points[p], points[r] - points[p]
        angles.append(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1)))
    return min(angles)


def crumpled(seed):
    """A sheet of quads of any shape, with triangles between."""
    draws = np.random.default_rng(seed)
    points, faces = shapes.grid(12, 9)
    faces = faces.copy()
    faces[draws.random(len(faces)) < 0.2, 3] = -1
    points = (points + draws.normal(scale=0.3, size=points.shape)).astype(np.float32)
    return MeshFile(points=points, faces=faces.astype(np.int32))


def test_the_smallest_angle_is_as_large_as_it_can_be():
    mesh = crumpled(0)
    triangles = iter(np.concatenate(list(triangle_chunks(mesh))))
    for face in mesh.faces:
        corners = mesh.points[face].astype(float)
        if face[3] < 0:
            assert next(triangles).tolist() == face[:3].tolist()
            continue
        first, second = next(triangles), next(triangles)
        assert {*first.tolist(), *second.tolist()} == {*face.tolist()}
        along = [
            min(least_angle(*corners[[0, 1, 2]]), least_angle(*corners[[0, 2, 3]])),
            min(least_angle(*corners[[1, 2, 3]]), least_angle(*corners[[1, 3, 0]])),
        ]
        found = min(least_angle(*mesh.points[t].astype(float)) for t in (first, second))
        assert found == pytest.approx(max(along), abs=1e-4)
    assert next(triangles, None) is None


@pytest.mark.parametrize("seed", range(3))
def test_the_diagonals_are_those_that_area_is_measured_by(seed):
    mesh = crumpled(seed)
    mesh = MeshFile(points=mesh.points, faces=mesh.faces[mesh.faces[:, 3] >= 0])
    measured = choose_diagonals(mesh_of_file(mesh, select_device("cpu"))).numpy()
    np.testing.assert_array_equal(
        fans(mesh, mesh.faces)[:, 0], mesh.faces[np.arange(len(measured)), measured]
    )


def test_a_tie_goes_along_the_first_corner_and_a_quad_without_area_is_split():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    faces = np.array([[0, 1, 2, 3], [1, 2, 3, 0], [0, 0, 1, 1]], np.int32)
    mesh = MeshFile(points=points, faces=faces)
    assert np.concatenate(list(triangle_chunks(mesh))).tolist() == [
        [0, 1, 2], [0, 2, 3], [1, 2, 3], [1, 3, 0], [0, 0, 1], [0, 1, 1],
    ]  # fmt: skip
    assert triangle_count(mesh) == 6


def test_normals_are_of_unit_length_and_zero_without_area():
    corners = np.array([[[0, 0, 0], [2, 0, 0], [0, 3, 0]], [[0, 0, 0], [1, 1, 1], [2, 2, 2]]], np.float32)
    assert unit_normals(corners).tolist() == [[0, 0, 1], [0, 0, 0]]


@given(data=st.data())
def test_quads_are_told_by_the_order_of_their_triangles(data):
    """Whatever corners neighbours share, and wherever a chunk begins."""
    faces = data.draw(faces_of(6))
    faces = faces[[len(set(ring)) == len(ring) for ring in rings(faces)]]
    if not len(faces):
        return
    assert can_be_told(faces)
    first = apart(faces[: len(faces) // 2], -1) if len(faces) > 1 else faces[:0]
    last = int(first[-1, 0]) if len(first) else -1
    ordered = np.concatenate([first, apart(faces[len(faces) // 2 if len(faces) > 1 else 0 :], last)])
    assert [turned(ring) for ring in rings(ordered)] == [turned(ring) for ring in rings(faces)]
    assert all(one[0] != other[0] for one, other in pairwise(ordered.tolist()))
    counts, corners = put_together(triangles_of(ordered))
    found = [tuple(ring.tolist()) for ring in np.split(corners, np.cumsum(counts)[:-1])]
    assert found == rings(ordered)
