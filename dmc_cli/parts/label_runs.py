"""List the runs of a label map: nodes of a row that follow each other and have one code; and recode them.

The background has runs as labels have. Runs are numbered in the order of the rows, and within a row along x:
count, scan, emit.
"""

from collections.abc import Callable
from typing import Any

import warp as wp

from dmc_cli.parts.runs import Runs
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


def list_label_runs(codes: Any, device: Device, reserve: Callable[[int], None]) -> Runs:
    """Return the runs of a label map, uint16 [row, i].

    `reserve` is told how many there are before memory for them is taken; it may raise.
    """
    rows = codes.shape[0]
    counts = device.empty(rows, wp.int64)
    device.launch(count_label_runs_kernel, rows, [codes], [counts])
    starts, total = device.starts(counts)
    reserve(total)
    begin, end, code = (device.empty(total, wp.int32) for _ in range(3))
    device.launch(list_label_runs_kernel, rows, [codes, starts], [begin, end, code])
    return Runs(starts, begin, end, code)


@wp.kernel
def count_label_runs_kernel(
    # In:
    first: wp.int32,
    codes: wp.array2d(dtype=wp.uint16),
    # Out:
    counts_out: wp.array(dtype=wp.int64),
) -> None:
    """Count the runs. One thread a row."""
    row = first + wp.tid()
    count = int(1)
    for i in range(1, codes.shape[1]):
        count += wp.where(codes[row, i] != codes[row, i - 1], 1, 0)
    counts_out[row] = wp.int64(count)


@wp.kernel
def list_label_runs_kernel(
    # In:
    first: wp.int32,
    codes: wp.array2d(dtype=wp.uint16),
    starts: wp.array(dtype=wp.int64),
    # Out:
    begin_out: wp.array(dtype=wp.int32),
    end_out: wp.array(dtype=wp.int32),
    code_out: wp.array(dtype=wp.int32),
) -> None:
    """List the runs. One thread a row."""
    row = first + wp.tid()
    n = wp.int32(starts[row])
    begin = int(0)
    for i in range(1, codes.shape[1] + 1):
        code = codes[row, begin]
        is_last = i == codes.shape[1]
        if not is_last:
            is_last = codes[row, i] != code
        if is_last:
            begin_out[n] = begin
            end_out[n] = i
            code_out[n] = wp.int32(code)
            n += 1
            begin = i


@wp.kernel
def recode_runs_kernel(
    # In:
    first: wp.int32,
    starts: wp.array(dtype=wp.int64),
    begin: wp.array(dtype=wp.int32),
    end: wp.array(dtype=wp.int32),
    component: wp.array(dtype=wp.int32),
    code: wp.array(dtype=wp.int32),
    # In/out:
    codes_inout: wp.array2d(dtype=wp.uint16),
) -> None:
    """Give the nodes of each run the code of its component, those of -1 keep theirs. One thread a row."""
    row = first + wp.tid()
    for n in range(wp.int32(starts[row]), wp.int32(starts[row + 1])):
        new = code[component[n]]
        if new >= 0:
            for i in range(begin[n], end[n]):
                codes_inout[row, i] = wp.uint16(new)


@wp.func
def note(codes: wp.array2d(dtype=wp.int32), c: wp.int32, code: wp.int32, own: wp.int32) -> None:
    """Count another code among those beside a component."""
    if code != own:
        wp.atomic_min(codes, c, 0, code)
        wp.atomic_max(codes, c, 1, code)


@wp.kernel
def find_beside_kernel(
    # In:
    first: wp.int32,
    ny: wp.int32,
    codes: wp.array2d(dtype=wp.uint16),
    starts: wp.array(dtype=wp.int64),
    begin: wp.array(dtype=wp.int32),
    end: wp.array(dtype=wp.int32),
    component: wp.array(dtype=wp.int32),
    is_asked: wp.array(dtype=wp.uint8),
    # In/out:
    codes_inout: wp.array2d(dtype=wp.int32),
) -> None:
    """Find the least and the largest code beside each component that is asked for, and reaches no end.

    Extremes of whole numbers are the same in any order. One thread a row.
    """
    row = first + wp.tid()
    for n in range(wp.int32(starts[row]), wp.int32(starts[row + 1])):
        c = component[n]
        if is_asked[c] != wp.uint8(0):
            own = wp.int32(codes[row, begin[n]])
            note(codes_inout, c, wp.int32(codes[row, begin[n] - 1]), own)
            note(codes_inout, c, wp.int32(codes[row, end[n]]), own)
            for i in range(begin[n], end[n]):
                note(codes_inout, c, wp.int32(codes[row - 1, i]), own)
                note(codes_inout, c, wp.int32(codes[row + 1, i]), own)
                note(codes_inout, c, wp.int32(codes[row - ny, i]), own)
                note(codes_inout, c, wp.int32(codes[row + ny, i]), own)
