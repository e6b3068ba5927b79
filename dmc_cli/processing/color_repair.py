"""Give quads that have become neighbours different colours again, 0 to 4.

After a quad is removed, the quads on both sides of it are neighbours, and may have the same colour. Each quad
in such a clash takes the lowest colour that no neighbour has, in rounds, in which it waits for clashing
neighbours with a lower key, a hash of the number.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import VECTOR_FLAGS, concatenated, keep_flagged, order_key
from dmc_cli.field import prefetch_onward
from dmc_cli.runtime import FLAGS_A_CHUNK, ITEMS_A_CHUNK, Device

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


def repair_colors(device: Device, twin: Any, colors: Any, *seams: Any, gone: Any | None = None) -> None:
    """Give other colours, 0 to 4, to quads with the colour of a neighbour, until there are none.

    Args:
        device: Where to work.
        twin: Twin of each halfedge, int32 (4Q,).
        colors: Colours 0 to 4, uint8 (Q,); changed in place.
        seams: Lists of the halfedges that got new twins, int32, -1 for none: nowhere else can colours clash.
        gone: Quads that are no more, uint8 (Q,), 1 for those; None if all are there.
    """
    gone = device.zeros(colors.shape[0], wp.uint8) if gone is None else gone
    listed = concatenated(device, seams)
    flags = device.empty(listed.shape[0], wp.int64)
    device.launch(find_clashes_kernel, listed.shape[0], [twin, colors, gone, listed], [flags], FLAGS_A_CHUNK)
    clashing = keep_flagged(device, listed, flags)
    quads = device.empty(2 * clashing.shape[0], wp.int32)
    device.launch(list_ends_kernel, clashing.shape[0], [twin, clashing], [quads], FLAGS_A_CHUNK)
    while quads.shape[0]:
        size = quads.shape[0]
        chosen, waits = device.empty(size, wp.int32), device.empty(size, wp.int64)
        device.launch(choose_colors_kernel, size, [twin, colors, quads], [chosen, waits], ITEMS_A_CHUNK)
        device.launch(set_colors_kernel, size, [quads, chosen], [colors], FLAGS_A_CHUNK)
        quads = keep_flagged(device, quads, waits)


@wp.func
def first_free(twin: wp.array(dtype=wp.int32), colors: wp.array(dtype=wp.uint8), q: wp.int32) -> wp.int32:
    """Return the lowest colour that no neighbour of a quad has; it is below 5."""
    taken = int(0)
    for c in range(4):
        t = twin[4 * q + c]
        if t >= 0:
            taken |= 1 << wp.int32(colors[t >> 2])
    free = ~taken
    lowest = free & -free
    return wp.int32(wp.bit_count(wp.uint32(lowest - 1)))


@wp.kernel
def find_clashes_kernel(
    # In:
    first: wp.int32,
    twin: wp.array(dtype=wp.int32),
    colors: wp.array(dtype=wp.uint8),
    gone: wp.array(dtype=wp.uint8),
    seams: wp.array(dtype=wp.int32),
    # Out:
    flags_out: wp.array(dtype=wp.int64),
) -> None:
    """Flag the new twins whose quads have one colour. One thread per halfedge of the list."""
    n = first + wp.tid()
    h = seams[n]
    clash = bool(False)
    if h >= 0:
        if gone[h >> 2] == wp.uint8(0) and twin[h] >= 0:
            clash = colors[h >> 2] == colors[twin[h] >> 2]
    flags_out[n] = wp.int64(wp.where(clash, 1, 0))


@wp.kernel
def list_ends_kernel(
    # In:
    first: wp.int32,
    twin: wp.array(dtype=wp.int32),
    seams: wp.array(dtype=wp.int32),
    # Out:
    quads_out: wp.array(dtype=wp.int32),
) -> None:
    """List the quads on both sides of halfedges. One thread per halfedge of the list."""
    n = first + wp.tid()
    quads_out[2 * n] = seams[n] >> 2
    quads_out[2 * n + 1] = twin[seams[n]] >> 2


@wp.func
def clashes(twin: wp.array(dtype=wp.int32), colors: wp.array(dtype=wp.uint8), q: wp.int32) -> wp.bool:
    """Return whether a quad has the colour of a neighbour."""
    found = bool(False)
    for c in range(4):
        t = twin[4 * q + c]
        if t >= 0:
            found = found or colors[t >> 2] == colors[q]
    return found


@wp.kernel
def choose_colors_kernel(
    # In:
    first: wp.int32,
    twin: wp.array(dtype=wp.int32),
    colors: wp.array(dtype=wp.uint8),
    quads: wp.array(dtype=wp.int32),
    # Out:
    chosen_out: wp.array(dtype=wp.int32),
    waits_out: wp.array(dtype=wp.int64),
) -> None:
    """Choose a colour for each quad in a clash, unless a neighbour with a lower key is in one, too.

    One thread per quad of the list, which may hold a quad more than once.
    """
    n = first + wp.tid()
    prefetch_onward(quads, twin, n)
    q = quads[n]
    chosen = int(-1)
    waits = bool(False)
    if clashes(twin, colors, q):
        for c in range(4):
            t = twin[4 * q + c]
            if t >= 0 and order_key(t >> 2) < order_key(q):
                waits = waits or clashes(twin, colors, t >> 2)
        if not waits:
            chosen = first_free(twin, colors, q)
    chosen_out[n] = chosen
    waits_out[n] = wp.int64(wp.where(waits, 1, 0))


@wp.kernel
def set_colors_kernel(
    # In:
    first: wp.int32,
    quads: wp.array(dtype=wp.int32),
    chosen: wp.array(dtype=wp.int32),
    # In/out:
    colors_inout: wp.array(dtype=wp.uint8),
) -> None:
    """Set the colours that were chosen. One thread per quad of the list."""
    n = first + wp.tid()
    if chosen[n] >= 0:
        colors_inout[quads[n]] = wp.uint8(chosen[n])
