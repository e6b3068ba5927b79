"""How an operation of the further simplification finds hosts for the guests of the quads that it changes."""

import warp as wp

from dmc_cli.processing.distance_guard import FARTHEST, distance_from_quad
from dmc_cli.processing.remeshing.work import GUESTS, JOURNALLED, PATCHED, QUAD_GONE, Work, fail, has_failed
from dmc_cli.processing.tangent_step import Scene

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def list_guests_of(work: Work, b: wp.int32, q: wp.int32, count: wp.int32) -> wp.int32:
    """Add a quad's guests to the block's list of `count`; return how many there are then."""
    size = count
    g = work.first_guest[q]
    while g >= 0:
        if size < GUESTS:
            work.guest[b, size] = g
        size += 1
        g = work.next_guest[g]
    return size


@wp.func
def list_guests_of_patch(work: Work, b: wp.int32) -> wp.int32:
    """List the guests of the patch and of the quads that the operation removed; return how many there are."""
    size = int(0)
    for n in range(work.tally[b, PATCHED]):
        size = list_guests_of(work, b, work.patch[b, n], size)
    for n in range(work.tally[b, JOURNALLED]):
        place = work.journal_place[b, n]
        q = wp.int32(place >> wp.int64(3))
        if wp.int32(place & wp.int64(7)) == QUAD_GONE:
            if work.quad_gone[q] != wp.uint8(0):
                size = list_guests_of(work, b, q, size)
    return size


@wp.func
def host_in_patch(scene: Scene, work: Work, b: wp.int32, g: wp.int32) -> wp.int32:
    """Return a guest's host as long as it is near enough, else the nearest quad of the patch, or -1."""
    host = work.host[g]
    point = work.guest_point[g]
    least = float(FARTHEST)
    best = int(-1)
    if work.quad_gone[host] == wp.uint8(0):
        if distance_from_quad(scene.grid, work.corners, work.cell, work.local, host, point) <= FARTHEST:
            best = host
    if best < 0:
        for n in range(work.tally[b, PATCHED]):
            q = work.patch[b, n]
            distance = distance_from_quad(scene.grid, work.corners, work.cell, work.local, q, point)
            if distance <= least:
                least = distance
                best = q
    return best


@wp.func
def lodge_guests(scene: Scene, work: Work, b: wp.int32):
    """Lodge the guests of an operation's quads with quads of the patch; fail if one is left behind."""
    size = list_guests_of_patch(work, b)
    if size > GUESTS:
        fail(work, b)
    n = int(0)
    while n < size and not has_failed(work, b):
        work.new_host[b, n] = host_in_patch(scene, work, b, work.guest[b, n])
        if work.new_host[b, n] < 0:
            fail(work, b)
        n += 1
    if not has_failed(work, b):
        for m in range(size):
            work.first_guest[work.host[work.guest[b, m]]] = -1
        for m in range(size):
            g = work.guest[b, m]
            host = work.new_host[b, m]
            work.host[g] = host
            work.next_guest[g] = work.first_guest[host]
            work.first_guest[host] = g
