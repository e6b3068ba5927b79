"""Decide how the surface crosses an ambiguous face of a cell.

An ambiguous face is decided by the asymptotic decider in its product form: the inside corners are joined if
the product of their distances to the isovalue is at least that of the outside corners' (in double precision;
equivalent to the sign of the face's saddle value, but without its quotient). The decision does not depend on
the order of the corners, so both cells of the face agree.
"""

import warp as wp

from dmc_cli.contouring.stages.tracing import FACE_CORNERS
from dmc_cli.field import CornerValues64

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

LEAST_FACTOR, LIFT = wp.constant(wp.float64(2.0**-500)), wp.constant(wp.float64(2.0**600))
LARGEST_FACTOR, SINK = wp.constant(wp.float64(2.0**500)), wp.constant(wp.float64(2.0**-600))
"""Distances beyond which products are made of scaled ones; powers of two cost no digit."""


@wp.func
def are_inside_joined(f: CornerValues64, case: wp.int32, face: wp.int32) -> wp.bool:
    """Return whether the asymptotic decider joins the inside corners of an ambiguous face.

    Where float64 could not hold the products, all four values are scaled, alike in both cells of the face.
    """
    a = f[FACE_CORNERS[4 * face]]
    b = f[FACE_CORNERS[4 * face + 1]]
    c = f[FACE_CORNERS[4 * face + 2]]
    d = f[FACE_CORNERS[4 * face + 3]]
    largest = wp.max(wp.max(wp.abs(a), wp.abs(b)), wp.max(wp.abs(c), wp.abs(d)))
    scale = wp.where(largest < LEAST_FACTOR, LIFT, wp.where(largest > LARGEST_FACTOR, SINK, wp.float64(1.0)))
    first = (scale * a) * (scale * d)
    second = (scale * b) * (scale * c)
    is_first_inside = ((case >> FACE_CORNERS[4 * face]) & 1) == 1
    return wp.where(is_first_inside, first >= second, second >= first)
