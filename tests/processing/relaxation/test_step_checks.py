"""Quads that a step of smoothing spoils are found: worse than they may be, reflex at a corner, or folded."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.processing.relaxation.step_checks import NO_SLIVER, SLIVER, Spots, check_kernel
from dmc_cli.processing.tangent_step import make_context
from dmc_cli.runtime.device import Device
from dmc_cli.settings import SurfaceSettings
from tests import shapes
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.fields import volume_of
from tests.mesh.hand_made import working

HEIGHT = 2.5


@pytest.fixture(scope="module")
def context():
    """A surface that is the plane z = 2.5, below which the object is."""
    values = np.broadcast_to(HEIGHT - np.arange(6, dtype=np.float32)[:, None, None], (6, 9, 12))
    return make_context(extract_on("cpu", volume_of(values), SurfaceSettings(isovalue=0.0)).placement.frame)


@pytest.fixture
def check(context):
    """Look at the quads of a flat strip of six after its vertices moved; return those that fail."""

    def call(
        moved, *, tracked=False, normal=0.0, before=None, touched=None, shape=1.0, floor=0.0, also_told=()
    ):
        points, quads = shapes.open_strip(6)
        mesh = working((points, quads))
        count = len(points)
        now, then = (spots_at(points, changed or {}, normal) for changed in (before, moved))
        has_moved = np.zeros(count, np.uint8)
        has_moved[list(range(count) if touched is None else touched)] = 1
        retreat, failing = wp.zeros(count, dtype=wp.uint8), wp.zeros(6, dtype=wp.uint8)
        shapes_now = wp.array(np.broadcast_to(np.float32(shape), 6).copy(), dtype=wp.float32)
        floors = wp.array(np.full(count, floor, np.float32), dtype=wp.float32)
        inputs = [
            context,
            mesh.arrays,
            1.0,
            now,
            then,
            shapes_now,
            floors,
            int(tracked),
            SLIVER if tracked else NO_SLIVER,
            wp.array(has_moved, dtype=wp.uint8),
        ]
        Device("cpu").launch(check_kernel, 6, inputs, [retreat, failing])
        found = np.flatnonzero(failing.numpy())
        assert set(np.flatnonzero(retreat.numpy())) == set(quads[[*found, *also_told]].ravel())
        return found.tolist()

    return call


def spots_at(points, changed, normal):
    """Vertices in the plane, some elsewhere, but for their cells."""
    spots, position = Spots(), points.copy()
    for v, place in changed.items():
        position[v] = place
    node = np.add(points.astype(np.int64), [0, 0, 2])
    spots.position = wp.array(position.astype(np.float32), dtype=wp.vec3)
    spots.cell = wp.array(node @ [1, 12, 12 * 9], dtype=wp.int64)
    spots.local = wp.array(np.tile(np.float32([0, 0, 0.5]), (len(points), 1)), dtype=wp.vec3)
    spots.normal = wp.array(np.tile(np.float32([0, 0, normal]), (len(points), 1)), dtype=wp.vec3)
    return spots


FOLDED = {6: (4, 0, 0.1), 13: (4, 1, 0.1)}
"""The last quad, 5, between vertices 5, 6, 13 and 12, turned over onto quad 4."""


def test_a_step_that_moves_nothing_spoils_nothing(check):
    assert check({}, tracked=True, normal=1.0, floor=1.0) == []


def test_quads_may_get_worse_down_to_the_floors_of_their_vertices(check):
    thinner = {6: (5.5, 0, 0), 13: (5.5, 1, 0)}
    assert check(thinner, floor=0.9) == [5]
    assert check(thinner, floor=0.1) == []
    assert check(thinner, floor=0.9, touched=[0]) == []
    assert check(thinner, floor=0.9, touched=[13]) == [5]
    assert check(thinner, floor=0.9, shape=0.3) == [], "it was worse before"


def test_no_quad_becomes_flat_and_no_corner_turns(check):
    assert check({6: (5, 0, 0), 13: (5, 1, 0)}) == [5]
    assert check(FOLDED, normal=1.0, touched=[6, 13]) == [5]
    assert check(FOLDED, normal=1.0, before=FOLDED) == [], "it was turned before"


def test_no_quad_folds_onto_one_across_a_side(check):
    for tracked in (False, True):
        assert check(FOLDED, tracked=tracked) == [4, 5]
        assert check(FOLDED, tracked=tracked, before=FOLDED) == [], "it was folded before"
    assert check(FOLDED, tracked=True, shape=[1, 1, 1, 1, 1, 0.39]) == [], "slivers may"
    assert check(FOLDED, shape=[1, 1, 1, 1, 1, 0.39]) == [4, 5], "of remeshing alone"
    assert check(FOLDED, tracked=True, shape=[1, 1, 1, 1, 0.39, 1]) == []
    assert check(FOLDED, tracked=True, shape=[0.39, 0.39, 0.39, 0.39, 0.41, 0.41]) == [4, 5]


def test_a_quad_that_stands_still_is_told_of_a_fold_with_it(check):
    """The last quad has turned over; only its neighbour, 4, is looked at."""
    told = check(FOLDED, touched=[4, 11], also_told=[5])
    assert told == [4]


def test_no_quad_is_warped_beyond_the_limit(check):
    """The last quad is a unit square of which one corner has risen."""
    low, high = {13: (6, 1, 0.39)}, {13: (6, 1, 0.4)}  # 29.7 and 30.5 degrees
    assert check(low) == []
    assert check(high) == [5]
    assert check(high, before=high) == [], "it was warped before"
    assert check({13: (6, 1, 0.5)}, before=high) == [], "it was warped before"
    assert check(high, shape=0.39) == [], "slivers may"
    assert check(high, shape=0.39, tracked=True) == [5], "not of remeshing"


def test_no_quad_of_remeshing_is_warped_further_beyond_60_degrees(check):
    below, severe, worse = ({13: (6, 1, z)} for z in (0.9, 1.1, 1.2))  # 56, 63 and 66 degrees
    assert check(below, before={13: (6, 1, 0.5)}, tracked=True) == []
    assert check(severe, before=below) == [], "relaxation alone may"
    assert check(severe, before=below, tracked=True) == [5]
    assert check(worse, before=severe, tracked=True) == [5]
    assert check(severe, before=severe, tracked=True) == [], "it stays as it was"
    assert check(severe, before=worse, tracked=True) == []


def test_at_a_right_angle_no_quad_is_folded_yet(check):
    upright = {6: (5, 0, 1), 13: (5, 1, 1)}
    assert check(upright, tracked=True) == []
    assert check(FOLDED, tracked=True, before=upright) == [4, 5]
