"""Compute the volumes that quads sweep as their corners move, and hand them to the vertices.

A quad is the bilinear patch between its corners; each corner moves along a straight line. At any time the
patch sweeps the integral of velocity times normal. Both are linear in each parameter, the normal without a
mixed term, so that integrals of the bilinear shape functions give it exactly; over time it is a polynomial of
degree two, which two points of Gauss give exactly. Lengths are in steps of the grid, and places relative to
the lower node of the quad's edge, so that single precision serves.
"""

import math

import warp as wp

from dmc_cli.contouring.label_surfaces.links import REGULAR, Links

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

GAUSS = wp.constant(0.5 / math.sqrt(3.0))
"""The distance of the two points of Gauss from the middle of a unit interval."""

Corners = wp.types.matrix(shape=(4, 3), dtype=wp.float32)
"""The corners of a quad, in order."""


@wp.func
def quad_corners(local: wp.array(dtype=wp.vec3), face: wp.vec4i, frame: wp.int32) -> Corners:
    """Return the corners of a quad relative to the lower node of its edge.

    The cells round an edge have it at places 3, 2, 0, 1 in the order of the corners, backwards from the third
    on where the quad looks down the axis.
    """
    axis = frame & 3
    corners = Corners()
    for corner in range(4):
        turned = wp.where(frame >= 4, (4 - corner) & 3, corner)
        at = (turned ^ (turned >> 1)) ^ 3
        u = float(at & 1)
        v = float(at >> 1)
        back = wp.where(
            axis == 0, wp.vec3(0.0, u, v), wp.where(axis == 1, wp.vec3(v, 0.0, u), wp.vec3(u, v, 0.0))
        )
        corners[corner] = local[face[corner]] - back
    return corners


@wp.func
def sweep_rate(p: Corners, d: Corners) -> wp.float32:
    """Return the volume a time that a patch with corners p sweeps where they move by d a time."""
    u = p[1] - p[0]
    v = p[3] - p[0]
    twist = p[2] - p[1] - v
    normal = wp.cross(u, v)
    along_u = wp.cross(u, twist)
    along_v = wp.cross(twist, v)
    rate = wp.dot(d[0] + d[1] + d[2] + d[3], normal * 3.0)
    rate += wp.dot(d[0] + 2.0 * d[1] + 2.0 * d[2] + d[3], along_u)
    rate += wp.dot(d[0] + d[1] + 2.0 * d[2] + 2.0 * d[3], along_v)
    return rate / 12.0


@wp.func
def swept_volume(p: Corners, q: Corners) -> wp.float32:
    """Return the volume that a patch sweeps as its corners move from p to q, positive along its normal."""
    d = q - p
    early = sweep_rate(p + (0.5 - GAUSS) * d, d)
    return 0.5 * (early + sweep_rate(p + (0.5 + GAUSS) * d, d))


@wp.kernel
def sweep_kernel(
    # In:
    first: wp.int32,
    faces: wp.array(dtype=wp.vec4i),
    frames: wp.array(dtype=wp.uint8),
    kind: wp.array(dtype=wp.uint8),
    before: wp.array(dtype=wp.vec3),
    after: wp.array(dtype=wp.vec3),
    # In/out:
    lost_inout: wp.array(dtype=wp.float32),
    # Out:
    swept_out: wp.array(dtype=wp.vec4),
) -> None:
    """Find a quad's vector of area after a move, and the share that each regular corner has of what it swept.

    What a quad without a regular corner swept is added to what is lost. One thread per quad.
    """
    q = first + wp.tid()
    face = faces[q]
    regular = int(0)
    for corner in range(4):
        regular += wp.where(wp.int32(kind[face[corner]]) == REGULAR, 1, 0)
    frame = wp.int32(frames[q])
    p = quad_corners(after, face, frame)
    share = swept_volume(quad_corners(before, face, frame), p) / float(wp.max(regular, 1))
    if regular == 0:
        lost_inout[q] = lost_inout[q] + share
        share = 0.0
    area = 0.5 * wp.cross(p[2] - p[0], p[3] - p[1])
    swept_out[q] = wp.vec4(area[0], area[1], area[2], share)


@wp.kernel
def owe_kernel(
    # In:
    first: wp.int32,
    links: Links,
    swept: wp.array(dtype=wp.vec4),
    part: wp.array(dtype=wp.float32),
    # In/out:
    parts_inout: wp.array(dtype=wp.vec2),
    # Out:
    normal_out: wp.array(dtype=wp.vec3),
) -> None:
    """Add what its quads swept to what a regular vertex owes, and find its vector of area and the area.

    What it owes and its area are kept times the part of the vertex (`find_parts_kernel`). One thread per
    vertex.
    """
    v = first + wp.tid()
    total = wp.vec4()
    if part[v] > 0.0:
        for slot in range(links.quad_start[v], links.quad_start[v + 1]):
            total += swept[links.quads[slot]]
    normal = 0.25 * wp.vec3(total[0], total[1], total[2])
    parts_inout[v] = wp.vec2(parts_inout[v][0] + part[v] * total[3], part[v] * wp.length(normal))
    normal_out[v] = normal
