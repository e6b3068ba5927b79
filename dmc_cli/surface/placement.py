"""One vertex a polygon, exactly on the trilinear surface (`--placement exact`).

From the mean of the polygon's crossings the trilinear equation is solved along the axis of the largest
gradient component. Where that leaves the polygon's bounding box (about 0.1 % on scans, 1 % on noise) follow
the other axes by falling gradient, then the 7x7 and the 25x25 lattice of lines of Grosso & Zint 2021
(section 3.1.2) on all three axes. What is left takes a *fallback*: an axis solution inside the cell, or the
nearest root on the segments from the mean to the crossings, which always exists. So no vertex is off the
surface; the paper's own last resort, the mean itself, is not needed.
"""

from typing import Any

import warp as wp

from dmc_cli.surface.grid import has_bit
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
class Polygon:
    """A polygon's edges (a bit each), the mean of its crossings, and their bounding box."""

    edges: wp.uint32
    mean: wp.vec3
    low: wp.vec3
    high: wp.vec3


@wp.func
def crossed_edges(f: CornerValues) -> wp.uint32:
    """Return a bit for each edge of a cell: whether it is crossed."""
    bits = wp.uint32(0)
    i0 = f[0] >= 0.0
    i1 = f[1] >= 0.0
    i2 = f[2] >= 0.0
    i3 = f[3] >= 0.0
    i4 = f[4] >= 0.0
    i5 = f[5] >= 0.0
    i6 = f[6] >= 0.0
    i7 = f[7] >= 0.0
    bits |= wp.where(i0 != i1, wp.uint32(1), wp.uint32(0))
    bits |= wp.where(i1 != i3, wp.uint32(2), wp.uint32(0))
    bits |= wp.where(i2 != i3, wp.uint32(4), wp.uint32(0))
    bits |= wp.where(i0 != i2, wp.uint32(8), wp.uint32(0))
    bits |= wp.where(i4 != i5, wp.uint32(16), wp.uint32(0))
    bits |= wp.where(i5 != i7, wp.uint32(32), wp.uint32(0))
    bits |= wp.where(i6 != i7, wp.uint32(64), wp.uint32(0))
    bits |= wp.where(i4 != i6, wp.uint32(128), wp.uint32(0))
    bits |= wp.where(i0 != i4, wp.uint32(256), wp.uint32(0))
    bits |= wp.where(i1 != i5, wp.uint32(512), wp.uint32(0))
    bits |= wp.where(i3 != i7, wp.uint32(1024), wp.uint32(0))
    bits |= wp.where(i2 != i6, wp.uint32(2048), wp.uint32(0))
    return bits


@wp.func
def crossing(a: wp.float32, b: wp.float32, edges: wp.uint32, edge: wp.int32, other: wp.float32) -> wp.float32:
    """Return where F crosses zero between a (at 0) and b (at 1) if the polygon has `edge`, else `other`."""
    return wp.where(has_bit(edges, edge), a / (a - b), other)


@wp.func
def sum4(a: wp.float32, b: wp.float32, c: wp.float32, d: wp.float32) -> wp.float32:
    """Return the sum of four numbers, in a fixed order."""
    return (a + b) + (c + d)


@wp.func
def count_bits(edges: wp.uint32, mask: wp.uint32) -> wp.float32:
    """Return how many edges of `mask` there are."""
    return wp.float32(wp.bit_count(edges & mask))


@wp.func
def low_end(a: wp.float32, b: wp.float32, c: wp.float32, d: wp.float32, edges: wp.uint32, at_0: wp.uint32, at_1: wp.uint32) -> wp.float32:
    """Return the least coordinate of crossings at a b c d (2 if none), at 0 and at 1."""
    least = wp.min(wp.min(a, b), wp.min(c, d))
    least = wp.where((edges & at_1) != wp.uint32(0), wp.min(least, 1.0), least)
    return wp.where((edges & at_0) != wp.uint32(0), 0.0, least)


@wp.func
def high_end(a: wp.float32, b: wp.float32, c: wp.float32, d: wp.float32, edges: wp.uint32, at_0: wp.uint32, at_1: wp.uint32) -> wp.float32:
    """Return the largest coordinate of crossings at a b c d (0 if none), at 0 and at 1."""
    return wp.where((edges & at_1) != wp.uint32(0), 1.0, wp.max(wp.max(a, b), wp.max(c, d)))


EDGES_X0 = wp.uint32(0b1001_1000_1000)
EDGES_X1 = wp.uint32(0b0110_0010_0010)
EDGES_Y0 = wp.uint32(0b0011_0001_0001)
EDGES_Y1 = wp.uint32(0b1100_0100_0100)
EDGES_Z0 = wp.uint32(0b0000_0000_1111)
EDGES_Z1 = wp.uint32(0b0000_1111_0000)
"""The edges that lie in a face of the cell: a bit each."""


@wp.func
def measure_polygon(f: CornerValues, edges: wp.uint32) -> Polygon:
    """Return the mean and the bounding box of a polygon's crossings."""
    x0 = crossing(f[0], f[1], edges, 0, 0.0)
    x2 = crossing(f[2], f[3], edges, 2, 0.0)
    x4 = crossing(f[4], f[5], edges, 4, 0.0)
    x6 = crossing(f[6], f[7], edges, 6, 0.0)
    y1 = crossing(f[1], f[3], edges, 1, 0.0)
    y3 = crossing(f[0], f[2], edges, 3, 0.0)
    y5 = crossing(f[5], f[7], edges, 5, 0.0)
    y7 = crossing(f[4], f[6], edges, 7, 0.0)
    z8 = crossing(f[0], f[4], edges, 8, 0.0)
    z9 = crossing(f[1], f[5], edges, 9, 0.0)
    z10 = crossing(f[3], f[7], edges, 10, 0.0)
    z11 = crossing(f[2], f[6], edges, 11, 0.0)
    scale = 1.0 / wp.float32(wp.bit_count(edges))
    polygon = Polygon()
    polygon.edges = edges
    polygon.mean = wp.vec3(
        scale * (sum4(x0, x2, x4, x6) + count_bits(edges, EDGES_X1)),
        scale * (sum4(y1, y3, y5, y7) + count_bits(edges, EDGES_Y1)),
        scale * (sum4(z8, z9, z10, z11) + count_bits(edges, EDGES_Z1)),
    )
    polygon.high = wp.vec3(
        high_end(x0, x2, x4, x6, edges, EDGES_X0, EDGES_X1),
        high_end(y1, y3, y5, y7, edges, EDGES_Y0, EDGES_Y1),
        high_end(z8, z9, z10, z11, edges, EDGES_Z0, EDGES_Z1),
    )
    x0 = wp.where(has_bit(edges, 0), x0, 2.0)
    x2 = wp.where(has_bit(edges, 2), x2, 2.0)
    x4 = wp.where(has_bit(edges, 4), x4, 2.0)
    x6 = wp.where(has_bit(edges, 6), x6, 2.0)
    y1 = wp.where(has_bit(edges, 1), y1, 2.0)
    y3 = wp.where(has_bit(edges, 3), y3, 2.0)
    y5 = wp.where(has_bit(edges, 5), y5, 2.0)
    y7 = wp.where(has_bit(edges, 7), y7, 2.0)
    z8 = wp.where(has_bit(edges, 8), z8, 2.0)
    z9 = wp.where(has_bit(edges, 9), z9, 2.0)
    z10 = wp.where(has_bit(edges, 10), z10, 2.0)
    z11 = wp.where(has_bit(edges, 11), z11, 2.0)
    polygon.low = wp.vec3(
        low_end(x0, x2, x4, x6, edges, EDGES_X0, EDGES_X1),
        low_end(y1, y3, y5, y7, edges, EDGES_Y0, EDGES_Y1),
        low_end(z8, z9, z10, z11, edges, EDGES_Z0, EDGES_Z1),
    )
    return polygon


@wp.func
def is_within(p: wp.vec3, low: wp.vec3, high: wp.vec3) -> wp.bool:
    """Return whether p lies in a box; a NaN does not."""
    return (
        p[0] >= low[0] and p[0] <= high[0] and p[1] >= low[1] and p[1] <= high[1] and p[2] >= low[2] and p[2] <= high[2]
    )


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
def solve_on_steepest_axis(f: CornerValues, polygon: Polygon) -> wp.vec3:
    """Solve from the mean along the axis of the largest gradient component: a point in the box, or NOWHERE.

    Nearly all vertices end here, so this is written without a branch and without an index that varies.
    """
    mean = polygon.mean
    gradient = trilinear_gradient(f, mean)
    x = wp.abs(gradient[0])
    y = wp.abs(gradient[1])
    z = wp.abs(gradient[2])
    along_z = z > x and z > y
    along_y = y > x and not along_z
    slope = wp.where(along_z, gradient[2], wp.where(along_y, gradient[1], gradient[0]))
    start = wp.where(along_z, mean[2], wp.where(along_y, mean[1], mean[0]))
    low = wp.where(along_z, polygon.low[2], wp.where(along_y, polygon.low[1], polygon.low[0]))
    high = wp.where(along_z, polygon.high[2], wp.where(along_y, polygon.high[1], polygon.high[0]))
    root = start - trilinear_value(f, mean[0], mean[1], mean[2]) / slope
    along_x = not along_y and not along_z
    solution = wp.vec3(
        wp.where(along_x, root, mean[0]), wp.where(along_y, root, mean[1]), wp.where(along_z, root, mean[2])
    )
    if not (root >= low and root <= high):  # not so for a NaN either
        solution = NOWHERE
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
def solve_on_lattice(f: CornerValues, polygon: Polygon, lines: wp.int32) -> wp.vec3:
    """Return the solution nearest to the mean on a lattice of lines through the box, along all axes."""
    found = NOWHERE
    nearest = float(1.0e30)
    step = (polygon.high - polygon.low) / wp.float32(lines + 1)
    for axis in range(3):
        first = (axis + 1) % 3
        second = (axis + 2) % 3
        for a in range(lines):
            for b in range(lines):
                p = polygon.mean
                p[first] = polygon.low[first] + wp.float32(a + 1) * step[first]
                p[second] = polygon.low[second] + wp.float32(b + 1) * step[second]
                solution = solve_along(f, p, axis)
                if is_within(solution, polygon.low, polygon.high):
                    distance = wp.length_sq(solution - polygon.mean)
                    if distance < nearest:
                        nearest = distance
                        found = solution
    return found


@wp.func
def crossing_point(f: CornerValues, edge: wp.int32) -> wp.vec3:
    """Return the crossing of a crossed edge."""
    p = wp.vec3(0.0, 0.0, 0.0)
    if edge == 0:
        p = wp.vec3(f[0] / (f[0] - f[1]), 0.0, 0.0)
    elif edge == 1:
        p = wp.vec3(1.0, f[1] / (f[1] - f[3]), 0.0)
    elif edge == 2:
        p = wp.vec3(f[2] / (f[2] - f[3]), 1.0, 0.0)
    elif edge == 3:
        p = wp.vec3(0.0, f[0] / (f[0] - f[2]), 0.0)
    elif edge == 4:
        p = wp.vec3(f[4] / (f[4] - f[5]), 0.0, 1.0)
    elif edge == 5:
        p = wp.vec3(1.0, f[5] / (f[5] - f[7]), 1.0)
    elif edge == 6:
        p = wp.vec3(f[6] / (f[6] - f[7]), 1.0, 1.0)
    elif edge == 7:
        p = wp.vec3(0.0, f[4] / (f[4] - f[6]), 1.0)
    elif edge == 8:
        p = wp.vec3(0.0, 0.0, f[0] / (f[0] - f[4]))
    elif edge == 9:
        p = wp.vec3(1.0, 0.0, f[1] / (f[1] - f[5]))
    elif edge == 10:
        p = wp.vec3(1.0, 1.0, f[3] / (f[3] - f[7]))
    else:
        p = wp.vec3(0.0, 1.0, f[2] / (f[2] - f[6]))
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
        for edge in range(12):
            if has_bit(polygon.edges, edge):
                root = root_on_segment(f, polygon.mean, crossing_point(f, edge))
                distance = wp.length_sq(root - polygon.mean)
                if distance < nearest:
                    nearest = distance
                    found = root
    return found


@wp.func
def place_with_care(f: CornerValues, polygon: Polygon) -> wp.vec4:
    """Place a vertex that the steepest axis does not: as `place_vertex`, from its second attempt on."""
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
def place_vertex(f: CornerValues, edges: wp.uint32) -> wp.vec4:
    """Return the local coordinates of a polygon's vertex, and 1 if it took a fallback, else 0."""
    polygon = measure_polygon(f, edges)
    p = solve_on_steepest_axis(f, polygon)
    result = wp.vec4(p[0], p[1], p[2], 0.0)
    if p[0] < 0.0:
        result = place_with_care(f, polygon)
    return result
