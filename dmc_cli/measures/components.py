"""Count connected pieces: components of a mesh and the loops of its boundary.

Both are classes of a relation between neighbours, found by uniting trees: every item points to a smaller
one of its class or to itself, a kernel hooks the larger of two roots below the smaller one, and launches
follow until no pair of neighbours has two roots. The root of a class is its smallest item, whatever the
order of the threads; a link that a race between threads lost is found missing by the next launch.
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.mesh import next_halfedge
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False})

BLOCK = wp.constant(1024)
"""Halfedges that one thread looks through for boundaries: large enough for few counters, small enough to
occupy a GPU."""


@wp.func
def find_root(parents: wp.array[wp.int32], item: wp.int32) -> wp.int32:
    """Return the root above `item`, halving the path to it."""
    x = item
    parent = parents[x]
    while parent != x:
        above = parents[parent]
        if above != parent:
            parents[x] = above
        x = parent
        parent = above
    return x


@wp.func
def unite(parents: wp.array[wp.int32], a: wp.int32, b: wp.int32) -> wp.bool:
    """Put the larger root of two items below the smaller one; return whether they had two roots."""
    root_a = find_root(parents, a)
    root_b = find_root(parents, b)
    if root_a != root_b:
        wp.atomic_min(parents, wp.max(root_a, root_b), wp.min(root_a, root_b))
    return root_a != root_b


@wp.kernel
def number_items_kernel(
    first: wp.int32,
    # Out:
    parents_out: wp.array[wp.int32],
) -> None:
    """Make every item a root. One thread per item."""
    item = first + wp.tid()
    parents_out[item] = item


@wp.kernel
def unite_faces_kernel(
    first: wp.int32,
    # In:
    twins: wp.array[wp.int32],
    # In/out:
    parents_inout: wp.array[wp.int32],
    changed_inout: wp.array[wp.int32],
) -> None:
    """Unite each face with its neighbours of lower number. One thread per face; see the module on races."""
    face = first + wp.tid()
    for c in range(4):
        twin = twins[4 * face + c]
        if twin >= 0 and (twin >> 2) < face:
            if unite(parents_inout, face, twin >> 2):
                changed_inout[0] = 1


@wp.kernel
def unite_loops_kernel(
    first: wp.int32,
    # In:
    corners: wp.array[wp.int32],
    twins: wp.array[wp.int32],
    boundary: wp.array[wp.int32],
    # In/out:
    parents_inout: wp.array[wp.int32],
    changed_inout: wp.array[wp.int32],
) -> None:
    """Unite each boundary halfedge with the next one along its boundary. One thread per boundary halfedge."""
    b = first + wp.tid()
    h = next_halfedge(corners, boundary[b])
    while twins[h] >= 0:
        h = next_halfedge(corners, twins[h])
    if unite(parents_inout, b, wp.lower_bound(boundary, h)):
        changed_inout[0] = 1


@wp.func
def is_boundary(corners: wp.array[wp.int32], twins: wp.array[wp.int32], h: wp.int32) -> wp.bool:
    """Return whether slot `h` is a halfedge without a twin."""
    return twins[h] < 0 and corners[h] >= 0


@wp.kernel
def count_boundary_kernel(
    first: wp.int32,
    # In:
    corners: wp.array[wp.int32],
    twins: wp.array[wp.int32],
    # Out:
    counts_out: wp.array[wp.int64],
) -> None:
    """Count the boundary halfedges of a block. One thread per block."""
    block = first + wp.tid()
    count = int(0)
    for h in range(block * BLOCK, wp.min((block + 1) * BLOCK, twins.shape[0])):
        if is_boundary(corners, twins, h):
            count += 1
    counts_out[block] = wp.int64(count)


@wp.kernel
def emit_boundary_kernel(
    first: wp.int32,
    # In:
    corners: wp.array[wp.int32],
    twins: wp.array[wp.int32],
    starts: wp.array[wp.int64],
    # Out:
    boundary_out: wp.array[wp.int32],
) -> None:
    """List the boundary halfedges of a block in ascending order. One thread per block."""
    block = first + wp.tid()
    slot = wp.int32(starts[block])
    for h in range(block * BLOCK, wp.min((block + 1) * BLOCK, twins.shape[0])):
        if is_boundary(corners, twins, h):
            boundary_out[slot] = h
            slot += 1


def label_components(device: Device, twins: Any) -> Any:
    """Return for each face the smallest face that is connected with it through twins, (F,) int32.

    Args:
        device: Where `twins` is.
        twins: Twin of each halfedge, (4F,) int32.
    """
    return _label(device, twins.shape[0] // 4, unite_faces_kernel, [twins])


def list_boundary(device: Device, corners: Any, twins: Any) -> Any:
    """Return the halfedges without a twin in ascending order, (B,) int32.

    Args:
        device: Where the arrays are.
        corners: Vertex of each corner, (4F,) int32.
        twins: Twin of each halfedge, (4F,) int32.
    """
    blocks = -(-twins.shape[0] // int(BLOCK))
    counts = device.empty(blocks, wp.int64)
    device.launch(count_boundary_kernel, blocks, inputs=[corners, twins], outputs=[counts])
    starts, total = device.starts(counts)
    boundary = device.empty(total, wp.int32)
    if total:
        device.launch(emit_boundary_kernel, blocks, inputs=[corners, twins, starts], outputs=[boundary])
    return boundary


def label_loops(device: Device, corners: Any, twins: Any, boundary: Any) -> Any:
    """Return for each boundary halfedge the smallest index in `boundary` on the same loop, (B,) int32.

    A loop turns round every fan of faces on its own, so two fans that share a vertex do not join loops.

    Args:
        device: Where the arrays are.
        corners: Vertex of each corner, (4F,) int32.
        twins: Twin of each halfedge, (4F,) int32.
        boundary: The halfedges without a twin, ascending, (B,) int32.
    """
    return _label(device, boundary.shape[0], unite_loops_kernel, [corners, twins, boundary])


def count_roots(labels: Any) -> int:
    """Return the number of classes: of items that are their own label."""
    values = labels.numpy()
    return int(np.count_nonzero(values == np.arange(values.shape[0], dtype=values.dtype)))


def _label(device: Device, count: int, kernel: Any, inputs: list[Any]) -> Any:
    """Unite until nothing changes, then let every item point to its root."""
    parents = device.empty(count, wp.int32)
    device.launch(number_items_kernel, count, inputs=[], outputs=[parents])
    changed = device.zeros(1, wp.int32)
    while True:
        changed.zero_()
        device.launch(kernel, count, inputs=inputs, outputs=[parents, changed])
        if not changed.numpy()[0]:
            return parents
