"""Rate the diagonals that quads may be collapsed along: short ones that leave regular vertices are cheap."""

import warp as wp

from dmc_cli.mesh import quad_corner

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

PENALTY = wp.constant(3.0)
"""What a quad that was refused costs more, each time."""

NEVER = wp.constant(3.0e38)
"""Cost of a quad that cannot go."""

MOST_MERGED = wp.constant(6)
"""Largest valence of a merged vertex."""


@wp.func
def irregularity_added(
    corners: wp.array(dtype=wp.int32), valence: wp.array(dtype=wp.int32), h: wp.int32
) -> wp.int32:
    """Return what collapsing a diagonal adds to the irregularity, a bonus for doublets counted in."""
    a = valence[quad_corner(corners, h, 0)] - 4
    b = valence[quad_corner(corners, h, 1)] - 4
    c = valence[quad_corner(corners, h, 2)] - 4
    d = valence[quad_corner(corners, h, 3)] - 4
    merged = a + c + 2
    added = merged * merged - a * a - c * c + 2 - 2 * b - 2 * d
    if b == -1:
        added -= 2
    if d == -1:
        added -= 2
    return added


@wp.func
def cost_of(
    corners: wp.array(dtype=wp.int32),
    valence: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    refused: wp.array(dtype=wp.uint8),
    weight: wp.array(dtype=wp.float32),
    per_step: wp.float32,
    h: wp.int32,
) -> wp.float32:
    """Return what collapsing the diagonal from halfedge h costs."""
    merged = valence[quad_corner(corners, h, 0)] + valence[quad_corner(corners, h, 2)] - 2
    cost = float(NEVER)
    if merged >= 3 and merged <= MOST_MERGED:
        cost = wp.length(position[quad_corner(corners, h, 2)] - position[quad_corner(corners, h, 0)])
        cost *= weight[h >> 2]
        added = irregularity_added(corners, valence, h)
        for _n in range(wp.abs(added)):
            cost = wp.where(added > 0, cost * per_step, cost / per_step)
        for _n in range(wp.int32(refused[h >> 2])):
            cost *= PENALTY
    return cost


@wp.kernel
def rate_kernel(
    # In:
    first: wp.int32,
    corners: wp.array(dtype=wp.int32),
    valence: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    refused: wp.array(dtype=wp.uint8),
    weight: wp.array(dtype=wp.float32),
    per_step: wp.float32,
    vertex_region: wp.array(dtype=wp.int32),
    count: wp.int32,
    # Out:
    cost_out: wp.array(dtype=wp.float32),
    region_out: wp.array(dtype=wp.int32),
    items_out: wp.array(dtype=wp.int32),
) -> None:
    """Find what each quad costs, and its region, `count` for none. One thread a quad."""
    q = first + wp.tid()
    cost = cost_of(corners, valence, position, refused, weight, per_step, 4 * q)
    cost = wp.min(cost, cost_of(corners, valence, position, refused, weight, per_step, 4 * q + 1))
    region = vertex_region[corners[4 * q]]
    for c in range(1, 4):
        if vertex_region[corners[4 * q + c]] != region:
            region = int(-1)
    cost_out[q] = wp.where(region < 0, NEVER, cost)
    region_out[q] = wp.where(region < 0, count, region)
    items_out[q] = q


@wp.kernel
def gather_regions_kernel(
    # In:
    first: wp.int32,
    region: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    # Out:
    keys_out: wp.array(dtype=wp.int32),
) -> None:
    """Write the regions of quads in the order that they are listed in. One thread a quad."""
    n = first + wp.tid()
    keys_out[n] = region[items[n]]
