"""Blocks of host memory: given out once at a time, kept by size, never more than the limit."""

import gc

import numpy as np
import pytest
import warp as wp
from hypothesis import given
from hypothesis import strategies as st

from dmc_cli import host_memory
from dmc_cli.device import Device
from dmc_cli.host_memory import SMALLEST_KEPT, HostMemory, block_size


@given(st.integers(0, 2**40))
def test_a_block_is_at_most_an_eighth_larger(size):
    assert size <= block_size(size) <= size + max(size // 8, 1)
    assert block_size(block_size(size)) == block_size(size)


def test_a_block_is_given_out_again_only_when_its_owner_went():
    memory = HostMemory()
    first = memory.take(SMALLEST_KEPT)
    second = memory.take(SMALLEST_KEPT)
    where = first.block.address
    assert second.block.address != where
    del first
    assert memory.take(SMALLEST_KEPT).block.address == where
    assert second.block.memory.size == SMALLEST_KEPT


def test_no_more_is_kept_than_the_limit(monkeypatch):
    monkeypatch.setattr(host_memory, "MOST_KEPT", 3 * SMALLEST_KEPT)
    memory = HostMemory()
    leases = [memory.take(n * SMALLEST_KEPT) for n in (1, 1, 2, 4)]
    leases.clear()
    memory.take(SMALLEST_KEPT)
    assert sum(size * len(blocks) for size, blocks in memory._kept.items()) <= 3 * SMALLEST_KEPT


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
