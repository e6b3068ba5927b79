"""Place a polygon's vertex by damped steps (`--placement iterative`; Grosso & Zint 2020, section 3.1.2).

From the mean of the polygon's crossings the vertex moves along the gradient of the trilinear interpolant
towards the isosurface (their equation 3). The paper names a damping of 0.25 and five steps; this follows its
authors' code, which has 0.5 and four, stops where a step would leave the cell, and keeps the last point only
if its F is smaller than the mean's. Four halvings leave about a sixteenth of the mean's deviation.
"""

import warp as wp

from dmc_cli.field import (
    CornerValues,
    EdgeSet,
    find_crossings,
    is_in_cell,
    mean_crossing,
    newton_step,
    trilinear_gradient,
    trilinear_value,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

DAMPING = wp.constant(0.5)
STEPS = 4
"""The code's numbers; the paper's are 0.25 and 5."""


@wp.func
def place_at_mean(f: CornerValues, edges: EdgeSet) -> wp.vec4:
    """Return the mean of a polygon's crossings (`--placement centroid`), and 0 as no step fails."""
    mean = mean_crossing(find_crossings(f, edges), edges)
    return wp.vec4(mean[0], mean[1], mean[2], 0.0)


@wp.func
def place_by_steps(f: CornerValues, edges: EdgeSet) -> wp.vec4:
    """Return a polygon's vertex in local coordinates, and 1 if it stayed at the mean off the surface."""
    mean = mean_crossing(find_crossings(f, edges), edges)
    start = wp.abs(trilinear_value(f, mean[0], mean[1], mean[2]))
    p = mean
    is_over = bool(False)
    for _step in range(STEPS):
        if not is_over:
            gradient = trilinear_gradient(f, p)
            following = p - DAMPING * newton_step(trilinear_value(f, p[0], p[1], p[2]), gradient)
            if is_in_cell(following):
                p = following
            else:
                is_over = bool(True)
    stayed = float(0.0)
    if not wp.abs(trilinear_value(f, p[0], p[1], p[2])) < start:
        p = mean
        stayed = wp.where(start > 0.0, 1.0, 0.0)
    return wp.vec4(p[0], p[1], p[2], stayed)
