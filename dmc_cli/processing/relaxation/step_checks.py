"""Check quad by quad whether a step of smoothing may be taken (`steps.py`)."""

import warp as wp

from dmc_cli.mesh import MeshArrays, quad_corner
from dmc_cli.processing.quad_square import (
    COS_SEVERE,
    passes_warp_limit,
    quad_area,
    quad_shape,
    warp_cosine,
)
from dmc_cli.processing.surface_distance import HIGHEST, distance_from_surface, quad_centre
from dmc_cli.processing.tangent_step import SurfaceContext

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


SLIVER = wp.constant(0.4)
"""Shape of quads that relaxation may warp, and that remeshing may fold: on a blob flatter than a cell they
get better in no other way."""

NO_SLIVER = -2.0
"""A shape that no quad has: none may fold."""


@wp.struct
class Spots:
    """Where vertices are: positions, cells, local coordinates, and the surface's unit normals."""

    position: wp.array(dtype=wp.vec3)
    cell: wp.array(dtype=wp.int64)
    local: wp.array(dtype=wp.vec3)
    normal: wp.array(dtype=wp.vec3)


@wp.func
def faces_surface(corners: wp.array(dtype=wp.int32), spots: Spots, h: wp.int32, sense: wp.float32) -> wp.bool:
    """Return whether the corner of halfedge h turns the way that the surface faces there."""
    v = corners[h]
    here = spots.position[v]
    before = here - spots.position[quad_corner(corners, h, 3)]
    after = spots.position[quad_corner(corners, h, 1)] - here
    return sense * wp.dot(wp.cross(before, after), spots.normal[v]) > 0.0


@wp.func
def tell_folds(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    now: Spots,
    then: Spots,
    q: wp.int32,
    shape: wp.array(dtype=wp.float32),
    sliver: wp.float32,
    must_retreat_inout: wp.array(dtype=wp.uint8),
) -> wp.bool:
    """Return whether the moves turn a quad and one across a side over 90 degrees apart; tell the latter.

    It may stand still by now, and nobody else would look at it. Quads of a shape up to `sliver` count for
    nothing.
    """
    result = bool(False)
    area = quad_area(corners, then.position, q)
    for c in range(4):
        other = twin[4 * q + c] >> 2
        if other >= 0:
            if (
                wp.min(shape[q], shape[other]) > sliver
                and wp.dot(area, quad_area(corners, then.position, other)) < 0.0
            ):
                if (
                    wp.dot(quad_area(corners, now.position, q), quad_area(corners, now.position, other))
                    >= 0.0
                ):
                    result = bool(True)
                    for corner in range(4):
                        must_retreat_inout[corners[4 * other + corner]] = wp.uint8(1)
    return result


@wp.func
def is_spoilt(
    corners: wp.array(dtype=wp.int32),
    now: Spots,
    then: Spots,
    q: wp.int32,
    shape: wp.float32,
    floor: wp.array(dtype=wp.float32),
    sense: wp.float32,
    is_tracked: wp.int32,
) -> wp.bool:
    """Return whether the moves worsen a quad below its vertices' floors, turn a corner or warp it.

    In remeshing, where points are tracked, slivers may not be warped either, and no quad further
    beyond 60 degrees.
    """
    h = 4 * q
    least = float(1.0)
    is_inverted = bool(False)
    for corner in range(4):
        least = wp.min(least, floor[corners[h + corner]])
        if faces_surface(corners, now, h + corner, sense) and not faces_surface(
            corners, then, h + corner, sense
        ):
            is_inverted = bool(True)
    a = then.position[quad_corner(corners, h, 0)]
    b = then.position[quad_corner(corners, h, 1)]
    c = then.position[quad_corner(corners, h, 2)]
    d = then.position[quad_corner(corners, h, 3)]
    found = quad_shape(a, b, c, d)
    warp = warp_cosine(a, b, c, d)
    a = now.position[quad_corner(corners, h, 0)]
    b = now.position[quad_corner(corners, h, 1)]
    c = now.position[quad_corner(corners, h, 2)]
    d = now.position[quad_corner(corners, h, 3)]
    is_worse = found < shape and (found < least or found <= 0.0)
    warp_before = warp_cosine(a, b, c, d)
    is_warped = (shape > SLIVER or is_tracked == 1) and passes_warp_limit(warp_before, warp)
    is_warped = is_warped or (is_tracked == 1 and warp < wp.min(warp_before, COS_SEVERE))
    return is_inverted or is_worse or is_warped


@wp.func
def rises(
    context: SurfaceContext, corners: wp.array(dtype=wp.int32), now: Spots, then: Spots, q: wp.int32
) -> wp.bool:
    """Return whether the moves take a quad's centre away from the surface, too far."""
    height = distance_from_surface(context, quad_centre(context, corners, then.cell, then.local, q))
    too_far = height > HIGHEST
    if too_far:
        centre = quad_centre(context, corners, now.cell, now.local, q)
        too_far = height > distance_from_surface(context, centre)
    return too_far


@wp.kernel
def check_kernel(
    # In:
    first: wp.int32,
    context: SurfaceContext,
    mesh: MeshArrays,
    sense: wp.float32,
    now: Spots,
    then: Spots,
    shape: wp.array(dtype=wp.float32),
    floor: wp.array(dtype=wp.float32),
    is_tracked: wp.int32,
    sliver: wp.float32,
    has_moved: wp.array(dtype=wp.uint8),
    # In/out:
    must_retreat_inout: wp.array(dtype=wp.uint8),
    # Out:
    failing_out: wp.array(dtype=wp.uint8),
) -> None:
    """Find the quads that the last moves spoil, and tell their vertices. One thread per quad.

    Several threads may tell a vertex, all the same.
    """
    q = first + wp.tid()
    is_touched = bool(False)
    for corner in range(4):
        if has_moved[mesh.corners[4 * q + corner]] != wp.uint8(0):
            is_touched = bool(True)
    failing = wp.uint8(0)
    if is_touched:
        spoilt = is_spoilt(mesh.corners, now, then, q, shape[q], floor, sense, is_tracked)
        if not spoilt:
            spoilt = tell_folds(mesh.corners, mesh.twin, now, then, q, shape, sliver, must_retreat_inout)
        if not spoilt and is_tracked == 1:
            spoilt = rises(context, mesh.corners, now, then, q)
        if spoilt:
            failing = wp.uint8(1)
            for corner in range(4):
                must_retreat_inout[mesh.corners[4 * q + corner]] = wp.uint8(1)
    failing_out[q] = failing
