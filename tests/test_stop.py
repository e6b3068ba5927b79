"""A launch that takes half a minute ends soon after a signal, and leaves nobody at work."""

import signal
import time
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import numpy as np
import pytest
import warp as wp

from dmc_cli.runtime import worker_pool
from dmc_cli.stop import StopRequested, check_stop, stopping_on
from tests.runtime.launcher import Launcher, count_visits_kernel, visits_of

ITEMS = 60_000
"""Items of a launch, half a millisecond each."""

SOON = 10
"""Seconds: far less than a launch takes, far more than a busy machine needs."""


@wp.func_native("for (volatile long long turn = 0; turn < 1000000ll; turn = turn + 1) {} return n;")
def slow(n: wp.int32) -> wp.int32:
    """Take a while."""
    ...


@wp.kernel
def slow_kernel(first: wp.int32, visits_inout: wp.array(dtype=wp.int32)):
    """Add 1 to each item, slowly."""
    n = slow(first + wp.tid())
    visits_inout[n] = visits_inout[n] + 1


class StruckError(Exception):
    pass


@pytest.fixture
def alarm():
    """Raise `StruckError` in the main thread after a while."""

    def strike(number, frame):
        raise StruckError

    before = signal.signal(signal.SIGALRM, strike)
    yield lambda seconds: signal.setitimer(signal.ITIMER_REAL, seconds)
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


def launcher_of(way: str, monkeypatch) -> Launcher:
    if way == "by Warp":
        monkeypatch.setattr(worker_pool, "takes_structs", lambda source, kernel: False)
    return Launcher(3 if way == "shared" else 1)


WAYS = ["alone", "shared", "by Warp"]


@pytest.mark.parametrize("way", WAYS)
def test_a_signal_ends_a_launch(way, alarm, monkeypatch):
    shared = launcher_of(way, monkeypatch)
    visits = wp.zeros(ITEMS, dtype=wp.int32, device="cpu")
    shared.launch(slow_kernel, 2, [0, visits], 1)  # compiled from now on
    start = time.monotonic()
    alarm(0.2)
    with pytest.raises(StruckError):
        shared.launch(slow_kernel, ITEMS, [0, visits], 1)
    assert time.monotonic() - start < SOON
    check_nobody_is_at_work(shared, visits.numpy())


def check_nobody_is_at_work(shared: Launcher, visits: np.ndarray) -> None:
    done = int(visits.sum())
    assert 0 < done < ITEMS
    time.sleep(0.05)
    assert int(visits.sum()) == done
    assert (visits_of(shared, 3000, 10)[:3000] == 1).all()


@pytest.mark.pool
def test_what_was_begun_can_be_dropped():
    shared = Launcher(3)
    visits = wp.zeros(ITEMS, dtype=wp.int32, device="cpu")
    start = time.monotonic()
    shared.begin(slow_kernel, ITEMS, [0, visits], 1)
    while not visits.numpy().any():
        time.sleep(0.001)
    shared.pool.drop()
    assert time.monotonic() - start < SOON
    check_nobody_is_at_work(shared, visits.numpy())


@pytest.mark.pool
def test_a_signal_while_the_next_launch_waits_drops_what_was_begun(alarm):
    shared = Launcher(2)
    slow_visits = wp.zeros(ITEMS, dtype=wp.int32, device="cpu")
    visits = wp.zeros(1000, dtype=wp.int32, device="cpu")
    shared.launch(slow_kernel, 2, [0, slow_visits], 1)
    shared.begin(slow_kernel, ITEMS, [0, slow_visits], 1)
    alarm(0.2)
    with pytest.raises(StruckError):
        shared.launch(count_visits_kernel, 1000, [0, 1, visits], 10)
    assert not visits.numpy().any()
    check_nobody_is_at_work(shared, slow_visits.numpy())


@pytest.mark.parametrize("way", WAYS)
def test_a_request_ends_a_launch_of_another_thread(way, monkeypatch):
    shared = launcher_of(way, monkeypatch)
    visits = wp.zeros(ITEMS, dtype=wp.int32, device="cpu")
    event = Event()

    def work():
        with stopping_on(event):
            shared.launch(slow_kernel, ITEMS, [0, visits], 1)

    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(work)
        while not visits.numpy().any():
            time.sleep(0.001)
        event.set()
        assert isinstance(running.exception(SOON), StopRequested)
    check_nobody_is_at_work(shared, visits.numpy())


def test_a_thread_that_was_asked_to_stop_launches_nothing_more():
    shared, event = Launcher(2), Event()
    visits = wp.zeros(1000, dtype=wp.int32, device="cpu")
    with stopping_on(event):
        check_stop()
        event.set()
        for launch in (shared.launch, shared.begin):
            with pytest.raises(StopRequested):
                launch(count_visits_kernel, 1000, [0, 1, visits], 10)
    assert not visits.numpy().any()
    check_stop()
