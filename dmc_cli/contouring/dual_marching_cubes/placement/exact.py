"""Place a polygon's vertex exactly on the trilinear surface (`--placement exact`).

From the mean of the polygon's crossings the trilinear equation is solved along the axis of the largest
gradient component. Where that leaves the polygon's bounding box (about 0.1 % on scans, 1 % on noise) follow
the other axes by falling gradient, then the 7x7 and the 25x25 lattice of lines of Grosso & Zint 2021
(section 3.1.2) on all three axes. What is left takes a *fallback*: an axis solution inside the cell, or the
nearest root on the segments from the mean to the crossings, which always exists. So no vertex is off the
surface; the paper's own last resort, the mean itself, is not needed.
"""

import warp as wp

from dmc_cli.field import (
    NOWHERE,
    CornerValues,
    EdgeSet,
    Polygon,
    crossing_point,
    edges_at_0,
    edges_at_1,
    find_crossings,
    high_end,
    low_end,
    mean_crossing,
    measure_polygon,
    member_along,
    solve_along,
    trilinear_gradient,
    trilinear_value,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

COARSE_LATTICE = 7
FINE_LATTICE = 25
"""Lines an axis of the two lattices, the papers' numbers."""

SEGMENT_STEPS = 16
"""Samples that look for the sign change nearest to the mean along a segment."""

BISECTIONS = 30
"""Halvings of a step of a segment: below the resolution of float32."""

LOST = wp.constant(255)
"""The entry, among counts of fallbacks, of a vertex outside its cell: there are none, but we look."""


@wp.func
def chosen(is_y: wp.bool, is_z: wp.bool, x: wp.float32, y: wp.float32, z: wp.float32) -> wp.float32:
    """Return the coordinate along an axis: x, y or z."""
    return wp.where(is_z, z, wp.where(is_y, y, x))


@wp.func
def solve_on_steepest_axis(f: CornerValues, e: EdgeSet) -> wp.vec3:
    """Solve from the mean along the axis of the largest gradient component: a point in the box, or NOWHERE.

    Nearly all vertices end here. There is no branch and no index that varies, and of the box only what the
    axis needs, so that the compiler can turn a loop over cells into vector instructions.
    """
    c = find_crossings(f, e)
    mean = mean_crossing(c, e)
    gradient = trilinear_gradient(f, mean)
    x = wp.abs(gradient[0])
    y = wp.abs(gradient[1])
    z = wp.abs(gradient[2])
    is_z = z > wp.max(x, y)
    is_y = y > x
    slope = chosen(is_y, is_z, gradient[0], gradient[1], gradient[2])
    start = chosen(is_y, is_z, mean[0], mean[1], mean[2])
    root = start - trilinear_value(f, mean[0], mean[1], mean[2]) / slope

    at_0 = edges_at_0(e)
    at_1 = edges_at_1(e)
    along = wp.vec4(
        chosen(is_y, is_z, c.x[0], c.y[0], c.z[0]),
        chosen(is_y, is_z, c.x[1], c.y[1], c.z[1]),
        chosen(is_y, is_z, c.x[2], c.y[2], c.z[2]),
        chosen(is_y, is_z, c.x[3], c.y[3], c.z[3]),
    )
    edges = wp.vec4(
        chosen(is_y, is_z, e.x[0], e.y[0], e.z[0]),
        chosen(is_y, is_z, e.x[1], e.y[1], e.z[1]),
        chosen(is_y, is_z, e.x[2], e.y[2], e.z[2]),
        chosen(is_y, is_z, e.x[3], e.y[3], e.z[3]),
    )
    some_at_0 = chosen(is_y, is_z, at_0[0], at_0[1], at_0[2])
    some_at_1 = chosen(is_y, is_z, at_1[0], at_1[1], at_1[2])
    low = low_end(along, edges, some_at_0)
    high = high_end(along, some_at_1)
    u = wp.where(is_z, mean[0], wp.where(is_y, mean[0], root))
    v = wp.where(is_z, mean[1], wp.where(is_y, root, mean[1]))
    w = wp.where(is_z, root, mean[2])
    # a NaN is in no box
    return wp.vec3(wp.where(root >= low, wp.where(root <= high, u, -1.0), -1.0), v, w)


@wp.func
def solve_in_box(f: CornerValues, polygon: Polygon, low: wp.vec3, high: wp.vec3) -> wp.vec3:
    """Solve from the mean along each axis by falling gradient until a solution lies in a box."""
    gradient = trilinear_gradient(f, polygon.mean)
    steepness = wp.vec3(wp.abs(gradient[0]), wp.abs(gradient[1]), wp.abs(gradient[2]))
    found = NOWHERE
    for _attempt in range(3):
        if found[0] < 0.0:
            axis = int(0)
            if steepness[1] > steepness[axis]:
                axis = 1
            if steepness[2] > steepness[axis]:
                axis = 2
            steepness[axis] = -1.0
            solution = solve_along(f, polygon.mean, axis)
            if solution[axis] >= low[axis] and solution[axis] <= high[axis]:
                found = solution
    return found


@wp.func
def nearest_on_lattice(
    f: CornerValues, polygon: Polygon, axis: wp.int32, outer: wp.int32, inner: wp.int32, lines: wp.int32
) -> wp.vec3:
    """Return the first of the solutions nearest to the mean on lines x lines along an axis, or NOWHERE.

    The lines are those inside the polygon's box; `inner` is the axis that runs faster.
    """
    found = NOWHERE
    nearest = float(1.0e30)
    step = (polygon.high - polygon.low) / wp.float32(lines + 1)
    for a in range(lines):
        for b in range(lines):
            p = polygon.mean
            p[outer] = polygon.low[outer] + wp.float32(a + 1) * step[outer]
            p[inner] = polygon.low[inner] + wp.float32(b + 1) * step[inner]
            solution = solve_along(f, p, axis)
            if solution[axis] >= polygon.low[axis] and solution[axis] <= polygon.high[axis]:
                distance = wp.length_sq(solution - polygon.mean)
                if distance < nearest:
                    nearest = distance
                    found = solution
    return found


@wp.func
def solve_on_lattice(f: CornerValues, polygon: Polygon, lines: wp.int32) -> wp.vec3:
    """Return the solution nearest to the mean on a lattice of lines through the box, along all axes."""
    found = NOWHERE
    nearest = float(1.0e30)
    for axis in range(3):
        solution = nearest_on_lattice(f, polygon, axis, (axis + 1) % 3, (axis + 2) % 3, lines)
        distance = wp.length_sq(solution - polygon.mean)
        if solution[0] >= 0.0 and distance < nearest:
            nearest = distance
            found = solution
    return found


@wp.func
def root_on_segment(f: CornerValues, start: wp.vec3, end: wp.vec3) -> wp.vec3:
    """Return the root nearest to `start` on the segment to `end`, which is a root itself."""
    sign = trilinear_value(f, start[0], start[1], start[2]) >= 0.0
    low = float(0.0)
    high = float(1.0)
    found = bool(False)
    for step in range(1, SEGMENT_STEPS):
        t = wp.float32(step) / wp.float32(SEGMENT_STEPS)
        p = start + t * (end - start)
        if not found:
            if (trilinear_value(f, p[0], p[1], p[2]) >= 0.0) != sign:
                high = t
                found = bool(True)
            else:
                low = t
    root = end
    if found:
        for _halving in range(BISECTIONS):
            t = 0.5 * (low + high)
            p = start + t * (end - start)
            if (trilinear_value(f, p[0], p[1], p[2]) >= 0.0) == sign:
                low = t
            else:
                high = t
        root = start + 0.5 * (low + high) * (end - start)
    return root


@wp.func
def fall_back(f: CornerValues, polygon: Polygon) -> wp.vec3:
    """Return a point of the surface in the cell: along an axis, else towards a crossing of the polygon."""
    found = solve_in_box(f, polygon, wp.vec3(0.0, 0.0, 0.0), wp.vec3(1.0, 1.0, 1.0))
    if found[0] < 0.0:
        nearest = float(1.0e30)
        c = find_crossings(f, polygon.edges)
        for edge in range(12):
            axis = edge / 4
            n = edge % 4
            if member_along(polygon.edges, axis, n) > 0.5:
                root = root_on_segment(f, polygon.mean, crossing_point(c, axis, n))
                distance = wp.length_sq(root - polygon.mean)
                if distance < nearest:
                    nearest = distance
                    found = root
    return found


@wp.func
def place_with_care(f: CornerValues, edges: EdgeSet) -> wp.vec4:
    """Place a vertex that the steepest axis does not: as `place_vertex`, from its second attempt on."""
    polygon = measure_polygon(f, edges)
    p = solve_in_box(f, polygon, polygon.low, polygon.high)
    fallback = float(0.0)
    if p[0] < 0.0:
        p = solve_on_lattice(f, polygon, COARSE_LATTICE)
    if p[0] < 0.0:
        p = solve_on_lattice(f, polygon, FINE_LATTICE)
    if p[0] < 0.0:
        p = fall_back(f, polygon)
        fallback = 1.0
    return wp.vec4(p[0], p[1], p[2], fallback)


@wp.func
def place_vertex(f: CornerValues, edges: EdgeSet) -> wp.vec4:
    """Return the local coordinates of a polygon's vertex, and 1 if it took a fallback, else 0."""
    p = solve_on_steepest_axis(f, edges)
    result = wp.vec4(p[0], p[1], p[2], 0.0)
    if p[0] < 0.0:
        result = place_with_care(f, edges)
    return result
