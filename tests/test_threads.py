"""Work in threads: in order, once each, and done all the same where the system gives no threads."""

import threading
import time
from contextlib import closing

import pytest

from dmc_cli.threads import each_in_threads


@pytest.fixture(params=[0, 1, 2, 100])
def allowed(request, monkeypatch):
    """How many threads can be started."""
    start, started = threading.Thread.start, []

    def limited(thread):
        if len(started) >= request.param:
            raise RuntimeError("can't start new thread")
        started.append(thread)
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", limited)
    yield request.param
    assert not any(thread.is_alive() for thread in started)


@pytest.mark.parametrize("count", [0, 1, 7])
@pytest.mark.parametrize("threads", [1, 3, 50])
def test_results_come_in_the_order_of_the_items(allowed, count, threads):
    calls = []

    def square(item):
        calls.append(item)
        time.sleep(0.001 * (item % 3))
        return item * item

    assert list(each_in_threads(square, range(count), threads)) == [n * n for n in range(count)]
    assert sorted(calls) == list(range(count))


def test_the_first_error_in_order_is_raised_and_the_rest_left_undone(allowed):
    calls = []

    def fail(item):
        calls.append(item)
        if item in (2, 4):
            raise ValueError(item)
        time.sleep(0.001)
        return item

    found = []
    with pytest.raises(ValueError, match="2"):
        for item in each_in_threads(fail, range(500), 2):
            found.append(item)
    assert found == [0, 1]
    assert len(calls) < 500
    assert len(calls) == len(set(calls))


def test_whoever_leaves_early_waits_for_what_has_begun_only(allowed):
    begun, ended = [], []

    def work(item):
        begun.append(item)
        time.sleep(0.01)
        ended.append(item)

    with closing(each_in_threads(work, range(1000), 3)) as results:
        next(results)
    assert len(begun) < 1000
    assert sorted(begun) == sorted(ended)


def test_errors_that_are_no_exceptions_come_through(allowed):
    def stop(item):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        list(each_in_threads(stop, [1], 2))


def test_no_more_threads_than_items_and_than_asked_for(monkeypatch):
    names, start = [], threading.Thread.start
    monkeypatch.setattr(threading.Thread, "start", lambda thread: names.append(thread.name) or start(thread))
    list(each_in_threads(str, range(3), 8, "few"))
    assert names == ["few-0", "few-1", "few-2"]
    names.clear()
    list(each_in_threads(str, range(9), 2))
    assert names == ["dmc-0", "dmc-1"]


def test_threads_work_at_the_same_time():
    meeting = threading.Barrier(3)
    assert list(each_in_threads(lambda item: meeting.wait(20) >= 0, range(3), 3)) == [True] * 3
