"""Bound the distance from the vertices of the mesh before to the mesh as it changes.

Every vertex of the mesh before remeshing is a tracked point, assigned to a quad near it. It is near enough as
long as it is within `FARTHEST` of nine points of that quad: corners, midpoints of sides, centre. What moves
vertices or replaces quads asks first, and assigns other quads where that is needed; so no vertex of the old
mesh is ever further from the new one, however thin the tip that it stands on.

Distances are in cells, between coordinates in node indices.
"""

from dataclasses import dataclass, replace
from typing import Any

import warp as wp

from dmc_cli.field import Grid, GridShape, index_position
from dmc_cli.mesh import next_outgoing
from dmc_cli.runtime import Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

FARTHEST = wp.constant(0.9)
"""Cells from a tracked point to its quad: under the one that is promised, since single precision rounds."""

NEAR = wp.constant(0.4)
"""A tracked point that is this near looks for no nearer quad."""


@dataclass(frozen=True)
class TrackedPoints:
    """Points in node indices, vec3 (G,), and the quads that they are assigned to, int32 (G,), -1 for none."""

    point: Any
    nearest_quad: Any

    @property
    def count(self) -> int:
        """Return the number of tracked points."""
        return int(self.nearest_quad.shape[0])


def track_vertices(
    grid: GridShape, vertex_halfedge: Any, cell: Any, local: Any, device: Device
) -> TrackedPoints:
    """Return the vertices of a mesh as tracked points, each assigned to one of its own quads."""
    count = vertex_halfedge.shape[0]
    tracked = TrackedPoints(device.empty(count, wp.vec3), device.empty(count, wp.int32))
    inputs = [grid.struct(), vertex_halfedge, cell, local]
    device.launch(track_kernel, count, inputs, [tracked.point, tracked.nearest_quad])
    return tracked


def with_nearer_quads(tracked: TrackedPoints, grid: GridShape, mesh: Any, device: Device) -> TrackedPoints:
    """Return the tracked points assigned to the nearest quads at hand; `mesh` is a `MeshArrays`."""
    nearest_quad = device.empty(tracked.count, wp.int32)
    inputs = [
        grid.struct(),
        mesh.corners,
        mesh.twin,
        mesh.cell,
        mesh.local,
        tracked.point,
        tracked.nearest_quad,
    ]
    device.launch(assign_nearest_kernel, tracked.count, inputs, [nearest_quad])
    return replace(tracked, nearest_quad=nearest_quad)


def renumbered(nearest_quad: Any, new_faces: Any, device: Device) -> Any:
    """Return the new numbers of quads, int32 (G,); `new_faces` tells that of each quad there was."""
    found = device.empty(nearest_quad.shape[0], wp.int32)
    device.launch(renumber_kernel, nearest_quad.shape[0], [nearest_quad, new_faces], [found])
    return found


def list_points(tracked: TrackedPoints, quads: int, device: Device) -> tuple[Any, Any]:
    """Return the first point of each quad, int32 (Q,), and the next one of each point, int32 (G,), or -1."""
    count = tracked.count
    keys, items = device.empty(2 * count, wp.int32), device.empty(2 * count, wp.int32)
    device.launch(number_points_kernel, count, [tracked.nearest_quad], [keys, items])
    if count:
        wp.utils.radix_sort_pairs(keys, items, count)
    first, following = device.empty(quads, wp.int32), device.empty(count, wp.int32)
    first.fill_(-1)
    device.launch(link_points_kernel, count, [keys, items, count], [first, following])
    return first, following


def keep_points_near(
    tracked: TrackedPoints,
    grid: Any,
    corners: Any,
    then: Any,
    flags: tuple[Any, Any, Any],
    device: Device,
) -> None:
    """Tell the vertices that moves take too far from a point of one of their quads to retreat.

    Args:
        tracked: What must not be left behind.
        grid: The grid.
        corners: Vertices of the quads, int32 (4Q,).
        then: Where the vertices would be: arrays `cell` and `local`.
        flags: uint8 (V,), 1 for a vertex that the moves concern; uint8 (V,), set to 1 for those that must
            retreat; uint8 (Q,), set to 1 for their quads.
        device: Where the mesh is.
    """
    has_moved, retreat, failing = flags
    inputs = [grid, corners, then.cell, then.local, tracked.point, tracked.nearest_quad, has_moved]
    device.launch(keep_points_near_kernel, tracked.count, inputs, [retreat, failing])


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
def track_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    vertex_halfedge: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    # Out:
    point_out: wp.array(dtype=wp.vec3),
    nearest_out: wp.array(dtype=wp.int32),
) -> None:
    """Assign a vertex to one of its quads. One thread per vertex."""
    v = first + wp.tid()
    point_out[v] = single_index(grid, cell[v], local[v])
    nearest_out[v] = vertex_halfedge[v] >> 2  # -1 for a vertex of no face


@wp.kernel
def assign_nearest_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    point: wp.array(dtype=wp.vec3),
    nearest_quad: wp.array(dtype=wp.int32),
    # Out:
    nearest_out: wp.array(dtype=wp.int32),
) -> None:
    """Find the nearest of a point's quad, those across its sides and beside these. One thread per point."""
    g = first + wp.tid()
    best = nearest_quad[g]
    if best < 0:
        nearest_out[g] = best
        return
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
                    t = next_outgoing(twin, t)
    nearest_out[g] = best


@wp.kernel
def renumber_kernel(
    # In:
    first: wp.int32,
    nearest_quad: wp.array(dtype=wp.int32),
    new_faces: wp.array(dtype=wp.int32),
    # Out:
    nearest_out: wp.array(dtype=wp.int32),
) -> None:
    """Find the new numbers of the points' quads. One thread per point."""
    g = first + wp.tid()
    q = nearest_quad[g]
    nearest_out[g] = wp.where(q < 0, -1, new_faces[wp.max(q, 0)])


@wp.kernel
def number_points_kernel(
    # In:
    first: wp.int32,
    nearest_quad: wp.array(dtype=wp.int32),
    # Out:
    keys_out: wp.array(dtype=wp.int32),
    items_out: wp.array(dtype=wp.int32),
) -> None:
    """Write the points' numbers, to be sorted by their quads. One thread per point."""
    g = first + wp.tid()
    keys_out[g] = nearest_quad[g]
    items_out[g] = g


@wp.kernel
def link_points_kernel(
    # In:
    first: wp.int32,
    keys: wp.array(dtype=wp.int32),
    items: wp.array(dtype=wp.int32),
    count: wp.int32,
    # Out:
    first_out: wp.array(dtype=wp.int32),
    following_out: wp.array(dtype=wp.int32),
) -> None:
    """Link the points of each quad in ascending order. One thread per point."""
    n = first + wp.tid()
    if keys[n] >= 0 and (n == 0 or keys[wp.max(n, 1) - 1] != keys[n]):
        first_out[keys[n]] = items[n]
    following = int(-1)
    if n + 1 < count:
        if keys[n + 1] == keys[n]:
            following = items[n + 1]
    following_out[items[n]] = following


@wp.kernel
def keep_points_near_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    corners: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    point: wp.array(dtype=wp.vec3),
    nearest_quad: wp.array(dtype=wp.int32),
    has_moved: wp.array(dtype=wp.uint8),
    # In/out:
    retreat_inout: wp.array(dtype=wp.uint8),
    failing_inout: wp.array(dtype=wp.uint8),
) -> None:
    """Tell a quad's vertices that they go too far from a point of it. One thread per point.

    Several threads may tell a vertex, all the same.
    """
    g = first + wp.tid()
    q = nearest_quad[g]
    if q < 0:
        return
    is_touched = bool(False)
    for corner in range(4):
        if has_moved[corners[4 * q + corner]] != wp.uint8(0):
            is_touched = bool(True)
    if is_touched:
        if distance_from_quad(grid, corners, cell, local, q, point[g]) > FARTHEST:
            failing_inout[q] = wp.uint8(1)
            for corner in range(4):
                retreat_inout[corners[4 * q + corner]] = wp.uint8(1)
