"""Join runs of nodes that follow each other across rows: a forest whose roots are the lowest numbers.

Nodes of a set belong together along the edges of the grid alone. Across an ambiguous face the surface may
join two nodes as well, but whether it does depends on the values, the method and its repairs; what an edge
joins, every method joins.

Layers are joined in themselves first, each by one thread, then two and two, four and four, and so on: whoever
joins two blocks of layers is alone with their runs. A root is the lowest number of its runs, in whatever
order they are joined.
"""

from typing import Any

import warp as wp

from dmc_cli.field import Grid, GridShape
from dmc_cli.parts.runs import Runs
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

RUNS_A_CHUNK = 2048
"""Runs a chunk at least whose roots are looked up, as `ITEMS_A_CHUNK` of the device."""


def join_runs(runs: Runs, grid: GridShape, device: Device) -> Any:
    """Return the root of each run, int32 (n,): the lowest number of a run in the same component."""
    parent, root = device.empty(runs.count, wp.int32), device.empty(runs.count, wp.int32)
    if runs.count == 0:
        return root
    inputs = [grid.struct(), runs.starts, runs.begin, runs.end, runs.code]
    device.launch(join_in_layers_kernel, grid.nz, inputs, [parent], 1)
    step = 1
    while step < grid.nz:
        pairs = (grid.nz + step - 1) // (2 * step)
        device.launch(join_layers_kernel, pairs, [*inputs, step], [parent], 1)
        step *= 2
    device.launch(find_roots_kernel, runs.count, [parent], [root], RUNS_A_CHUNK)
    return root


@wp.func
def root_of(parent: wp.array(dtype=wp.int32), run: wp.int32) -> wp.int32:
    """Return the root of a run; the way there is shorter afterwards."""
    r = int(run)
    while parent[r] != r:
        parent[r] = parent[parent[r]]
        r = parent[r]
    return r


@wp.func
def join(parent: wp.array(dtype=wp.int32), a: wp.int32, b: wp.int32) -> None:
    """Join the trees of two runs under the lower root."""
    first = root_of(parent, a)
    second = root_of(parent, b)
    if first != second:
        parent[wp.max(first, second)] = wp.min(first, second)


@wp.func
def join_rows(
    starts: wp.array(dtype=wp.int64),
    begin: wp.array(dtype=wp.int32),
    end: wp.array(dtype=wp.int32),
    code: wp.array(dtype=wp.int32),
    row: wp.int32,
    other: wp.int32,
    parent: wp.array(dtype=wp.int32),
) -> None:
    """Join the runs of two neighbouring rows that overlap, where they have codes those of the same one."""
    a = wp.int32(starts[row])
    b = wp.int32(starts[other])
    a_end = wp.int32(starts[row + 1])
    b_end = wp.int32(starts[other + 1])
    while a < a_end and b < b_end:
        if end[a] > begin[b] and end[b] > begin[a]:
            if code.shape[0] == 0 or code[a] == code[b]:
                join(parent, a, b)
        if end[a] <= end[b]:
            a += 1
        else:
            b += 1


@wp.kernel
def join_in_layers_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    starts: wp.array(dtype=wp.int64),
    begin: wp.array(dtype=wp.int32),
    end: wp.array(dtype=wp.int32),
    code: wp.array(dtype=wp.int32),
    # Out:
    parent_out: wp.array(dtype=wp.int32),
) -> None:
    """Make each run its own root, and join those of each layer. One thread a layer."""
    k = first + wp.tid()
    row = grid.ny * k
    for n in range(wp.int32(starts[row]), wp.int32(starts[row + grid.ny])):
        parent_out[n] = n
    for j in range(grid.ny - 1):
        join_rows(starts, begin, end, code, row + j, row + j + 1, parent_out)


@wp.kernel
def join_layers_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    starts: wp.array(dtype=wp.int64),
    begin: wp.array(dtype=wp.int32),
    end: wp.array(dtype=wp.int32),
    code: wp.array(dtype=wp.int32),
    step: wp.int32,
    # In and out:
    parent_inout: wp.array(dtype=wp.int32),
) -> None:
    """Join each block of `step` layers to the one above it. One thread two blocks."""
    k = (2 * (first + wp.tid()) + 1) * step - 1
    for j in range(grid.ny):
        row = j + grid.ny * k
        join_rows(starts, begin, end, code, row, row + grid.ny, parent_inout)


@wp.kernel
def find_roots_kernel(
    # In:
    first: wp.int32,
    parent: wp.array(dtype=wp.int32),
    # Out:
    root_out: wp.array(dtype=wp.int32),
) -> None:
    """Find the root of each run. One thread a run."""
    n = first + wp.tid()
    r = int(n)
    while parent[r] != r:
        r = parent[r]
    root_out[n] = r
