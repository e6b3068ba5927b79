"""Remeshing's operations on hand-made meshes do what they should, and each rule refuses what it should."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.mesh.check_halfedges import check_halfedges
from dmc_cli.processing.remeshing.chains import ASCENT, DEPTH
from dmc_cli.processing.remeshing.work import CORE, JOURNAL, PATCH
from tests import shapes
from tests.mesh.meshes import euler_and_components
from tests.processing.remeshing.bench import (
    COLLAPSE,
    ROTATE,
    SPLIT,
    Bench,
    better_kernel,
    chance_kernel,
    worse_kernel,
)

UNKNOWN, OFF_REGION = 98, 99


def left(bench):
    """Quads, twins, starts and valences of what is there, renumbered, checked to be a whole mesh."""
    found = bench.arrays()
    stays, there = found["face_gone"] == 0, found["vertex_gone"] == 0
    quad, vertex = np.cumsum(stays) - 1, np.cumsum(there) - 1
    quads = vertex[found["corners"].reshape(-1, 4)[stays]]
    twin = found["twin"].reshape(-1, 4)[stays].ravel()
    twin = 4 * quad[twin >> 2] + (twin & 3)
    start = found["vertex_halfedge"][there]
    start = 4 * quad[start >> 2] + (start & 3)
    check_halfedges(quads, twin, start)
    assert (np.bincount(quads.ravel()) == found["valence"][there]).all()
    return quads, twin, found["valence"][there]


def irregularity(valence):
    return int(((valence - 4) ** 2).sum())


OPERATIONS = [
    (ROTATE, 0, 0),
    (ROTATE, 0, 1),
    (COLLAPSE, 0, 0),
    (SPLIT, 0, 2),
]


@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize(("kind", "_", "detail"), OPERATIONS)
def test_an_operation_leaves_a_whole_mesh_and_can_be_taken_back(kind, _, detail, place):
    bench = Bench(shapes.torus())
    before, mesh = bench.arrays(), left(bench)
    h = 4 * 27 + place
    cost = bench.costs(h)[{ROTATE: detail, COLLAPSE: 2}.get(kind, 2)]
    change, taken, sound = bench.do(kind, h, detail)
    after, (quads, twin, valence) = bench.arrays(), left(bench)
    assert sound
    assert euler_and_components(quads, twin) == euler_and_components(*mesh[:2])
    assert change == irregularity(valence) - irregularity(mesh[2])
    assert taken == len(mesh[0]) - len(quads) == {ROTATE: 0, COLLAPSE: 1, SPLIT: -1}[kind]
    if kind != SPLIT:
        assert change == cost
    bench.again(back=True)
    for name, array in before.items():
        np.testing.assert_array_equal(bench.arrays()[name], array, err_msg=name)
    bench.again(back=False)
    for name, array in after.items():
        np.testing.assert_array_equal(bench.arrays()[name], array, err_msg=name)


@pytest.mark.parametrize("forward", [0, 1])
def test_rotating_takes_the_edge_from_its_ends_to_their_neighbors(forward):
    bench = Bench(shapes.torus())
    h = 4 * 27
    before = bench.arrays()
    c, t = before["corners"], before["twin"][h]
    bench.do(ROTATE, h, forward)
    change = bench.arrays()["valence"] - before["valence"]
    step = 2 if forward else 3
    gained = [c[(h & ~3) | ((h + step) & 3)], c[(t & ~3) | ((t + step) & 3)]]
    assert sorted(np.flatnonzero(change == 1)) == sorted(gained)
    assert sorted(np.flatnonzero(change == -1)) == sorted([c[h], c[h + 1]])
    edge = set(bench.arrays()["corners"][[h, t]].tolist())
    assert edge == set(gained)


def test_collapsing_joins_the_ends_of_the_diagonal():
    bench = Bench(shapes.torus())
    corners = bench.arrays()["corners"][4 * 27 : 4 * 27 + 4]
    bench.do(COLLAPSE, 4 * 27 + 1)
    found = bench.arrays()
    assert found["vertex_gone"][corners[1]] == 1
    assert found["face_gone"][27] == 1
    assert found["valence"][corners].tolist() == [3, 4, 3, 6]


def test_splitting_makes_two_vertices_of_one():
    bench = Bench(shapes.torus())
    h = 4 * 27 + 1
    v, side = bench.arrays()["corners"][[h, 4 * 27 + 2]]
    bench.do(SPLIT, h, 2)
    found = bench.arrays()
    assert found["vertex_gone"][bench.vertices] == found["face_gone"][bench.quads] == 0
    assert found["valence"][[v, bench.vertices, side]].tolist() == [3, 3, 5]


@pytest.mark.parametrize(("steps", "is_done"), [(1, False), (2, True), (3, False)])
def test_a_vertex_is_split_with_two_quads_on_either_side_at_least(steps, is_done):
    assert (Bench(shapes.torus()).do(SPLIT, 8, steps) is not None) == is_done


@pytest.mark.parametrize(("spare", "is_done"), [(0, False), (1, True)])
def test_no_vertex_is_split_without_a_spare(spare, is_done):
    assert (Bench(shapes.torus()).do(SPLIT, 8, 2, spare) is not None) == is_done


@pytest.mark.parametrize(("kind", "_", "detail"), OPERATIONS)
def test_nothing_is_done_off_the_region(kind, _, detail):
    for away in range(4):
        bench = Bench(shapes.torus())
        before = bench.arrays()
        v = before["corners"][4 * 27 + away]
        bench.work.vertex_region.numpy()[v] = -1
        done = bench.do(kind, 4 * 27, detail)
        if kind != SPLIT or away < 2:
            assert done is None
            for name, array in before.items():
                np.testing.assert_array_equal(bench.arrays()[name], array, err_msg=name)


def test_costs_off_the_region_and_of_doublets_are_told():
    torus = Bench(shapes.torus())
    assert torus.costs(8) == [4, 4, 2 + 4]
    for end in (8, 9):
        torus = Bench(shapes.torus())
        torus.work.vertex_region.numpy()[torus.work.mesh.corners.numpy()[end]] = -1
        assert torus.costs(8)[:2] == [OFF_REGION, OFF_REGION]
        torus = Bench(shapes.torus())
        torus.work.mesh.valence.numpy()[torus.work.mesh.corners.numpy()[end]] = 3
        assert torus.costs(8)[:2] == [UNKNOWN, UNKNOWN]
    for side in (9, 11):
        torus = Bench(shapes.torus())
        torus.work.mesh.valence.numpy()[torus.work.mesh.corners.numpy()[side]] = 3
        assert torus.costs(8)[2] == 0


def test_the_cube_is_sound_and_what_has_a_vertex_twice_is_not():
    assert Bench(shapes.cube()).sound().all()
    assert Bench(shapes.torus()).sound().all()
    points, quads = shapes.shared_tip()
    bench = Bench((points, quads))
    assert np.flatnonzero(~bench.sound()).tolist() == [1, 3, 4], "1 and 3 have 4 twice on the other side"
    assert bench.do(COLLAPSE, 0)[2] is False
    assert not bench.sound()[1], "the merged vertex has the tip as a neighbour twice"


@pytest.mark.parametrize(("valence", "is_sound"), [(8, True), (9, False)])
def test_valences_of_three_to_eight_are_sound(valence, is_sound):
    quads = [[0, 1 + 2 * n, 2 + 2 * n, 1 + (2 * n + 2) % (2 * valence)] for n in range(valence)]
    back = [
        [q[3] if n == 1 else 1 + 2 * valence if n == 0 else q[1] if n == 3 else q[2] for n in range(4)]
        for q in quads
    ]
    points = np.zeros((2 + 2 * valence, 3))
    bench = Bench((points, np.array(quads + back, dtype=np.int32)))
    assert bench.sound()[0] == is_sound


def test_two_rings_at_a_vertex_are_not_sound():
    points, quads = shapes.corner_to_corner_cubes()
    shared = int(np.flatnonzero(np.bincount(quads.ravel()) == 6)[0])
    sound = Bench((points, quads)).sound()
    assert np.flatnonzero(~sound).tolist() == [shared]


FLAT = (0, 0, 0, 1.0)
"""No quad that is warped, no excess, none severe, and the cosine of no warp."""


def worse(after, before, budget=0.6):
    told = wp.zeros(1, dtype=wp.int32)
    arrays = [patch_numbers(values) for values in (after, before)]
    wp.launch(worse_kernel, 1, [*arrays, budget, told], device="cpu")
    return bool(told.numpy()[0])


def patch_numbers(values):
    """Measures of a patch as kernels of the bench take them; what is left out is flat."""
    return wp.array(np.array([values + FLAT[len(values) - 3 :]], dtype=np.float32), dtype=wp.float32)


@pytest.mark.parametrize(
    ("after", "is_worse"),
    [
        # sum of 1 - shape, of which 0.6 counts; least shape; inverted
        ((0.9, 0.5, 1), False),
        ((1.01, 0.5, 1), True),
        ((0.9, 0.3001, 1), False),  # below 0.3 no worse than before
        ((0.9, 0.29, 1), True),
        ((0.9, 0.5, 0), False),
        ((0.9, 0.5, 2), True),
        # and warped, which cost 0.2 each; thousandths of excess, 0.01 each; severe; cosine of the largest
        ((0.6, 0.5, 1, 1, 0, 0, 0.87), False),
        ((0.7, 0.5, 1, 1, 0, 0, 0.87), True),
        ((0.6, 0.5, 1, 1, 3, 0, 0.87), False),
        ((0.6, 0.5, 1, 1, 5, 0, 0.87), True),
        ((0.0, 0.5, 1, 1, 5, 0, 0.51), False),
        ((0.0, 0.5, 1, 1, 5, 1, 0.49), True),
        ((0.0, 0.5, 1, 1, 5, 0, 0.49), True),
    ],
)
def test_a_patch_may_not_cost_more_get_a_worse_quad_or_turn_or_warp_one_severely(after, is_worse):
    assert worse(after, (9.0, 0.8, 1)) == is_worse


def test_a_quad_that_was_bad_may_stay_so():
    assert not worse((0.9, 0.2, 0), (9.0, 0.2, 0))
    assert worse((0.9, 0.19, 0), (9.0, 0.2, 0))
    assert not worse((0.5, 0.5, 0, 1, 3, 1, -0.2), (9.0, 0.5, 0, 1, 3, 1, -0.2))
    assert worse((0.5, 0.5, 0, 1, 3, 1, -0.21), (9.0, 0.5, 0, 1, 3, 1, -0.2))
    assert worse((0.0, 0.5, 0, 2, 3, 2, -0.2), (9.0, 0.5, 0, 1, 3, 1, -0.2))


def better(after, before, may_fold=0):
    told = wp.zeros(1, dtype=wp.int32)
    numbers = [np.array([[*values, 0.9][:7]], dtype=np.float32) for values in (after, before)]
    arrays = [wp.array(values, dtype=wp.float32) for values in numbers]
    folds = wp.array(np.array([may_fold], dtype=np.int32), dtype=wp.int32)
    wp.launch(better_kernel, 1, [*arrays, folds, told], device="cpu")
    return bool(told.numpy()[0])


BEFORE = (0.5, 1, 2, 0.2, 0.0, 1)
HIGH = (0.5, 1, 2, 0.6, 0.1, 1)


@pytest.mark.parametrize(
    ("before", "after", "may_fold", "is_better"),
    [
        # shape, turned, folds, height, excess, warped, cosine of the largest warp
        (BEFORE, (0.6, 1, 2, 0.2, 0.0, 1), 0, True),
        (BEFORE, (0.50005, 1, 2, 0.2, 0.0, 1), 0, False),  # not worth it
        (BEFORE, (0.6, 2, 2, 0.2, 0.0, 1), 0, False),
        (BEFORE, (0.6, 0, 1, 0.2, 0.0, 1), 0, True),
        (BEFORE, (0.6, 1, 2, 0.2, 0.0, 0), 0, True),
        (BEFORE, (0.6, 1, 2, 0.2, 0.0, 2), 0, False),
        (BEFORE, (0.6, 1, 2, 0.2, 0.0, 1, 0.21), 0, True),
        (BEFORE, (0.6, 1, 2, 0.2, 0.0, 1, 0.19), 0, False),
        ((0.39, 1, 2, 0.2, 0.0, 1), (0.45, 1, 2, 0.2, 0.0, 2), 0, True),  # a sliver may warp
        ((0.39, 1, 2, 0.2, 0.0, 1), (0.45, 1, 2, 0.2, 0.0, 2, 0.19), 0, False),
        ((0.39, 1, 2, 0.2, 0.0, 1, -0.5), (0.45, 1, 2, 0.2, 0.0, 2, -0.5), 0, True),
        (BEFORE, (0.6, 1, 3, 0.2, 0.0, 1), 0, False),
        (BEFORE, (0.6, 1, 3, 0.2, 0.0, 1), 1, False),  # only high ones may fold
        (BEFORE, (0.6, 1, 2, 0.34, 0.0, 1), 0, True),
        (BEFORE, (0.6, 1, 2, 0.36, 0.0, 1), 0, False),
        (BEFORE, (0.6, 1, 2, 0.2, 0.01, 1), 0, False),
        ((0.39, 1, 2, 0.2, 0.0, 1), (0.45, 1, 3, 0.2, 0.0, 1), 0, True),  # a sliver may fold
        (HIGH, (0.5, 1, 2, 0.6, 0.09, 1), 0, True),
        (HIGH, (0.41, 1, 2, 0.6, 0.09, 1), 0, True),
        (HIGH, (0.39, 1, 2, 0.6, 0.09, 1), 0, False),  # no sliver may come of it
        (HIGH, (0.9, 1, 2, 0.6, 0.09995, 1), 0, False),
        (HIGH, (0.5, 1, 3, 0.6, 0.0, 1), 0, False),
        (HIGH, (0.5, 1, 3, 0.6, 0.0, 1), 1, True),
        (HIGH, (0.5, 1, 2, 0.61, 0.0, 1), 0, False),
        (HIGH, (0.5, 2, 2, 0.6, 0.0, 1), 1, False),
    ],
)
def test_mending_takes_what_is_better_and_no_worse_otherwise(before, after, may_fold, is_better):
    assert better(after, before, may_fold) == is_better


def test_chance_is_a_hash_and_its_bytes_choose():
    numbers = np.array([0, 1, 0xFF, 0x12345678, 0xFFFFFFFF, 0x80000000, 7, 1 << 23], dtype=np.uint32)
    count = len(numbers)
    choices, changes = (wp.zeros((count, n), dtype=wp.int32) for n in (4, 3))
    hashes, allowed = wp.zeros(count, dtype=wp.uint32), wp.zeros(count, dtype=wp.float32)
    outputs = [choices, hashes, allowed, changes]
    wp.launch(chance_kernel, count, [wp.array(numbers, dtype=wp.uint32), *outputs], device="cpu")
    parts = (numbers[:, None] >> np.array([0, 8, 16, 24], dtype=np.uint32)) & 255
    np.testing.assert_array_equal(choices.numpy(), parts.astype(np.int32) * 10 >> 8)
    assert hashes.numpy().tolist() == [scrambled(int(n)) for n in numbers]
    u = (numbers | 1) / 2.0**32
    # between the powers of two the logarithm is a straight line, at most 0.0861 off its base-2 value
    np.testing.assert_allclose(allowed.numpy(), -2 * np.log(u), atol=2 * 0.0861 * np.log(2))
    np.testing.assert_allclose(allowed.numpy()[[5]], -2 * np.log(0.5), rtol=1e-6)
    n = np.arange(count)[:, None]
    more = np.array([-1, 0, 1])
    np.testing.assert_array_equal(changes.numpy(), (n + more - 4) ** 2 - (n - 4) ** 2)


def scrambled(number):
    """Return the 32-bit hash of O'Neill's generator, in plain Python."""
    state = (number * 747796405 + 2891336453) % 2**32
    word = ((state >> ((state >> 28) + 4)) ^ state) * 277803737 % 2**32
    return (word >> 22) ^ word


def test_a_chain_goes_on_by_the_cheapest_rotation_and_never_back():
    bench = Bench(shapes.torus())
    bench.do(ROTATE, 8, 1)
    irregular = np.flatnonzero(bench.work.mesh.valence.numpy()[: bench.vertices] != 4)
    h, forward = bench.next_link(irregular)
    cost = bench.costs(h)[int(forward)]
    around = {
        4 * q + c
        for q in range(bench.quads)
        for c in range(4)
        if np.isin(bench.work.mesh.corners.numpy()[4 * q : 4 * q + 4], irregular).any()
    }
    assert cost == min(c for side in around for c in bench.costs(side)[:2])
    twin = int(bench.work.mesh.twin.numpy()[h])
    for known in (h, twin):
        found = bench.next_link(irregular, [known])
        assert found is None or found[0] not in (h, twin)


def test_a_chain_ends_somewhere():
    bench = Bench(shapes.torus())
    bench.do(ROTATE, 8, 1)
    irregular = np.flatnonzero(bench.work.mesh.valence.numpy()[: bench.vertices] != 4)
    off = [4 * 60] * int(DEPTH)
    assert bench.next_link(irregular, off[:-1]) is not None
    assert bench.next_link(irregular, off) is None
    assert bench.next_link([]) is None
    assert Bench(shapes.torus()).next_link(range(8)) is None, "regular vertices lead nowhere"
    assert ASCENT == 2


def test_a_full_journal_or_list_of_vertices_fails_and_all_is_taken_back():
    bench = Bench(shapes.torus())
    valence = bench.arrays()["valence"]
    assert bench.filled(JOURNAL - 1, CORE - 1) == [0, 0, 0, 0]
    assert bench.filled(JOURNAL, CORE) == [0, 1, 0, 1]
    np.testing.assert_array_equal(bench.arrays()["valence"], valence)


def test_a_patch_has_each_quad_round_its_vertices_once():
    bench = Bench(shapes.torus(12, 30))
    corners = bench.arrays()["corners"].reshape(-1, 4)
    for vertices in ([5], [5, 6], [0, 1, 5, 6, 40], list(range(0, 68, 2))):
        patch, is_full = bench.patch(vertices)
        assert not is_full
        assert sorted(patch) == np.flatnonzero(np.isin(corners, vertices).any(axis=1)).tolist()
        assert set(patch[:4]) == set(np.flatnonzero((corners == vertices[0]).any(axis=1)))


@pytest.mark.parametrize(("count", "is_full"), [(36, False), (37, True)])
def test_a_full_patch_fails(count, is_full):
    """Vertices with four quads each that no other has: 36 of them fill the list."""
    points, quads = shapes.torus(12, 30)
    apart = [30 * i + j for i in range(0, 12, 2) for j in range(0, 30, 2)][:count]
    patch, found = Bench((points, quads)).patch(apart)
    assert (len(patch), found) == (PATCH, is_full)


def test_what_has_gone_has_no_patch():
    bench = Bench(shapes.torus())
    bench.work.mesh.vertex_gone.numpy()[9] = 1
    assert bench.patch([9]) == ([], False)
