"""Check quad by quad whether a step of smoothing may be taken (`steps.py`)."""

import warp as wp

from dmc_cli.mesh import MeshArrays, quad_corner
from dmc_cli.processing.quad_square import quad_area, quad_shape
from dmc_cli.processing.surface_distance import HIGHEST, distance_from_surface, quad_centre
from dmc_cli.processing.tangent_step import SurfaceContext

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


SLIVER = wp.constant(0.4)
"""Shape of quads that may fold: on a blob flatter than a cell they get better in no other way."""


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
def folds_anew(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    now: Spots,
    then: Spots,
    q: wp.int32,
    shape: wp.array(dtype=wp.float32),
) -> wp.bool:
    """Return whether the moves turn a quad and one across a side, both not slivers, over 90 degrees apart."""
    result = bool(False)
    area = quad_area(corners, then.position, q)
    for c in range(4):
        t = twin[4 * q + c]
        if t >= 0:
            if (
                wp.min(shape[q], shape[t >> 2]) > SLIVER
                and wp.dot(area, quad_area(corners, then.position, t >> 2)) < 0.0
            ):
                if (
                    wp.dot(quad_area(corners, now.position, q), quad_area(corners, now.position, t >> 2))
                    >= 0.0
                ):
                    result = bool(True)
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
) -> wp.bool:
    """Return whether the moves worsen a quad below its vertices' floors or turn one of its corners."""
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
    return is_inverted or (found < shape and (found < least or found <= 0.0))


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
    is_strict: wp.int32,
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
        spoilt = is_spoilt(mesh.corners, now, then, q, shape[q], floor, sense)
        if not spoilt and is_strict == 1:
            spoilt = folds_anew(mesh.corners, mesh.twin, now, then, q, shape)
            spoilt = spoilt or rises(context, mesh.corners, now, then, q)
        if spoilt:
            failing = wp.uint8(1)
            for corner in range(4):
                must_retreat_inout[mesh.corners[4 * q + corner]] = wp.uint8(1)
    failing_out[q] = failing
