"""Twins paired by vertices."""

import numpy as np
import pytest
import warp as wp
from hypothesis import given, strategies as st

from dmc_cli.mesh.twins import LONGEST_LIST, find_twins, pair_halfedges
from dmc_cli.runtime.device import Device
from tests import shapes
from tests.measures.meshes import face_edges


def check(faces, twins):
    ends = {h: (a, b) for _, a, b, h in face_edges(faces)}
    for h, twin in enumerate(twins.tolist()):
        if twin >= 0:
            assert twins[twin] == h
            assert ends[twin] == ends[h][::-1]


@pytest.mark.parametrize("shape", [shapes.cube(), shapes.torus(), shapes.tetrahedron(), shapes.house()])
def test_every_halfedge_of_a_closed_mesh_has_its_twin(shape):
    faces = shape[1]
    twins = pair_halfedges(faces)
    check(faces, twins)
    assert np.array_equal(twins.reshape(-1, 4) >= 0, faces >= 0)


def test_a_strip_has_twins_inside_only():
    assert np.count_nonzero(pair_halfedges(shapes.open_strip(5)[1]) >= 0) == 8


def test_halfedges_that_run_the_same_way_are_no_twins():
    twins = pair_halfedges(shapes.moebius_strip(5)[1])
    assert np.count_nonzero(twins >= 0) == 8


def test_at_a_crowded_edge_the_first_up_meets_the_first_down():
    faces = np.array([[0, 1, 2, 3], [0, 1, 4, 5], [1, 0, 6, 7], [1, 0, 8, 9], [0, 1, 10, 11]], dtype=np.int32)
    twins = pair_halfedges(faces)
    assert [int(twins[h]) for h in (0, 4, 8, 12, 16)] == [8, 12, 0, 4, -1]


def test_a_halfedge_from_a_vertex_to_itself_has_no_twin():
    assert (pair_halfedges(np.array([[0, 1, 1, 2], [1, 1, 0, 3]], dtype=np.int32))[[1, 4]] == -1).all()


def test_no_faces_have_no_twins():
    assert pair_halfedges(np.zeros((0, 4), dtype=np.int32)).shape == (0,)


@given(st.lists(st.lists(st.integers(0, 5), min_size=4, max_size=4), max_size=20))
def test_twins_are_an_involution_and_none_is_missed(rows):
    faces = np.array(rows, dtype=np.int32).reshape(-1, 4)
    twins = pair_halfedges(faces)
    check(faces, twins)
    single = [(a, b) for _, a, b, h in face_edges(faces) if twins[h] < 0 and a != b]
    assert not {(b, a) for a, b in single} & set(single)


def twins_on(device, faces, vertex_count, threads=3):
    corners = wp.array(faces, dtype=wp.vec4i, device=device)
    return find_twins(Device(device, threads), corners, vertex_count).numpy()


@pytest.mark.parametrize(
    "shape",
    [
        shapes.cube(),
        shapes.torus(60, 70),
        shapes.house(),
        shapes.moebius_strip(),
        shapes.edge_to_edge_cubes(),
    ],
)
def test_the_device_finds_the_same_twins(device, shape):
    points, faces = shape
    faces = faces[np.random.default_rng(1).permutation(len(faces))]
    assert np.array_equal(twins_on(device, faces, len(points)), pair_halfedges(faces))


@given(st.lists(st.lists(st.integers(-1, 5), min_size=4, max_size=4), max_size=20))
def test_the_device_finds_the_same_twins_in_any_soup(rows):
    faces = np.array(rows, dtype=np.int32).reshape(-1, 4)
    faces[:, :3] = np.abs(faces[:, :3])
    assert np.array_equal(twins_on("cpu", faces, 6), pair_halfedges(faces))


def test_a_vertex_with_very_many_faces_is_paired_too(device):
    n = LONGEST_LIST
    rim = np.arange(1, n + 1)
    faces = np.column_stack([np.zeros(n), rim, np.roll(rim, -1), np.full(n, -1)]).astype(np.int32)
    twins = twins_on(device, faces, n + 1).reshape(-1, 4)
    assert (twins[:, [0, 2]] >= 0).all()
    assert (twins[:, [1, 3]] == -1).all()
