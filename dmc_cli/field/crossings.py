"""Find a polygon's crossings: where F is zero on the edges of its cell, their mean and bounding box."""

import warp as wp

from dmc_cli.field.trilinear import CornerValues


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


ALL_EDGES = wp.constant(4095)
"""A bit for each edge of a cell."""


@wp.struct
class Polygon:
    """A polygon's edges, the mean of its crossings, and their bounding box."""

    edges: EdgeSet
    mean: wp.vec3
    low: wp.vec3
    high: wp.vec3


@wp.func
def side(f: wp.float32) -> wp.float32:
    """Return 1 if F is inside, 0 or above, else 0."""
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
def among(e: wp.float32, bits: wp.uint32, edge: wp.int32) -> wp.float32:
    """Return an edge's number in a set, or 0 if its bit is not set."""
    return wp.where((bits & (wp.uint32(1) << wp.uint32(edge))) != wp.uint32(0), e, 0.0)


@wp.func
def edges_among(e: EdgeSet, bits: wp.uint32) -> EdgeSet:
    """Return the members of a set of edges whose bit is set."""
    edges = EdgeSet()
    edges.x = wp.vec4(
        among(e.x[0], bits, 0), among(e.x[1], bits, 2), among(e.x[2], bits, 4), among(e.x[3], bits, 6)
    )
    edges.y = wp.vec4(
        among(e.y[0], bits, 3), among(e.y[1], bits, 1), among(e.y[2], bits, 7), among(e.y[3], bits, 5)
    )
    edges.z = wp.vec4(
        among(e.z[0], bits, 8), among(e.z[1], bits, 9), among(e.z[2], bits, 11), among(e.z[3], bits, 10)
    )
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
