"""Move the vertices of a label net: smooth it, spread what is owed over the surface, give it back.

Each vertex stays in its cell, less `MARGIN` a side. The *bend* of a regular vertex is the way from it to the
mean of its neighbours; those on curves have two neighbours, along the curve, and vertices that stay have no
bend.
"""

import warp as wp

from dmc_cli.contouring.label_surfaces.links import FIXED, REGULAR, Links

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

MARGIN = wp.constant(0.02)
"""How far a vertex stays from the faces of its cell."""

MOST_GIVEN = wp.constant(0.3)
"""The farthest that a vertex moves at a time to give back volume, in steps of the grid."""


@wp.func
def kept_in_cell(p: wp.vec3) -> wp.vec3:
    """Return the nearest place that a vertex may have."""
    low = wp.vec3(MARGIN, MARGIN, MARGIN)
    high = wp.vec3(1.0 - MARGIN, 1.0 - MARGIN, 1.0 - MARGIN)
    return wp.min(wp.max(p, low), high)


@wp.kernel
def bend_kernel(
    # In:
    first: wp.int32,
    links: Links,
    local: wp.array(dtype=wp.vec3),
    # Out:
    bend_out: wp.array(dtype=wp.vec3),
) -> None:
    """Find the way from a vertex to the mean of its neighbours. One thread per vertex."""
    v = first + wp.tid()
    bend = wp.vec3()
    kind = wp.int32(links.kind[v])
    if kind != FIXED:
        start = links.neighbour_start[v]
        end = wp.where(kind == REGULAR, links.neighbour_start[v + 1], start + 2)
        for slot in range(start, end):
            bend += local[links.neighbours[slot]]
        bend = bend / float(end - start) + links.shift[v] - local[v]
    bend_out[v] = bend


@wp.kernel
def average_kernel(
    # In:
    first: wp.int32,
    links: Links,
    bend: wp.array(dtype=wp.vec3),
    share: wp.float32,
    curve_share: wp.float32,
    # In/out:
    local_inout: wp.array(dtype=wp.vec3),
) -> None:
    """Move a vertex a share of the way to the mean of its neighbours. One thread per vertex."""
    v = first + wp.tid()
    part = wp.where(wp.int32(links.kind[v]) == REGULAR, share, curve_share)
    local_inout[v] = kept_in_cell(local_inout[v] + part * bend[v])


@wp.kernel
def unbend_kernel(
    # In:
    first: wp.int32,
    links: Links,
    bend: wp.array(dtype=wp.vec3),
    share: wp.float32,
    curve_share: wp.float32,
    # In/out:
    local_inout: wp.array(dtype=wp.vec3),
) -> None:
    """Move a regular vertex so that it bends like its neighbours, one on a curve as `average_kernel` does.

    One thread per vertex.
    """
    v = first + wp.tid()
    kind = wp.int32(links.kind[v])
    own = bend[v]
    if kind == REGULAR:
        mean = wp.vec3()
        start = links.neighbour_start[v]
        end = links.neighbour_start[v + 1]
        for slot in range(start, end):
            mean += bend[links.neighbours[slot]]
        local_inout[v] = kept_in_cell(local_inout[v] + share * (own - mean / float(end - start)))
    elif kind != FIXED:
        local_inout[v] = kept_in_cell(local_inout[v] + curve_share * own)


@wp.kernel
def find_parts_kernel(
    # In:
    first: wp.int32,
    links: Links,
    # Out:
    part_out: wp.array(dtype=wp.float32),
) -> None:
    """Find what part of what it owes a vertex hands to each regular neighbour. One thread per vertex.

    It is 1 for a regular vertex without such a neighbour, which keeps all, and 0 for what is not regular.
    """
    v = first + wp.tid()
    part = float(0.0)
    if wp.int32(links.kind[v]) == REGULAR:
        count = int(0)
        for slot in range(links.neighbour_start[v], links.neighbour_start[v + 1]):
            count += wp.where(wp.int32(links.kind[links.neighbours[slot]]) == REGULAR, 1, 0)
        part = wp.where(count > 0, 0.5 / float(wp.max(count, 1)), 1.0)
    part_out[v] = part


@wp.kernel
def spread_kernel(
    # In:
    first: wp.int32,
    links: Links,
    part: wp.array(dtype=wp.float32),
    parts: wp.array(dtype=wp.vec2),
    # Out:
    parts_out: wp.array(dtype=wp.vec2),
) -> None:
    """Let each regular vertex keep half of what it owes and get its neighbours' parts; the sum stays.

    Both arrays hold the part of what a vertex owes, and of its area, that it hands to each neighbour; those
    of vertices that are not regular are 0. One thread per vertex.
    """
    v = first + wp.tid()
    own = parts[v]
    share = part[v]
    if share > 0.0 and share < 1.0:
        got = wp.vec2()
        for slot in range(links.neighbour_start[v], links.neighbour_start[v + 1]):
            got += parts[links.neighbours[slot]]
        own = 0.5 * own + share * got
    parts_out[v] = own


@wp.kernel
def give_back_kernel(
    # In:
    first: wp.int32,
    _links: Links,
    local: wp.array(dtype=wp.vec3),
    normal: wp.array(dtype=wp.vec3),
    parts: wp.array(dtype=wp.vec2),
    # Out:
    local_out: wp.array(dtype=wp.vec3),
) -> None:
    """Move a regular vertex against its normal by what it owes over its area. One thread per vertex."""
    v = first + wp.tid()
    p = local[v]
    part = parts[v]
    if part[1] > 0.0:
        far = wp.clamp(part[0] / part[1], -MOST_GIVEN, MOST_GIVEN)
        p = kept_in_cell(p - far * wp.normalize(normal[v]))
    local_out[v] = p
