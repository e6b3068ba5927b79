"""Threads that share a launch: each index once, whatever the chunks; kernels called as Warp calls them."""

import gc
import time
import weakref
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest
import warp as wp
from hypothesis import given, settings, strategies as st

from dmc_cli.runtime import worker_pool
from dmc_cli.runtime.device import Device
from dmc_cli.runtime.worker_pool import WorkerPool
from tests.runtime.launcher import Launcher, count_visits_kernel, note_order_kernel, visits_of

wp.set_module_options({"enable_backward": False})


@settings(deadline=None)
@given(st.integers(1, 7), st.integers(1, 5000), st.integers(1, 400), st.integers(1, 5))
def test_each_index_is_visited_once_a_launch(threads, dim, grain, launches):
    visits = visits_of(Launcher(threads), dim, grain, 3, launches)
    assert (visits[:dim] == 3 * launches).all()
    assert visits[dim] == 0


def test_many_short_launches_lose_nothing():
    shared = Launcher(4)
    assert (visits_of(shared, 1000, 10, launches=5000)[:1000] == 5000).all()


@settings(deadline=None)
@given(st.integers(1, 4), st.lists(st.tuples(st.integers(1, 3000), st.booleans()), min_size=1, max_size=8))
def test_a_launch_that_was_begun_is_done_before_the_next(threads, launches):
    """Each launch doubles what the one before left, and adds 1."""
    shared = Launcher(threads)
    values = wp.zeros(3000, dtype=wp.int32, device="cpu")
    expected = np.zeros(3000, np.int32)
    for dim, ahead in launches:
        (shared.begin if ahead else shared.launch)(double_and_add_kernel, dim, [0, dim, values], 50)
        expected[:dim] = (2 * expected[:dim] + 1)[::-1]
    shared.finish()
    assert np.array_equal(values.numpy(), expected)


@wp.kernel
def double_and_add_kernel(first: wp.int32, dim: wp.int32, values_inout: wp.array(dtype=wp.int32)):
    """Swap an item with that at the other end, both doubled and 1 more. The lower one's thread does it."""
    low = first + wp.tid()
    high = dim - 1 - low
    if low <= high:
        value = values_inout[low]
        values_inout[low] = 2 * values_inout[high] + 1
        values_inout[high] = 2 * value + 1


def test_workers_go_on_while_the_caller_does_something_else():
    """The chunk of each waits for the other: the one that the caller does not take is a worker's."""
    shared = Launcher(3)
    places = wp.zeros(2, dtype=wp.int32, device="cpu")
    shared.begin(meet_kernel, 2, [0, places], 1)
    deadline = time.monotonic() + 30
    while places.numpy().tolist() != [1, 1]:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    shared.finish()


@pytest.mark.pool
def test_arrays_live_until_a_launch_that_was_begun_is_done():
    shared = Launcher(2)
    visits = wp.zeros(1000, dtype=wp.int32, device="cpu")
    alive = weakref.ref(visits)
    shared.begin(count_visits_kernel, 1000, [0, 1, visits], 10)
    del visits
    gc.collect()
    assert alive() is not None
    shared.finish()
    gc.collect()
    assert alive() is None


def test_callers_finish_what_others_have_begun():
    shared = Launcher(2)

    def begin_many() -> np.ndarray:
        visits = wp.zeros(3000, dtype=wp.int32, device="cpu")
        for _ in range(300):
            shared.begin(count_visits_kernel, 3000, [0, 1, visits], 10)
        shared.finish()
        return visits.numpy()

    with ThreadPoolExecutor(4) as pool:
        runs = [pool.submit(begin_many) for _ in range(4)]
        assert all((run.result() == 300).all() for run in runs)


@pytest.mark.pool
@pytest.mark.parametrize("threads", [1, 4])
def test_workers_can_be_woken_ahead(threads):
    shared = Launcher(threads)
    shared.wake()
    assert shared.workers_awake() == threads - 1
    assert (visits_of(shared, 1000, 10)[:1000] == 1).all()


def test_workers_sleep_when_there_is_nothing_to_do_and_wake_again():
    shared = Launcher(2)
    for _ in range(3):
        assert (visits_of(shared, 1000, 10)[:1000] == 1).all()
        deadline = time.monotonic() + 30
        while shared.workers_awake():
            assert time.monotonic() < deadline
            time.sleep(0.01)


def test_a_launch_of_one_chunk_wakes_nobody():
    shared = Launcher(2)
    visits_of(shared, 1000, 1000)
    assert shared.pool._workers == []


def test_workers_take_their_share():
    """The launching thread's chunks wait until the worker has had one: it finishes only if it does."""
    shared = Launcher(2)
    places = wp.zeros(2, dtype=wp.int32, device="cpu")
    shared.launch(meet_kernel, 2, [0, places], 1)
    assert places.numpy().tolist() == [1, 1]


@wp.func_native(
    """
    volatile wp::int32* here = (volatile wp::int32*)places.data;
    here[n] = 1;
    for (long long turn = 0; turn < 20000000000ll && !here[1 - n]; ++turn) {}
    """
)
def meet(places: wp.array(dtype=wp.int32), n: wp.int32):
    """Wait, for seconds at most, until the other one is there too."""
    ...


@wp.kernel
def meet_kernel(first: wp.int32, places_out: wp.array(dtype=wp.int32)):
    """Wait for the thread with the other index."""
    meet(places_out, first + wp.tid())


def test_several_callers_share_the_workers():
    shared = Launcher(2)
    with ThreadPoolExecutor(4) as pool:
        runs = [pool.submit(visits_of, shared, 3000, 10, 1, 300) for _ in range(4)]
        assert all((run.result()[:3000] == 300).all() for run in runs)


@pytest.mark.pool
def test_only_as_many_workers_wake_as_there_are_chunks_for():
    shared = Launcher(8)
    visits_of(shared, 1000, 400)
    assert len(shared.pool._workers) == 1


@pytest.mark.pool
def test_a_launch_that_is_begun_wakes_no_more_than_one_that_is_waited_for():
    shared = Launcher(3)
    visits_of(shared, 1000, 10, ahead=True)
    assert len(shared.pool._workers) == 2


def test_jobs_end_when_their_chunks_do_so_that_workers_sleep():
    """Nobody sees the launch done, but whoever finds no chunk left closes it."""
    shared = Launcher(3)
    visits = wp.zeros(1000, dtype=wp.int32, device="cpu")
    shared.begin(count_visits_kernel, 1000, [0, 1, visits], 10)
    deadline = time.monotonic() + 30
    while shared.workers_awake() or not visits.numpy().all():
        assert time.monotonic() < deadline
        time.sleep(0.01)
    shared.finish()


@pytest.mark.pool
def test_a_pool_grows_to_the_most_that_was_asked_for():
    shared = Launcher(3)
    visits_of(shared, 1000, 10)
    for threads in (1, 2, 3):
        shared.threads = threads
        visits_of(shared, 1000, 10)
    assert len(shared.pool._workers) == 2
    shared.threads = 5
    visits_of(shared, 1000, 10)
    assert len(shared.pool._workers) == 4


def test_a_launch_has_no_more_workers_than_it_asks_for():
    """With one thread each index is done by the caller, in order, although workers are awake."""
    shared = Launcher(4)
    order = wp.zeros(20_001, dtype=wp.int32, device="cpu")
    shared.wake()
    shared.threads = 1
    shared.launch(note_order_kernel, 20_000, [0, order], 1)
    assert np.array_equal(order.numpy()[1:], np.arange(20_000))


def test_where_no_thread_can_be_made_the_caller_works_alone(monkeypatch):
    def refuse(self):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(worker_pool.Thread, "start", refuse)
    shared = Launcher(4)
    shared.wake()
    assert (visits_of(shared, 1000, 10, launches=3)[:1000] == 3).all()
    assert (visits_of(shared, 1000, 10, launches=3, ahead=True)[:1000] == 3).all()
    assert shared.pool._workers == []


def test_workers_end_with_their_pool():
    shared = Launcher(3)
    shared.wake()
    threads = [worker._thread for worker in shared.pool._workers]
    assert all(thread.is_alive() for thread in threads)
    del shared
    gc.collect()
    assert not any(thread.is_alive() for thread in threads)


@pytest.mark.pool
def test_jobs_at_the_same_time_have_workers_as_far_as_there_are_processors(monkeypatch):
    monkeypatch.setattr(worker_pool, "usable_cores", lambda: 4)
    shared, both = Launcher(3), Barrier(2)

    def begin(visits) -> None:
        shared.finish()  # has a slot of its own from now on
        both.wait()
        shared.begin(count_visits_kernel, 3000, [0, 1, visits], 10)
        both.wait()
        shared.begin(count_visits_kernel, 3000, [0, 1, visits], 10)
        both.wait()
        shared.finish()

    visits = [wp.zeros(3000, dtype=wp.int32, device="cpu") for _ in range(2)]
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(begin, visits))
    assert len(shared.pool._workers) == 3
    assert all((one.numpy() == 2).all() for one in visits)


def test_pools_are_one_a_process(monkeypatch):
    made = []

    class SlowPool(WorkerPool):
        def __init__(self):
            time.sleep(0.02)
            made.append(self)
            super().__init__()

    monkeypatch.setattr(worker_pool, "_pool", None)
    monkeypatch.setattr(worker_pool, "WorkerPool", SlowPool)
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda _: worker_pool.worker_pool(), range(4))) == 4 * made


@pytest.mark.pool
def test_devices_share_the_pool_of_the_process():
    visits = wp.zeros(3000, dtype=wp.int32, device="cpu")
    for threads in (2, 3, 1, 3, 2):
        Device("cpu", threads).launch(count_visits_kernel, 3000, [1], [visits], 10)
        assert len(worker_pool.worker_pool()._workers) >= threads - 1
    found = len(worker_pool.worker_pool()._workers)
    for _ in range(20):
        Device("cpu", 3).launch(count_visits_kernel, 3000, [1], [visits], 10)
    assert len(worker_pool.worker_pool()._workers) == found
    assert (visits.numpy() == 25).all()


@pytest.mark.parametrize(
    ("dim", "threads", "grain", "longest", "expected"),
    [
        (100, 1, 100, 0, 100),
        (100, 4, 100, 0, 100),
        (1000, 2, 500, 0, 500),
        (6400, 2, 10, 0, 50),  # 64 a thread
        (1_000_000, 2, 64, 0, 64 * 64),  # not longer than 64 grains
        (1_000_000, 1, 64, 0, 64 * 64),
        (1000, 1, 1, 1, 1),
        (1000, 2, 1, 3, 3),
    ],
)
def test_chunks_are_neither_short_nor_long(dim, threads, grain, longest, expected):
    assert worker_pool.chunk_size(dim, threads, grain, longest) == expected
