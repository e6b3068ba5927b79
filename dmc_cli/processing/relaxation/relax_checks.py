"""Check quad by quad whether a step of smoothing may be taken (`relax.py`)."""

import warp as wp

from dmc_cli.mesh.halfedges import previous_halfedge
from dmc_cli.processing.quad_square import quad_shape
from dmc_cli.processing.surface_distance import HIGHEST, distance_from_surface, quad_centre
from dmc_cli.processing.tangent_step import SurfaceContext

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


SLIVER = wp.constant(0.4)
"""Shape of quads that may fold: on a blob flatter than a cell they get better in no other way."""


@wp.struct
class Ring:
    """The mesh that a kernel walks on; `sense` is 1 if quads face along the gradient of F, else -1."""

    corners: wp.array(dtype=wp.int32)
    twin: wp.array(dtype=wp.int32)
    start: wp.array(dtype=wp.int32)
    valence: wp.array(dtype=wp.int32)
    sense: wp.float32


@wp.struct
class Spots:
    """Where vertices are: positions, cells, local coordinates, and the surface's unit normals."""

    position: wp.array(dtype=wp.vec3)
    cell: wp.array(dtype=wp.int64)
    local: wp.array(dtype=wp.vec3)
    normal: wp.array(dtype=wp.vec3)


@wp.func
def turn(ring: Ring, h: wp.int32) -> wp.int32:
    """Return the next halfedge that leaves the same vertex, or -1 on a boundary."""
    return ring.twin[previous_halfedge(h)]


@wp.func
def ring_size(ring: Ring, v: wp.int32) -> wp.int32:
    """Return the number of quads round a vertex if they form one ring, else 0."""
    size = int(0)
    start = ring.start[v]
    valence = ring.valence[v]
    h = start
    while h >= 0 and size < valence:
        size += 1
        h = turn(ring, h)
        if h == start:
            if size == valence:
                return size
            return 0
    return 0


@wp.func
def corner_point(ring: Ring, position: wp.array(dtype=wp.vec3), h: wp.int32, step: wp.int32) -> wp.vec3:
    """Return the position of the corner `step` corners after halfedge h's in its quad."""
    return position[ring.corners[(h & ~3) | ((h + step) & 3)]]


@wp.func
def faces_surface(ring: Ring, spots: Spots, h: wp.int32) -> wp.bool:
    """Return whether the corner of halfedge h turns the way that the surface faces there."""
    v = ring.corners[h]
    here = spots.position[v]
    before = here - corner_point(ring, spots.position, h, 3)
    after = corner_point(ring, spots.position, h, 1) - here
    return ring.sense * wp.dot(wp.cross(before, after), spots.normal[v]) > 0.0


@wp.func
def area_of(ring: Ring, position: wp.array(dtype=wp.vec3), q: wp.int32) -> wp.vec3:
    """Return a quad's normal, as long as twice its area."""
    across = corner_point(ring, position, 4 * q, 2) - corner_point(ring, position, 4 * q, 0)
    return wp.cross(across, corner_point(ring, position, 4 * q, 3) - corner_point(ring, position, 4 * q, 1))


@wp.func
def folds_anew(
    ring: Ring, now: Spots, then: Spots, q: wp.int32, shape: wp.array(dtype=wp.float32)
) -> wp.bool:
    """Return whether the moves turn a quad and one across a side, both not slivers, over 90 degrees apart."""
    result = bool(False)
    area = area_of(ring, then.position, q)
    for c in range(4):
        t = ring.twin[4 * q + c]
        if t >= 0:
            if (
                wp.min(shape[q], shape[t >> 2]) > SLIVER
                and wp.dot(area, area_of(ring, then.position, t >> 2)) < 0.0
            ):
                if wp.dot(area_of(ring, now.position, q), area_of(ring, now.position, t >> 2)) >= 0.0:
                    result = bool(True)
    return result


@wp.func
def is_spoilt(
    ring: Ring, now: Spots, then: Spots, q: wp.int32, shape: wp.float32, floor: wp.array(dtype=wp.float32)
) -> wp.bool:
    """Return whether the moves worsen a quad below its vertices' floors or turn one of its corners."""
    h = 4 * q
    least = float(1.0)
    is_inverted = bool(False)
    for corner in range(4):
        least = wp.min(least, floor[ring.corners[h + corner]])
        if faces_surface(ring, now, h + corner) and not faces_surface(ring, then, h + corner):
            is_inverted = bool(True)
    a = corner_point(ring, then.position, h, 0)
    b = corner_point(ring, then.position, h, 1)
    c = corner_point(ring, then.position, h, 2)
    d = corner_point(ring, then.position, h, 3)
    found = quad_shape(a, b, c, d)
    return is_inverted or (found < shape and (found < least or found <= 0.0))


@wp.func
def rises(context: SurfaceContext, ring: Ring, now: Spots, then: Spots, q: wp.int32) -> wp.bool:
    """Return whether the moves take a quad's centre away from the surface, too far."""
    height = distance_from_surface(context, quad_centre(context, ring.corners, then.cell, then.local, q))
    too_far = height > HIGHEST
    if too_far:
        centre = quad_centre(context, ring.corners, now.cell, now.local, q)
        too_far = height > distance_from_surface(context, centre)
    return too_far


@wp.kernel
def check_kernel(
    # In:
    first: wp.int32,
    context: SurfaceContext,
    ring: Ring,
    now: Spots,
    then: Spots,
    shape: wp.array(dtype=wp.float32),
    floor: wp.array(dtype=wp.float32),
    is_strict: wp.int32,
    has_moved: wp.array(dtype=wp.uint8),
    # In/out:
    must_retreat_inout: wp.array(dtype=wp.uint8),
    # Out:
    failing_out: wp.array(dtype=wp.uint8),
):
    """Find the quads that the last moves spoil, and tell their vertices. One thread a quad.

    Several threads may tell a vertex, all the same.
    """
    q = first + wp.tid()
    is_touched = bool(False)
    for corner in range(4):
        if has_moved[ring.corners[4 * q + corner]] != wp.uint8(0):
            is_touched = bool(True)
    failing = wp.uint8(0)
    if is_touched:
        spoilt = is_spoilt(ring, now, then, q, shape[q], floor)
        if not spoilt and is_strict == 1:
            spoilt = folds_anew(ring, now, then, q, shape) or rises(context, ring, now, then, q)
        if spoilt:
            failing = wp.uint8(1)
            for corner in range(4):
                must_retreat_inout[ring.corners[4 * q + corner]] = wp.uint8(1)
    failing_out[q] = failing
