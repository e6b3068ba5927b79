"""List the runs of a set of nodes: nodes of a row that follow each other, from the bits of the set.

Those of a label map (`label_runs.py`) have a code each, and are joined with their like alone.

Runs are numbered in the order of the rows, and within a row along x: count, scan, emit.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.bits import bit_index, low_bits, next_node, previous_node
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@dataclass(frozen=True)
class Runs:
    """The runs of a set of nodes, or of all nodes of a label map.

    Attributes:
        starts: The number of each row's first run, and of all runs as a last item, int64 (rows + 1,).
        begin: The first node of each run along x, int32 (n,).
        end: The node behind its last one, int32 (n,).
        code: The code that its nodes have, int32 (n,); of a set there is none, (0,).
    """

    starts: Any
    begin: Any
    end: Any
    code: Any

    @property
    def count(self) -> int:
        """Return the number of runs."""
        return int(self.begin.shape[0])


def list_runs(bits: Any, device: Device, reserve: Callable[[int], None] | None = None) -> Runs:
    """Return the runs of the nodes whose bits are set, uint32 [row, word].

    `reserve` is told how many there are before memory for them is taken; it may raise.
    """
    rows = bits.shape[0]
    counts = device.empty(rows, wp.int64)
    device.launch(count_runs_kernel, rows, [bits], [counts])
    starts, total = device.starts(counts)
    if reserve is not None:
        reserve(total)
    begin, end = device.empty(total, wp.int32), device.empty(total, wp.int32)
    if total:
        device.launch(list_runs_kernel, rows, [bits, starts], [begin, end])
    return Runs(starts, begin, end, device.empty(0, wp.int32))


@wp.func
def first_bits(bits: wp.array2d(dtype=wp.uint32), row: wp.int32, w: wp.int32) -> wp.uint32:
    """Return the bits of a word at which runs begin."""
    before = wp.uint32(0)
    if w > 0:
        before = bits[row, w - 1]
    return bits[row, w] & ~previous_node(bits[row, w], before)


@wp.func
def last_bits(bits: wp.array2d(dtype=wp.uint32), row: wp.int32, w: wp.int32) -> wp.uint32:
    """Return the bits of a word at which runs end."""
    after = wp.uint32(0)
    if w + 1 < bits.shape[1]:
        after = bits[row, w + 1]
    return bits[row, w] & ~next_node(bits[row, w], after)


@wp.kernel
def count_runs_kernel(
    # In:
    first: wp.int32,
    bits: wp.array2d(dtype=wp.uint32),
    # Out:
    counts_out: wp.array(dtype=wp.int64),
) -> None:
    """Count the runs. One thread a row."""
    row = first + wp.tid()
    count = wp.int64(0)
    for w in range(bits.shape[1]):
        count += wp.int64(wp.bit_count(first_bits(bits, row, w)))
    counts_out[row] = count


@wp.kernel
def list_runs_kernel(
    # In:
    first: wp.int32,
    bits: wp.array2d(dtype=wp.uint32),
    starts: wp.array(dtype=wp.int64),
    # Out:
    begin_out: wp.array(dtype=wp.int32),
    end_out: wp.array(dtype=wp.int32),
) -> None:
    """List the runs. One thread a row."""
    row = first + wp.tid()
    opened = starts[row]
    closed = starts[row]
    for w in range(bits.shape[1]):
        begins = first_bits(bits, row, w)
        while begins != wp.uint32(0):
            begin_out[opened] = 32 * w + bit_index(begins)
            opened += wp.int64(1)
            begins &= begins - wp.uint32(1)
        ends = last_bits(bits, row, w)
        while ends != wp.uint32(0):
            end_out[closed] = 32 * w + bit_index(ends) + 1
            closed += wp.int64(1)
            ends &= ends - wp.uint32(1)


@wp.kernel
def mark_runs_kernel(
    # In:
    first: wp.int32,
    starts: wp.array(dtype=wp.int64),
    begin: wp.array(dtype=wp.int32),
    end: wp.array(dtype=wp.int32),
    component: wp.array(dtype=wp.int32),
    is_marked: wp.array(dtype=wp.uint8),
    # Out:
    bits_out: wp.array2d(dtype=wp.uint32),
) -> None:
    """Set the bits of the nodes whose component is marked. One thread a row."""
    row = first + wp.tid()
    for w in range(bits_out.shape[1]):
        bits_out[row, w] = wp.uint32(0)
    for n in range(wp.int32(starts[row]), wp.int32(starts[row + 1])):
        if is_marked[component[n]] != wp.uint8(0):
            for w in range(begin[n] / 32, (end[n] + 31) / 32):
                bits_out[row, w] |= low_bits(end[n] - 32 * w) & ~low_bits(begin[n] - 32 * w)


@wp.kernel
def meet_runs_kernel(
    # In:
    first: wp.int32,
    starts: wp.array(dtype=wp.int64),
    begin: wp.array(dtype=wp.int32),
    end: wp.array(dtype=wp.int32),
    bits: wp.array2d(dtype=wp.uint32),
    # Out:
    meets_out: wp.array(dtype=wp.uint8),
) -> None:
    """Find the runs with a node whose bit is set. One thread a row."""
    row = first + wp.tid()
    for n in range(wp.int32(starts[row]), wp.int32(starts[row + 1])):
        found = wp.uint32(0)
        for w in range(begin[n] / 32, (end[n] + 31) / 32):
            found |= bits[row, w] & low_bits(end[n] - 32 * w) & ~low_bits(begin[n] - 32 * w)
        meets_out[n] = wp.where(found != wp.uint32(0), wp.uint8(1), wp.uint8(0))
