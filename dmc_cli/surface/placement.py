"""One vertex a polygon, exactly on the trilinear surface (`--placement exact`).

From the mean of the polygon's crossings the trilinear equation is solved along the axis of the largest
gradient component. Where that leaves the polygon's bounding box (about 0.1 % on scans, 1 % on noise) follow
the other axes by falling gradient, then the 7x7 and the 25x25 lattice of lines of Grosso & Zint 2021
(section 3.1.2) on all three axes. What is left takes a *fallback*: an axis solution inside the cell, or the
nearest root on the segments from the mean to the crossings, which always exists. So no vertex is off the
surface; the paper's own last resort, the mean itself, is not needed.
"""

import warp as wp

from dmc_cli.surface.trilinear import CornerValues, trilinear_gradient, trilinear_value

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

COARSE_LATTICE = 7
FINE_LATTICE = 25
"""Lines an axis of the two lattices, the papers' numbers."""

SEGMENT_STEPS = 16
"""Samples that look for the sign change nearest to the mean along a segment."""

BISECTIONS = 30
"""Halvings of a step of a segment: below the resolution of float32."""

NOWHERE = wp.constant(wp.vec3(-1.0, -1.0, -1.0))
"""A point outside every cell: no solution."""


@wp.struct
class EdgeSet:
    """A number for each edge of a cell, by axis, in the order of the cell's faces: low low, high low, ...

    x holds edges 0 2 4 6, y holds 3 1 7 5, z holds 8 9 11 10. As a set of edges: 1 for a member, 0 for the
    others, so that arithmetic takes the place of branches and the compiler can place several vertices
    at once.
    """

    x: wp.vec4
    y: wp.vec4
    z: wp.vec4


@wp.struct
class Polygon:
    """A polygon's edges, the mean of its crossings, and their bounding box."""

    edges: EdgeSet
    mean: wp.vec3
    low: wp.vec3
    high: wp.vec3


@wp.func
def side(f: wp.float32) -> wp.float32:
    """Return 1 for inside, 0 for outside."""
    return wp.where(f >= 0.0, 1.0, 0.0)


@wp.func
def crossed_edges(f: CornerValues) -> EdgeSet:
    """Return the edges of a cell with one end inside."""
    s0 = side(f[0])
    s1 = side(f[1])
    s2 = side(f[2])
    s3 = side(f[3])
    s4 = side(f[4])
    s5 = side(f[5])
    s6 = side(f[6])
    s7 = side(f[7])
    edges = EdgeSet()
    edges.x = wp.vec4(wp.abs(s0 - s1), wp.abs(s2 - s3), wp.abs(s4 - s5), wp.abs(s6 - s7))
    edges.y = wp.vec4(wp.abs(s0 - s2), wp.abs(s1 - s3), wp.abs(s4 - s6), wp.abs(s5 - s7))
    edges.z = wp.vec4(wp.abs(s0 - s4), wp.abs(s1 - s5), wp.abs(s2 - s6), wp.abs(s3 - s7))
    return edges


@wp.func
def member(bits: wp.uint32, edge: wp.int32) -> wp.float32:
    """Return 1 if a bit is set, else 0."""
    return wp.float32((bits >> wp.uint32(edge)) & wp.uint32(1))


@wp.func
def edge_set(bits: wp.uint32) -> EdgeSet:
    """Return a set of edges given as a bit each."""
    edges = EdgeSet()
    edges.x = wp.vec4(member(bits, 0), member(bits, 2), member(bits, 4), member(bits, 6))
    edges.y = wp.vec4(member(bits, 3), member(bits, 1), member(bits, 7), member(bits, 5))
    edges.z = wp.vec4(member(bits, 8), member(bits, 9), member(bits, 11), member(bits, 10))
    return edges


@wp.func
def crossing(a: wp.float32, b: wp.float32, is_crossed: wp.float32) -> wp.float32:
    """Return where F crosses zero between a (at 0) and b (at 1), or 0."""
    return wp.where(is_crossed > 0.5, a / (a - b), 0.0)


@wp.func
def find_crossings(f: CornerValues, e: EdgeSet) -> EdgeSet:
    """Return where F crosses zero along each edge of a set, in [0, 1]; 0 for the others."""
    c = EdgeSet()
    c.x = wp.vec4(
        crossing(f[0], f[1], e.x[0]),
        crossing(f[2], f[3], e.x[1]),
        crossing(f[4], f[5], e.x[2]),
        crossing(f[6], f[7], e.x[3]),
    )
    c.y = wp.vec4(
        crossing(f[0], f[2], e.y[0]),
        crossing(f[1], f[3], e.y[1]),
        crossing(f[4], f[6], e.y[2]),
        crossing(f[5], f[7], e.y[3]),
    )
    c.z = wp.vec4(
        crossing(f[0], f[4], e.z[0]),
        crossing(f[1], f[5], e.z[1]),
        crossing(f[2], f[6], e.z[2]),
        crossing(f[3], f[7], e.z[3]),
    )
    return c


@wp.func
def sum4(v: wp.vec4) -> wp.float32:
    """Return the sum of four numbers, in a fixed order."""
    return (v[0] + v[1]) + (v[2] + v[3])


@wp.func
def edges_at_0(e: EdgeSet) -> wp.vec3:
    """Return how many edges of a set lie in the faces x = 0, y = 0 and z = 0."""
    return wp.vec3(
        (e.y[0] + e.y[2]) + (e.z[0] + e.z[2]),
        (e.x[0] + e.x[2]) + (e.z[0] + e.z[1]),
        (e.x[0] + e.x[1]) + (e.y[0] + e.y[1]),
    )


@wp.func
def edges_at_1(e: EdgeSet) -> wp.vec3:
    """Return how many edges of a set lie in the faces x = 1, y = 1 and z = 1."""
    return wp.vec3(
        (e.y[1] + e.y[3]) + (e.z[1] + e.z[3]),
        (e.x[1] + e.x[3]) + (e.z[2] + e.z[3]),
        (e.x[2] + e.x[3]) + (e.y[2] + e.y[3]),
    )


@wp.func
def mean_crossing(c: EdgeSet, e: EdgeSet) -> wp.vec3:
    """Return the mean of the crossings c of a set of edges e."""
    at_1 = edges_at_1(e)
    scale = 1.0 / (sum4(e.x) + sum4(e.y) + sum4(e.z))
    return wp.vec3(
        scale * (sum4(c.x) + at_1[0]),
        scale * (sum4(c.y) + at_1[1]),
        scale * (sum4(c.z) + at_1[2]),
    )


@wp.func
def high_end(c: wp.vec4, at_1: wp.float32) -> wp.float32:
    """Return the largest coordinate of the crossings along an axis c, and of `at_1` edges at 1."""
    return wp.where(at_1 > 0.5, 1.0, wp.max(wp.max(c[0], c[1]), wp.max(c[2], c[3])))


@wp.func
def low_end(c: wp.vec4, e: wp.vec4, at_0: wp.float32) -> wp.float32:
    """Return the least coordinate of the crossings c along the edges e, and of `at_0` edges at 0."""
    a = wp.where(e[0] > 0.5, c[0], 1.0)
    b = wp.where(e[1] > 0.5, c[1], 1.0)
    d = wp.where(e[2] > 0.5, c[2], 1.0)
    g = wp.where(e[3] > 0.5, c[3], 1.0)
    return wp.where(at_0 > 0.5, 0.0, wp.min(wp.min(a, b), wp.min(d, g)))


@wp.func
def measure_polygon(f: CornerValues, e: EdgeSet) -> Polygon:
    """Return the mean and the bounding box of a polygon's crossings."""
    c = find_crossings(f, e)
    at_0 = edges_at_0(e)
    at_1 = edges_at_1(e)
    polygon = Polygon()
    polygon.edges = e
    polygon.mean = mean_crossing(c, e)
    polygon.high = wp.vec3(high_end(c.x, at_1[0]), high_end(c.y, at_1[1]), high_end(c.z, at_1[2]))
    polygon.low = wp.vec3(low_end(c.x, e.x, at_0[0]), low_end(c.y, e.y, at_0[1]), low_end(c.z, e.z, at_0[2]))
    return polygon


@wp.func
def chosen(is_y: wp.bool, is_z: wp.bool, x: wp.float32, y: wp.float32, z: wp.float32) -> wp.float32:
    """Return x, y or z."""
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
def solve_along(f: CornerValues, p: wp.vec3, axis: wp.int32) -> wp.vec3:
    """Return the point of the surface on the line through p along an axis, or NOWHERE."""
    slope = trilinear_gradient(f, p)[axis]
    solution = NOWHERE
    if slope != 0.0:
        solution = p
        solution[axis] = p[axis] - trilinear_value(f, p[0], p[1], p[2]) / slope
    return solution


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
def member_along(e: EdgeSet, axis: wp.int32, n: wp.int32) -> wp.float32:
    """Return the number of the n-th edge along an axis."""
    return wp.where(axis == 0, e.x[n], wp.where(axis == 1, e.y[n], e.z[n]))


@wp.func
def crossing_point(c: EdgeSet, axis: wp.int32, n: wp.int32) -> wp.vec3:
    """Return the point of the n-th edge along an axis at its crossing in c."""
    low = wp.float32(n & 1)
    high = wp.float32(n >> 1)
    p = wp.vec3(c.x[n], low, high)
    if axis == 1:
        p = wp.vec3(low, c.y[n], high)
    elif axis == 2:
        p = wp.vec3(low, high, c.z[n])
    return p


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
