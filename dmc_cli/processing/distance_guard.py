"""Guests: points that a mesh must not leave behind, each the guest of a quad near it.

The further simplification lodges every vertex of the mesh before it with a quad, its host. A guest is lodged
well as long as it is within `FARTHEST` of nine points of its host: corners, midpoints of sides, centre. What
moves vertices or replaces quads asks first, and finds other hosts where that is needed; so no vertex of the
old mesh is ever further from the new one, however thin the tip that it stands on.

Distances are in cells, between coordinates in node indices.
"""

from dataclasses import dataclass, replace
from typing import Any

import warp as wp

from dmc_cli.field.grid import Grid, GridShape
from dmc_cli.field.projection import index_position
from dmc_cli.mesh.halfedges import previous_halfedge
from dmc_cli.runtime.device import Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

FARTHEST = wp.constant(0.9)
"""Cells from a guest to its host: under the one cell that is promised, since single precision rounds."""

NEAR = wp.constant(0.4)
"""A guest that is this near looks for no nearer host."""


@dataclass(frozen=True)
class Guests:
    """Points in node indices, vec3 (G,), and the quads that they are guests of, int32 (G,)."""

    point: Any
    host: Any

    @property
    def count(self) -> int:
        """How many there are."""
        return int(self.host.shape[0])


def lodge_vertices(grid: GridShape, vertex_halfedge: Any, cell: Any, local: Any, device: Device) -> Guests:
    """Return the vertices of a mesh as guests of a quad of their own each."""
    count = vertex_halfedge.shape[0]
    guests = Guests(device.empty(count, wp.vec3), device.empty(count, wp.int32))
    inputs = [grid.struct(), vertex_halfedge, cell, local]
    device.launch(lodge_kernel, count, inputs, [guests.point, guests.host])
    return guests


def with_nearer_hosts(guests: Guests, grid: GridShape, mesh: Any, device: Device) -> Guests:
    """Return the guests of a mesh without gaps, lodged with the nearest quads at hand."""
    host = device.empty(guests.count, wp.int32)
    inputs = [grid.struct(), mesh.corners, mesh.twin, mesh.cell, mesh.local, guests.point, guests.host]
    device.launch(move_guests_kernel, guests.count, inputs, [host])
    return replace(guests, host=host)


def list_guests(guests: Guests, quads: int, device: Device) -> tuple[Any, Any]:
    """Return the first guest of each quad, int32 (Q,), and the next one of each guest, int32 (G,), or -1."""
    count = guests.count
    keys, items = device.empty(2 * count, wp.int32), device.empty(2 * count, wp.int32)
    device.launch(number_guests_kernel, count, [guests.host], [keys, items])
    if count:
        wp.utils.radix_sort_pairs(keys, items, count)
    first, following = device.empty(quads, wp.int32), device.empty(count, wp.int32)
    first.fill_(-1)
    device.launch(link_guests_kernel, count, [keys, items, count], [first, following])
    return first, following


def keep_guests(
    guests: Guests,
    grid: Any,
    corners: Any,
    then: Any,
    has_moved: Any,
    retreat: Any,
    failing: Any,
    device: Device,
) -> None:
    """Tell the vertices of hosts that moves take too far from a guest that they must retreat.

    Args:
        guests: Who must not be left behind.
        grid: The grid.
        corners: Vertices of the quads, int32 (4Q,).
        then: Where the vertices would be: arrays `cell` and `local`.
        has_moved: uint8 (V,), 1 for a vertex that the moves concern.
        retreat: uint8 (V,), set to 1 for those that must retreat.
        failing: uint8 (Q,), set to 1 for their quads.
        device: Where the mesh is.
    """
    inputs = [grid, corners, then.cell, then.local, guests.point, guests.host, has_moved]
    device.launch(keep_guests_kernel, guests.count, inputs, [retreat, failing])


@wp.func
def single_index(grid: Grid, cell: wp.int64, local: wp.vec3) -> wp.vec3:
    """Return a vertex's coordinates in node indices in single precision."""
    x = index_position(grid, cell, local)
    return wp.vec3(wp.float32(x[0]), wp.float32(x[1]), wp.float32(x[2]))


@wp.func
def distance_from_quad(
    grid: Grid,
    corners: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    q: wp.int32,
    point: wp.vec3,
) -> wp.float32:
    """Return the distance of a point from the nearest of nine points of a quad, in cells."""
    a = single_index(grid, cell[corners[4 * q]], local[corners[4 * q]]) - point
    b = single_index(grid, cell[corners[4 * q + 1]], local[corners[4 * q + 1]]) - point
    c = single_index(grid, cell[corners[4 * q + 2]], local[corners[4 * q + 2]]) - point
    d = single_index(grid, cell[corners[4 * q + 3]], local[corners[4 * q + 3]]) - point
    least = wp.min(wp.min(wp.length_sq(a), wp.length_sq(b)), wp.min(wp.length_sq(c), wp.length_sq(d)))
    least = wp.min(least, 0.25 * wp.min(wp.length_sq(a + b), wp.length_sq(b + c)))
    least = wp.min(least, 0.25 * wp.min(wp.length_sq(c + d), wp.length_sq(d + a)))
    return wp.sqrt(wp.min(least, 0.0625 * wp.length_sq((a + c) + (b + d))))


@wp.kernel
def lodge_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    vertex_halfedge: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    # Out:
    point_out: wp.array(dtype=wp.vec3),
    host_out: wp.array(dtype=wp.int32),
):
    """Make a vertex the guest of one of its quads. One thread a vertex."""
    v = first + wp.tid()
    point_out[v] = single_index(grid, cell[v], local[v])
    host_out[v] = vertex_halfedge[v] >> 2


@wp.kernel
def move_guests_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    point: wp.array(dtype=wp.vec3),
    host: wp.array(dtype=wp.int32),
    # Out:
    host_out: wp.array(dtype=wp.int32),
):
    """Find the nearest of a guest's host, the quads across its sides and beside these. One thread a guest."""
    g = first + wp.tid()
    best = host[g]
    least = distance_from_quad(grid, corners, cell, local, best, point[g])
    if least > NEAR:
        home = best
        for c in range(4):
            t = twin[4 * home + c]
            for _step in range(2):
                if t >= 0:
                    distance = distance_from_quad(grid, corners, cell, local, t >> 2, point[g])
                    if distance < least:
                        least = distance
                        best = t >> 2
                    t = twin[previous_halfedge(t)]
    host_out[g] = best


@wp.kernel
def number_guests_kernel(
    # In:
    first: wp.int32,
    host: wp.array(dtype=wp.int32),
    # Out:
    keys_out: wp.array(dtype=wp.int32),
    items_out: wp.array(dtype=wp.int32),
):
    """Number the guests, to be sorted by their hosts. One thread a guest."""
    g = first + wp.tid()
    keys_out[g] = host[g]
    items_out[g] = g


@wp.kernel
def link_guests_kernel(
    # In:
    first: wp.int32,
    keys: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    count: wp.int32,
    # Out:
    first_out: wp.array(dtype=wp.int32),
    following_out: wp.array(dtype=wp.int32),
):
    """Link the guests of each quad in ascending order. One thread a guest."""
    n = first + wp.tid()
    if n == 0 or keys[wp.max(n, 1) - 1] != keys[n]:
        first_out[keys[n]] = items[n]
    following = int(-1)
    if n + 1 < count:
        if keys[n + 1] == keys[n]:
            following = items[n + 1]
    following_out[items[n]] = following


@wp.kernel
def keep_guests_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    corners: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    point: wp.array(dtype=wp.vec3),
    host: wp.array(dtype=wp.int32),
    has_moved: wp.array(dtype=wp.uint8),
    # In/out:
    retreat_inout: wp.array(dtype=wp.uint8),
    failing_inout: wp.array(dtype=wp.uint8),
):
    """Tell a host's vertices that they go too far from a guest. One thread a guest.

    Several threads may tell a vertex, all the same.
    """
    g = first + wp.tid()
    q = host[g]
    is_touched = bool(False)
    for corner in range(4):
        if has_moved[corners[4 * q + corner]] != wp.uint8(0):
            is_touched = bool(True)
    if is_touched:
        if distance_from_quad(grid, corners, cell, local, q, point[g]) > FARTHEST:
            failing_inout[q] = wp.uint8(1)
            for corner in range(4):
                retreat_inout[corners[4 * q + corner]] = wp.uint8(1)
