"""Find quads of a label net that fold or nearly do, and take back the moves that made them so.

The measure is the scaled Jacobian in the world's lengths: the least, over a quad's corners, of the sine of
the corner's angle, negative where the corner faces away from the quad's own normal.
"""

import warp as wp

from dmc_cli.contouring.label_surfaces.links import Links
from dmc_cli.contouring.label_surfaces.swept_volumes import Corners, quad_corners

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def scaled_jacobian(p: Corners) -> wp.float32:
    """Return the least scaled Jacobian over a quad's corners; 0 where it has no area, or a side no length."""
    normal = wp.normalize(wp.cross(p[2] - p[0], p[3] - p[1]))
    least = float(1.0)
    for corner in range(4):
        u = wp.normalize(p[(corner + 1) & 3] - p[corner])
        v = wp.normalize(p[(corner + 3) & 3] - p[corner])
        least = wp.min(least, wp.dot(wp.cross(u, v), normal))
    return least


@wp.kernel
def flag_folds_kernel(
    # In:
    first: wp.int32,
    faces: wp.array(dtype=wp.vec4i),
    frames: wp.array(dtype=wp.uint8),
    local: wp.array(dtype=wp.vec3),
    spacing: wp.vec3,
    least: wp.float32,
    # Out:
    flags_out: wp.array(dtype=wp.uint8),
) -> None:
    """Flag a quad whose scaled Jacobian is below the least one allowed. One thread per quad."""
    q = first + wp.tid()
    p = quad_corners(local, faces[q], wp.int32(frames[q]))
    for corner in range(4):
        p[corner] = wp.cw_mul(p[corner], spacing)
    flags_out[q] = wp.where(scaled_jacobian(p) < least, wp.uint8(1), wp.uint8(0))


@wp.func
def is_flagged(links: Links, flags: wp.array(dtype=wp.uint8), v: wp.int32) -> wp.bool:
    """Return whether a quad of a vertex is flagged."""
    flagged = bool(False)
    for slot in range(links.quad_start[v], links.quad_start[v + 1]):
        if flags[links.quads[slot]] != wp.uint8(0):
            flagged = True
    return flagged


@wp.kernel
def retreat_kernel(
    # In:
    first: wp.int32,
    links: Links,
    flags: wp.array(dtype=wp.uint8),
    refuge: wp.array(dtype=wp.vec3),
    share: wp.float32,
    # In/out:
    local_inout: wp.array(dtype=wp.vec3),
) -> None:
    """Move the vertices of flagged quads a share of the way to a safe place. One thread per vertex."""
    v = first + wp.tid()
    if is_flagged(links, flags, v):
        p = local_inout[v]
        local_inout[v] = p + share * (refuge[v] - p)
