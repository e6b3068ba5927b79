"""Remeshing keeps account of warp: regions share what the mesh has less of, and never have more in all."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.mesh import working_mesh
from dmc_cli.processing.remeshing import rounds
from dmc_cli.processing.remeshing.checks import PatchMeasures
from dmc_cli.processing.remeshing.regions import Regions
from dmc_cli.processing.remeshing.warp_accounts import (
    MOST_SLACK,
    MeshWarp,
    can_pay,
    measure_warp,
    open_accounts,
    pay,
)
from dmc_cli.processing.remeshing.work import EXCESS_LEFT, SEVERE_LEFT, TALLIES, WARPED_LEFT, Work
from dmc_cli.runtime.device import Device
from tests.fields import smooth_noise, white_noise
from tests.processing.remeshing.test_rounds import assert_not_warped, by_patterns, remeshed, warps

CPU = Device("cpu")


def accounts_of(first, now, starts):
    """What each region may make more of, three columns."""
    work = Work()
    work.tally = wp.zeros((len(starts) - 1, TALLIES), dtype=wp.int32)
    starts = wp.array(np.array(starts, dtype=np.int32), dtype=wp.int32)
    regions = Regions(starts.shape[0] - 1, None, starts, None, None, 0)
    open_accounts(work, regions, MeshWarp(*first, 0), MeshWarp(*now, 0), CPU)
    return work.tally.numpy()[:, [WARPED_LEFT, EXCESS_LEFT, SEVERE_LEFT]]


@wp.kernel
def pay_kernel(
    work: Work,
    after: wp.array2d(dtype=wp.int32),
    before: wp.array2d(dtype=wp.int32),
    told: wp.array(dtype=wp.int32),
):
    for n in range(after.shape[0]):
        then = PatchMeasures()
        now = PatchMeasures()
        then.warped = before[n, 0]
        then.warp_excess = before[n, 1]
        now.warped = after[n, 0]
        now.warp_excess = after[n, 1]
        then.severe = before[n, 2]
        now.severe = after[n, 2]
        told[n] = 0
        if can_pay(work, 1, now, then):
            told[n] = 1
            pay(work, 1, now, then)


@pytest.mark.parametrize("make", [lambda: white_noise(16), lambda: smooth_noise(24, 1.0)])
def test_warp_is_measured_as_by_numpy(extract, make):
    surface = by_patterns(extract(make(), border="closed", threads=2))
    beyond = warps(surface)
    beyond = beyond[beyond > 30]
    excess = 1000 * (np.cos(np.radians(30)) - np.cos(np.radians(beyond)))
    found = measure_warp(working_mesh(surface.mesh, surface.placement))
    assert found.warped == len(beyond) > 0
    assert abs(found.excess - np.floor(excess).sum()) <= 2
    assert found.severe == (beyond > 60).sum() > 0
    assert 0 <= found.least_cosine() - np.cos(np.radians(beyond.max())) <= 0.0011


def test_a_mesh_without_severe_quads_may_have_warp_up_to_60_degrees():
    assert MeshWarp(1, 100, 0, 100).least_cosine() == 0.5


def test_shares_are_by_vertices_and_all_of_the_slack():
    found = accounts_of([107, 5000, 9], [100, 4000, 7], [0, 10, 10, 40, 100])
    np.testing.assert_array_equal(found[:, 1], [100, 0, 300, 600])
    assert found.sum(axis=0).tolist() == [7, 1000, 2]
    assert (np.abs(found[:, 0] - 7 * np.array([0.1, 0, 0.3, 0.6])) < 1).all()


def test_there_is_no_slack_where_there_is_more_than_at_first_and_no_overflow():
    assert not accounts_of([5, 9, 1], [6, 9, 2], [0, 4, 8]).any()
    assert not accounts_of([5, 9, 3], [1, 2, 1], [0, 0]).any(), "no vertices, no shares"
    assert accounts_of([10**10] * 3, [0] * 3, [0, 1, 2]).sum(dtype=np.int64) == 3 * MOST_SLACK


def test_what_a_patch_makes_more_of_is_paid_for_and_less_is_a_gain():
    work = Work()
    work.tally = wp.zeros((2, TALLIES), dtype=wp.int32)
    left = [WARPED_LEFT, EXCESS_LEFT, SEVERE_LEFT]
    work.tally.numpy()[1, left] = 2, 50, 1
    steps = [
        ([0, 0, 0], [3, 9, 0], False),  # more than is left
        ([0, 0, 0], [2, 9, 0], True),  # as much
        ([0, 0, 0], [1, 0, 0], False),
        ([4, 90, 2], [4, 90, 2], True),  # as before
        ([3, 20, 0], [0, 20, 0], True),
        ([0, 0, 0], [3, 0, 0], True),  # what was gained
        ([1, 10, 0], [1, 52, 0], False),
        ([1, 10, 0], [1, 51, 0], True),
        ([1, 10, 0], [1, 10, 2], False),
        ([1, 10, 0], [1, 10, 1], True),
        ([1, 10, 0], [1, 10, 1], False),
    ]
    before, after, is_paid = zip(*steps, strict=True)
    told = wp.zeros(len(after), dtype=wp.int32)
    arrays = [wp.array(np.array(values, dtype=np.int32), dtype=wp.int32) for values in (after, before)]
    wp.launch(pay_kernel, 1, [work, *arrays, told], device="cpu")
    assert told.numpy().astype(bool).tolist() == list(is_paid)
    assert work.tally.numpy()[1, left].tolist() == [0, 0, 0]
    assert not work.tally.numpy()[0].any(), "of another region"


@pytest.mark.parametrize("make", [lambda: smooth_noise(32, 1.0), lambda: white_noise(12)])
def test_no_mesh_is_warped_more_whatever_warp_costs(extract, make, monkeypatch):
    """Where warp is cheap, the accounts alone hold it."""
    monkeypatch.setattr(rounds, "FIRST_WARP_PRICE", 0.0)
    monkeypatch.setattr(rounds, "LAST_WARP_PRICE", 0.0)
    before = by_patterns(extract(make(), border="closed", threads=2))
    result = remeshed(before, 6)
    assert result.operations > 0
    assert_not_warped(before, result)
    then, now = (measure_warp(working_mesh(found.mesh, found.placement)) for found in (before, result))
    assert now.excess <= then.excess
