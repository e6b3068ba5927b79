"""Each rule of simplification decides on a mesh that was made for it."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.processing.patterns.masks import list_3x3y
from dmc_cli.processing.patterns.simplify_3x3y import choose_apart, choose_by_paper, judge_topology
from tests import shapes
from tests.measures.meshes import plain_crowded_edges
from tests.mesh.hand_made import numbers, working


def judged(mesh, *quads):
    """Return the cuts of quads, and how many are refused."""
    state = mesh.device.zeros(mesh.face_count, wp.uint8)
    cuts, refused = judge_topology(mesh, numbers(mesh.device.name, *quads), state)
    assert [state.numpy()[q] for q in quads] == [int(cut >= 0) for cut in cuts.numpy()]
    return cuts.numpy().tolist(), int(refused.numpy().sum())


def split_torus():
    """Return a torus with one quad of valences 3, 5, 3, 5, the last."""
    return shapes.split_vertex(shapes.torus(), 27)


def test_a_quad_with_the_pattern_may_go(device):
    mesh = working(split_torus(), device)
    assert list_3x3y(mesh).numpy().tolist() == [64]
    assert judged(mesh, 64) == ([4 * 64], 0)
    assert judged(mesh, 63) == ([-1], 0)


@pytest.mark.parametrize("turn", range(4))
def test_the_cut_starts_at_a_vertex_of_valence_three(turn):
    points, quads = split_torus()
    quads[64] = np.roll(quads[64], turn)
    mesh = working((points, quads))
    (cut,), _ = judged(mesh, 64)
    assert cut == 4 * 64 + turn % 2
    assert mesh.arrays.valence.numpy()[quads.ravel()[cut]] == 3
    assert choose_by_paper(mesh, numbers("cpu", 64), by_color=False).numpy().tolist() == [cut]


@pytest.mark.parametrize("corner", range(4))
@pytest.mark.parametrize("change", [-1, 1])
def test_one_valence_off_is_no_pattern(corner, change):
    mesh = working(split_torus())
    valence = mesh.arrays.valence.numpy()
    v = mesh.arrays.corners.numpy().reshape(-1, 4)[64][corner]
    valence[v] += change
    found = list_3x3y(mesh).numpy().tolist()
    still = valence[v] == 6  # X and Y may have more than five
    assert found == ([64] if still else [])
    assert judged(mesh, 64) == ([4 * 64 if still else -1], 0)


def test_what_went_before_does_not_go_again():
    mesh = working(split_torus())
    mesh.arrays.face_gone.numpy()[64] = 1
    assert judged(mesh, 64) == ([-1], 0)


def test_two_edges_to_one_vertex_are_refused(device):
    points, quads = shapes.shared_tip()
    mesh = working((points, quads), device)
    assert plain_crowded_edges(quads) == 0
    assert mesh.arrays.valence.numpy()[:5].tolist() == [3, 5, 3, 5, 8]
    assert judged(mesh, 0) == ([-1], 1)
    merged = np.where(quads == 2, 0, quads)[1:]
    assert plain_crowded_edges(merged) == 1, "the rule prevents a non-manifold edge"


@pytest.mark.parametrize("side", range(4))
def test_a_neighbor_with_a_defect_keeps_a_quad(side):
    mesh = working(split_torus())
    mesh.arrays.defect.numpy()[mesh.arrays.twin.numpy()[4 * 64 + side] // 4] = 1
    assert judged(mesh, 64) == ([-1], 0)
    assert choose_by_paper(mesh, numbers("cpu", 64), by_color=False).numpy().tolist() == [-1]


def test_a_quad_with_a_defect_stays():
    mesh = working(split_torus())
    mesh.arrays.defect.numpy()[64] = 1
    assert judged(mesh, 64) == ([-1], 0)


def key(q):
    return q * 2654435769 % 2**32


def test_of_two_quads_within_two_steps_the_lower_key_goes_first():
    shape = split_torus()
    twin = working(shape).arrays.twin.numpy().reshape(-1, 4) // 4
    near = set(twin[64]) | {r for q in twin[64] for r in twin[q]}
    far = set(range(64)) - near
    for q in range(64):
        mesh = working(shape)
        state = mesh.device.zeros(mesh.face_count, wp.uint8)
        state.numpy()[[64, q]] = 1
        chosen, waiting = choose_apart(mesh, numbers("cpu", 4 * 64, 4 * q + 1), state)
        first = [key(64) < key(q) or q in far, key(q) < key(64) or q in far]
        assert chosen.numpy().tolist() == [4 * 64 if first[0] else -1, 4 * q + 1 if first[1] else -1]
        assert waiting.numpy()[0] == (not first[0]) + 2 * (not first[1])
