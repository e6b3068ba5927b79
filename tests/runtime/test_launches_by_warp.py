"""Launches that are left to Warp, where its kernels or records are others, are cut into pieces as well."""

import pytest
import warp as wp
from hypothesis import given, settings, strategies as st

from dmc_cli.runtime import worker_pool
from tests.runtime.launcher import Launcher, count_visits_kernel, visits_of


def test_kernels_that_take_their_arguments_otherwise_are_left_to_warp(monkeypatch):
    monkeypatch.setattr(worker_pool, "takes_structs", lambda source, kernel: False)
    shared = Launcher(2)
    shared.wake()
    assert (visits_of(shared, 1000, 10)[:1000] == 1).all()
    assert shared.pool._workers == []


@pytest.mark.pool
@pytest.mark.parametrize("error", [AttributeError, FileNotFoundError, TypeError])
def test_a_warp_whose_records_are_others_launches_by_itself(error, monkeypatch):
    def fail(self):
        raise error("other records")

    monkeypatch.setattr(worker_pool.CompiledKernel, "source", property(fail))
    shared = Launcher(2)
    assert shared.pool.fallback
    assert (visits_of(shared, 1000, 10, ahead=True)[:1000] == 1).all()


@settings(deadline=None)
@given(st.integers(1, 300), st.integers(1, 400))
def test_warps_own_launches_visit_each_index_once(dim, size):
    visits = wp.zeros(dim + 1, dtype=wp.int32, device="cpu")
    worker_pool.launch_in_pieces(count_visits_kernel, dim, [0, 1, visits], size)
    assert visits.numpy().tolist() == dim * [1] + [0]


def test_pieces_of_warps_own_launches_last_neither_short_nor_long(monkeypatch):
    sizes = []
    clock = [0.0]

    def launch(kernel, count, arguments, device):
        sizes.append((arguments[0], count))
        clock[0] += 0.0009 * count  # nearly a millisecond an index

    monkeypatch.setattr(worker_pool, "launch_by_warp", launch)
    monkeypatch.setattr(worker_pool.time, "perf_counter", lambda: clock[0])
    worker_pool.launch_in_pieces(None, 500, [0], 1)
    assert [size for _, size in sizes[:6]] == [1, 2, 4, 8, 16, 32]
    assert all(20 <= size <= 120 for _, size in sizes[5:-1])
    assert sum(size for _, size in sizes) == 500
    sizes.clear()
    worker_pool.launch_in_pieces(None, 1000, [0], 400)
    assert [size for _, size in sizes[:4]] == [400, 200, 100, 100]
