"""Buffers of host memory: given out once at a time, kept by size, never more than the limit."""

import gc

import numpy as np
import pytest
import warp as wp
from hypothesis import given, strategies as st

from dmc_cli.runtime import buffer_pool
from dmc_cli.runtime.buffer_pool import SMALLEST_KEPT, HostMemory, buffer_size
from dmc_cli.runtime.device import Device


@given(st.integers(0, 2**40))
def test_a_buffer_is_at_most_an_eighth_larger(size):
    assert size <= buffer_size(size) <= size + max(size // 8, 1)
    assert buffer_size(buffer_size(size)) == buffer_size(size)


def test_a_buffer_is_given_out_again_only_when_its_owner_went():
    memory = HostMemory()
    first = memory.take(SMALLEST_KEPT)
    second = memory.take(SMALLEST_KEPT)
    where = first.buffer.address
    assert second.buffer.address != where
    del first
    assert memory.take(SMALLEST_KEPT).buffer.address == where
    assert second.buffer.memory.size == SMALLEST_KEPT


def test_no_more_is_kept_than_the_limit(monkeypatch):
    monkeypatch.setattr(buffer_pool, "MOST_KEPT", 3 * SMALLEST_KEPT)
    memory = HostMemory()
    leases = [memory.take(n * SMALLEST_KEPT) for n in (1, 1, 2, 4)]
    leases.clear()
    memory.take(SMALLEST_KEPT)
    assert sum(size * len(buffers) for size, buffers in memory._kept.items()) <= 3 * SMALLEST_KEPT


def held(memory):
    return memory._in_use + sum(size * len(buffers) for size, buffers in memory._kept.items())


@pytest.fixture
def nothing_is_small(monkeypatch):
    monkeypatch.setattr(buffer_pool, "SMALL_WHOLE", 0)


@given(st.lists(st.tuples(st.integers(1, 40), st.integers(0, 3)), max_size=60))
def test_the_whole_stays_near_what_was_in_use_at_most(steps):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(buffer_pool, "SMALL_WHOLE", 0)
        memory, leases, most = HostMemory(), [], 0
        for size, gone in steps:
            leases.append(memory.take(size * SMALLEST_KEPT))
            most = max(most, sum(len(lease.buffer.memory) for lease in leases))
            assert held(memory) <= most + most // buffer_pool.SPARE_SHARE
            assert memory._in_use == sum(len(lease.buffer.memory) for lease in leases)
            del leases[:gone]


def test_what_came_back_first_goes_first(nothing_is_small):
    memory = HostMemory()
    sizes = [n * SMALLEST_KEPT for n in (8, 4, 6)]
    leases = [memory.take(size) for size in sizes]
    where = [lease.buffer.address for lease in leases]
    for _ in sizes:
        del leases[0]
    other = memory.take(7 * SMALLEST_KEPT)
    assert sizes[0] not in memory._kept
    later = [memory.take(size) for size in sizes[1:]]
    assert [lease.buffer.address for lease in later] == where[1:]
    del other


def test_small_buffers_are_all_kept():
    memory = HostMemory()
    for n in range(1, 60):
        memory.take(n * SMALLEST_KEPT)
    memory.take(100 * SMALLEST_KEPT)
    assert len(memory._kept) == len({buffer_size(n * SMALLEST_KEPT) for n in range(1, 60)})


def test_where_memory_runs_out_what_is_kept_goes(monkeypatch):
    memory = HostMemory()
    memory.take(3 * SMALLEST_KEPT)
    tries = []

    def new_buffer(size):
        tries.append(size)
        if len(tries) == 1:
            raise MemoryError
        return made(size)

    made = buffer_pool.Buffer
    monkeypatch.setattr(buffer_pool, "Buffer", new_buffer)
    assert len(memory.take(2 * SMALLEST_KEPT).buffer.memory) == 2 * SMALLEST_KEPT
    assert tries == [2 * SMALLEST_KEPT] * 2
    assert memory._total == 0
    assert not memory._kept


def test_buffers_below_the_smallest_are_not_kept():
    memory = HostMemory()
    memory.take(SMALLEST_KEPT - 1)
    memory.take(SMALLEST_KEPT)
    assert memory._in_use == SMALLEST_KEPT
    memory.take(1)
    assert set(memory._kept) <= {SMALLEST_KEPT}


@pytest.mark.parametrize("dtype", [wp.uint8, wp.int64, wp.vec3, wp.vec4i])
def test_a_view_keeps_the_memory_of_its_array(dtype):
    device = Device("cpu")
    array = device.zeros(SMALLEST_KEPT, dtype)
    view, host = array[10:], array.numpy()
    del array
    gc.collect()
    other = device.empty(SMALLEST_KEPT, dtype)
    other.fill_(7)
    assert not view.numpy().any()
    assert not host.any()
    assert np.all(other.numpy() == 7)
