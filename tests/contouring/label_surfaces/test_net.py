"""The net of a label map has the quads that brute force finds, and its shells are closed manifolds."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from tests.contouring.label_surfaces.nets import assert_closed_manifold, brute_force_quads, net_of

MAPS = st.integers(2, 5).flatmap(
    lambda most: hnp.arrays(
        np.uint8,
        hnp.array_shapes(min_dims=3, max_dims=3, min_side=2, max_side=6),
        elements=st.integers(0, most),
    )
)
"""White noise of few labels: every decision on a face, and every flip, comes up."""


def split(shells):
    """The faces of each shell with vertices numbered anew."""
    codes, faces = shells.face_codes.numpy(), shells.faces.numpy()
    for code in np.unique(codes):
        own = faces[codes == code]
        numbers = np.unique(own)
        yield code, np.searchsorted(numbers, own), numbers


@given(MAPS)
def test_quads_are_those_of_brute_force(labels):
    net, _ = net_of(labels)
    expected = brute_force_quads(labels)
    assert net.quad_count == len(expected)
    sides, axes = net.sides.numpy(), net.frames.numpy() & 3
    found = np.column_stack([axes, sides])
    assert np.array_equal(found[np.lexsort(found.T)], expected[:, 3:][np.lexsort(expected[:, 3:].T)])


@given(MAPS)
def test_shells_are_closed_manifolds_and_lie_on_the_net(labels):
    net, shells = net_of(labels)
    vertex_codes, vertices = shells.vertex_codes.numpy(), shells.vertices.numpy()
    for code, faces, numbers in split(shells):
        assert_closed_manifold(faces, len(numbers))
        assert (vertex_codes[numbers] == code).all()
    sides = net.sides.numpy()
    source = np.repeat(np.arange(net.quad_count), np.where(sides[:, 1] == 0, 1, 2))
    is_second = np.append(False, source[1:] == source[:-1]) if len(source) else np.zeros(0, bool)
    expected = net.faces.numpy()[source]
    expected[is_second] = expected[is_second][:, [0, 3, 2, 1]]
    assert np.array_equal(vertices[shells.faces.numpy()], expected)


@pytest.mark.parametrize("labels", [2, 4, 9])
def test_white_noise_needs_flips_and_shells_stay_manifold(labels):
    noise = np.random.default_rng(labels).integers(0, labels, (24, 20, 37), np.uint8)
    net, shells = net_of(noise)
    assert (net.flips.numpy() != 0).sum() > 100
    for _, faces, numbers in split(shells):
        assert_closed_manifold(faces, len(numbers))


def test_a_node_is_a_cube():
    labels = np.zeros((3, 3, 3), np.uint8)
    labels[1, 1, 1] = 7
    net, shells = net_of(labels)
    assert (net.vertex_count, net.quad_count) == (8, 6)
    assert len(shells.vertices.numpy()) == 8


def test_nothing_but_background_is_an_empty_net():
    net, shells = net_of(np.zeros((3, 4, 5), np.uint8))
    assert (net.vertex_count, net.quad_count, len(shells.faces.numpy())) == (0, 0, 0)


@pytest.mark.pool
def test_threads_make_no_difference():
    noise = np.random.default_rng(1).integers(0, 4, (20, 30, 40), np.uint8)
    one, two = net_of(noise, threads=1), net_of(noise, threads=2)
    assert one[0].faces.numpy().tobytes() == two[0].faces.numpy().tobytes()
    assert one[1].faces.numpy().tobytes() == two[1].faces.numpy().tobytes()
