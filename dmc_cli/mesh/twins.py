"""Pair the halfedges of a mesh that comes without a grid, by their vertices.

A pair of twins runs between the same two vertices in opposite directions. Where a vertex pair has more
halfedges than two, the mesh alone does not tell which belong together; then the first one that runs one
way is the twin of the first that runs the other way, the second of the second, in the order of their
numbers. A halfedge without such a partner, and one between a vertex and itself, stays without a twin.

Both functions give the same twins. `find_twins` lists the halfedges of each lower vertex on the device and
searches these short lists; `pair_halfedges` sorts, which is plainer, and does not mind a vertex with very
many faces.
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import BoolArray, Int32Array, Int64Array, IntArray
from dmc_cli.mesh.halfedges import NO_TWIN, next_halfedge
from dmc_cli.mesh.mesh import flat_corners
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False})

LONGEST_LIST = 1024
"""Halfedges at a lower vertex up to which lists are searched; the time grows with the square."""


@wp.func
def lower_vertex(corners: wp.array[wp.int32], h: wp.int32) -> wp.int32:
    """Return the lower end of halfedge `h`, or -1 if it is none or leads to its own start."""
    tail = corners[h]
    vertex = int(-1)
    if tail >= 0:
        head = corners[next_halfedge(corners, h)]
        if head != tail:
            vertex = wp.min(tail, head)
    return vertex


@wp.kernel
def count_halfedges_kernel(
    first: wp.int32,
    # In:
    corners: wp.array[wp.int32],
    # In/out:
    counts_inout: wp.array[wp.int64],
) -> None:
    """Count the halfedges of each lower vertex. One thread a corner.

    Sums of integers: the order of the threads does not show. Not to be cut into chunks, since atomics on CPU
    are none.
    """
    vertex = lower_vertex(corners, first + wp.tid())
    if vertex >= 0:
        wp.atomic_add(counts_inout, vertex, wp.int64(1))


@wp.kernel
def list_halfedges_kernel(
    first: wp.int32,
    # In:
    corners: wp.array[wp.int32],
    # In/out:
    cursors_inout: wp.array[wp.int64],
    # Out:
    listed_out: wp.array[wp.int32],
) -> None:
    """List the halfedges of each lower vertex, in any order. One thread a corner; launched whole."""
    h = first + wp.tid()
    vertex = lower_vertex(corners, h)
    if vertex >= 0:
        slot = wp.atomic_add(cursors_inout, vertex, wp.int64(1))
        listed_out[slot] = h


@wp.kernel
def match_halfedges_kernel(
    first: wp.int32,
    # In:
    corners: wp.array[wp.int32],
    starts: wp.array[wp.int64],
    # In/out:
    listed_inout: wp.array[wp.int32],
    # Out:
    twins_out: wp.array[wp.int32],
) -> None:
    """Sort a vertex's list and pair what runs up with what runs down. One thread a lower vertex."""
    vertex = first + wp.tid()
    start = wp.int32(starts[vertex])
    end = wp.int32(starts[vertex + 1])
    for i in range(start + 1, end):
        h = listed_inout[i]
        slot = int(i)
        while slot > start and listed_inout[slot - 1] > h:
            listed_inout[slot] = listed_inout[slot - 1]
            slot -= 1
        listed_inout[slot] = h
    for i in range(start, end):
        up = listed_inout[i]
        if corners[up] == vertex:
            head = corners[next_halfedge(corners, up)]
            j = int(start)
            while j < end:
                down = listed_inout[j]
                if corners[down] == head and twins_out[down] < 0:
                    twins_out[up] = down
                    twins_out[down] = up
                    j = end
                j += 1


def find_twins(device: Device, faces: Any, vertex_count: int) -> Any:
    """Return the twin of each halfedge on the device, (4F,) int32, -1 where there is none.

    Args:
        device: Where to work.
        faces: Corners, (F, 4) int32 or (F,) vec4i; a triangle has -1 as its fourth corner.
        vertex_count: Number of vertices.
    """
    corners = flat_corners(faces)
    size = corners.shape[0]
    counts = device.zeros(vertex_count, wp.int64)
    if size:
        device.launch_whole(count_halfedges_kernel, size, [corners], [counts])
    if size == 0 or int(counts.numpy().max()) > LONGEST_LIST:
        return wp.array(pair_halfedges(corners.numpy().reshape(-1, 4)), dtype=wp.int32, device=device.name)
    starts, total = device.starts(counts)
    cursors = wp.clone(starts)
    listed = device.empty(total, wp.int32)
    device.launch_whole(list_halfedges_kernel, size, [corners], [cursors, listed])
    twins = wp.full(size, NO_TWIN, dtype=wp.int32, device=device.name)
    device.launch(match_halfedges_kernel, vertex_count, inputs=[corners, starts], outputs=[listed, twins])
    return twins


def pair_halfedges(faces: Int32Array) -> Int32Array:
    """Return the twin of each halfedge, (4F,) int32, -1 where there is none.

    Args:
        faces: Corners, (F, 4) int32; a triangle has -1 as its fourth corner. Halfedge 4q + c runs from corner
            c of face q to the next one.
    """
    tails = faces.astype(np.int64)
    heads = np.roll(tails, -1, axis=1)
    is_triangle = tails[:, 3] < 0
    heads[is_triangle, 2] = tails[is_triangle, 0]
    tails, heads = tails.ravel(), heads.ravel()
    halfedges = np.flatnonzero((tails >= 0) & (tails != heads))
    tails, heads = tails[halfedges], heads[halfedges]
    pairs = np.minimum(tails, heads) << 32 | np.maximum(tails, heads)
    order = np.argsort(pairs)
    pairs, halfedges, is_up = pairs[order], halfedges[order], (tails < heads)[order]

    twins = np.full(faces.size, NO_TWIN, dtype=np.int32)
    bounds = np.flatnonzero(np.concatenate([[True], pairs[1:] != pairs[:-1], [True]]))
    sizes = np.diff(bounds)
    low = bounds[:-1][sizes == 2]
    low = low[is_up[low] != is_up[low + 1]]
    twins[halfedges[low]] = halfedges[low + 1]
    twins[halfedges[low + 1]] = halfedges[low]

    is_nonmanifold = np.repeat(sizes > 2, sizes)
    if is_nonmanifold.any():
        _pair_nonmanifold(twins, pairs[is_nonmanifold], halfedges[is_nonmanifold], is_up[is_nonmanifold])
    return twins


def _pair_nonmanifold(twins: Int32Array, pairs: Int64Array, halfedges: IntArray, is_up: BoolArray) -> None:
    """Pair the i-th halfedge up with the i-th down of each vertex pair, in the order of their numbers."""
    order = np.lexsort((halfedges, is_up, pairs))
    pairs, halfedges, is_up = pairs[order], halfedges[order], is_up[order]
    new_run = np.concatenate([[True], (pairs[1:] != pairs[:-1]) | (is_up[1:] != is_up[:-1])])
    run_start = np.maximum.accumulate(np.where(new_run, np.arange(pairs.shape[0]), 0))
    rank = np.arange(pairs.shape[0]) - run_start
    order = np.lexsort((is_up, rank, pairs))
    pairs, halfedges, is_up, rank = pairs[order], halfedges[order], is_up[order], rank[order]
    meets = (pairs[1:] == pairs[:-1]) & (rank[1:] == rank[:-1]) & ~is_up[:-1] & is_up[1:]
    low = np.flatnonzero(meets)
    twins[halfedges[low]] = halfedges[low + 1]
    twins[halfedges[low + 1]] = halfedges[low]
