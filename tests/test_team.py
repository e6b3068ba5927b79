"""Threads that share a launch: each index once, whatever the slabs; kernels called as Warp calls them."""

import gc
import time
import weakref
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
import pytest
import warp as wp
from hypothesis import given, settings
from hypothesis import strategies as st

from dmc_cli import desk, team
from dmc_cli.device import select_device
from dmc_cli.team import Team

wp.set_module_options({"enable_backward": False})

DEVICE = select_device("cpu", 1)


@wp.kernel
def count_visits_kernel(first: wp.int32, step: wp.int32, visits_inout: wp.array(dtype=wp.int32)):
    """Add a step to each item; two threads at one item would lose one."""
    n = first + wp.tid()
    visits_inout[n] = visits_inout[n] + step


def visits_of(shared: Team, dim: int, grain: int, step: int = 1, launches: int = 1) -> np.ndarray:
    visits = wp.zeros(dim + 1, dtype=wp.int32, device="cpu")
    for _ in range(launches):
        shared.launch(count_visits_kernel, dim, [0, step, visits], grain)
    return visits.numpy()


@settings(deadline=None)
@given(st.integers(1, 7), st.integers(1, 5000), st.integers(1, 400), st.integers(1, 5))
def test_each_index_is_visited_once_a_launch(threads, dim, grain, launches):
    visits = visits_of(Team(threads), dim, grain, 3, launches)
    assert (visits[:dim] == 3 * launches).all()
    assert visits[dim] == 0


def test_many_short_launches_lose_nothing():
    shared = Team(4)
    assert (visits_of(shared, 1000, 10, launches=5000)[:1000] == 5000).all()


@settings(deadline=None)
@given(st.integers(1, 4), st.lists(st.tuples(st.integers(1, 3000), st.booleans()), min_size=1, max_size=8))
def test_a_launch_that_was_begun_is_done_before_the_next(threads, launches):
    """Each launch doubles what the one before left, and adds 1."""
    shared = Team(threads)
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


def test_helpers_go_on_while_the_caller_does_something_else():
    """The slab of each waits for the other: the one that the caller does not take is a helper's."""
    shared = Team(3)
    places = wp.zeros(2, dtype=wp.int32, device="cpu")
    shared.begin(meet_kernel, 2, [0, places], 1)
    deadline = time.monotonic() + 30
    while places.numpy().tolist() != [1, 1]:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    shared.finish()


def test_arrays_live_until_a_launch_that_was_begun_is_done():
    shared = Team(2)
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
    shared = Team(2)

    def begin_many() -> np.ndarray:
        visits = wp.zeros(3000, dtype=wp.int32, device="cpu")
        for _ in range(300):
            shared.begin(count_visits_kernel, 3000, [0, 1, visits], 10)
        shared.finish()
        return visits.numpy()

    with ThreadPoolExecutor(4) as pool:
        runs = [pool.submit(begin_many) for _ in range(4)]
        assert all((run.result() == 300).all() for run in runs)


@pytest.mark.parametrize("threads", [1, 4])
def test_helpers_can_be_woken_ahead(threads):
    shared = Team(threads)
    shared.wake()
    assert all(helper is not None for helper in shared._helpers)
    assert (visits_of(shared, 1000, 10)[:1000] == 1).all()


def test_helpers_sleep_when_there_is_nothing_to_do_and_wake_again():
    shared = Team(2)
    for _ in range(3):
        assert (visits_of(shared, 1000, 10)[:1000] == 1).all()
        deadline = time.monotonic() + 30
        while not all(helper.done() for helper in shared._helpers):
            assert time.monotonic() < deadline
            time.sleep(0.01)


def test_a_launch_of_one_slab_wakes_nobody():
    shared = Team(2)
    visits_of(shared, 1000, 1000)
    assert shared._helpers == [None]


def test_helpers_take_their_share():
    """The launching thread's slabs wait until the helper has had one: it finishes only if it does."""
    shared = Team(2)
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


def test_two_callers_of_one_team_take_turns():
    shared = Team(2)
    with ThreadPoolExecutor(4) as pool:
        runs = [pool.submit(visits_of, shared, 3000, 10, 1, 300) for _ in range(4)]
        assert all((run.result()[:3000] == 300).all() for run in runs)


def test_an_array_of_another_type_is_refused_on_every_launch():
    shared = Team(1)
    visits_of(shared, 10, 1)
    for other in (
        wp.zeros(10, dtype=wp.float64, device="cpu"),
        wp.zeros((2, 5), dtype=wp.int32, device="cpu"),
    ):
        with pytest.raises(TypeError, match="count_visits_kernel"):
            shared.launch(count_visits_kernel, 10, [0, 1, other], 1)


@pytest.mark.parametrize("threads", [1, 2])
def test_no_array_of_a_launch_is_kept(threads):
    shared = Team(threads)
    visits = wp.zeros(100, dtype=wp.int32, device="cpu")
    shared.launch(count_visits_kernel, 100, [0, 1, visits], 1)
    gone = weakref.ref(visits)
    del visits
    gc.collect()
    assert gone() is None


def test_only_as_many_helpers_wake_as_there_are_slabs_for():
    shared = Team(8)
    visits_of(shared, 1000, 400)
    assert [helper is not None for helper in shared._helpers] == [True] + 6 * [False]


def test_kernels_that_take_their_arguments_otherwise_are_left_to_warp(monkeypatch):
    monkeypatch.setattr(team, "_takes_structs", lambda source: False)
    shared = Team(2)
    assert (visits_of(shared, 1000, 10)[:1000] == 1).all()
    assert shared._helpers == [None]


@pytest.mark.parametrize("error", [AttributeError, FileNotFoundError, TypeError])
def test_a_warp_whose_records_are_others_launches_by_itself(error, monkeypatch):
    def fail(self):
        raise error("other records")

    monkeypatch.setattr(team.Compiled, "source", property(fail))
    assert (visits_of(Team(2), 1000, 10)[:1000] == 1).all()


def test_how_kernels_take_their_arguments_is_read_from_their_source():
    source = Team(1)._help.source.replace("help_kernel", "lead_kernel")
    assert team._takes_structs(source)
    assert not team._takes_structs(source.replace("wp_args_lead", "args_lead"))
    assert not team._takes_structs(source.replace("*_wp_args)", "*_wp_args, int more)"))


def test_the_desk_keeps_what_threads_write_apart():
    words = [desk.OPEN, desk.INSIDE, desk.JOB, desk.PARTS]
    assert all(b - a >= desk.LINE for a, b in pairwise(words))
    assert desk.YIELD < desk.PARTS
