"""Geometry in fractions, as plain as it can be, to hold the predicates against.

Two triangles are given by their corners. Their intersection is found by linear programming over fractions in
disguise: a convex polygon clipped by half-spaces.
"""

from fractions import Fraction


def vector(point):
    return tuple(Fraction(float(x)) for x in point)


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def sign(x):
    return (x > 0) - (x < 0)


def exact_plane_side(a, b, c, d):
    """The sign of the determinant of a - d, b - d, c - d."""
    a, b, c, d = map(vector, (a, b, c, d))
    return sign(dot(minus(a, d), cross(minus(b, d), minus(c, d))))


def exact_line_side(a, b, c, axis):
    """The sign of the area of a b c seen along an axis."""
    a, b, c = map(vector, (a, b, c))
    return sign(cross(minus(b, a), minus(c, a))[axis])


def clipped(polygon, normal, level):
    """The part of a convex polygon, or of a segment or a point, where normal . x >= level."""
    found = []
    count = len(polygon)
    for n in range(count):
        p, q = polygon[n], polygon[(n + 1) % count]
        at_p, at_q = dot(normal, p) - level, dot(normal, q) - level
        if at_p >= 0:
            found.append(p)
        if at_p * at_q < 0:
            t = at_p / (at_p - at_q)
            found.append(tuple(x + t * (y - x) for x, y in zip(p, q, strict=True)))
    return found


def common_points(s, t):
    """Corners of the intersection of triangles s and t."""
    a, b, c = t
    normal = cross(minus(b, a), minus(c, a))
    found = list(s)
    planes = [(normal, a), (tuple(-x for x in normal), a)]
    planes += [(cross(normal, minus(q, p)), p) for p, q in ((a, b), (b, c), (c, a))]
    for along, through in planes:
        found = clipped(found, along, dot(along, through))
    return set(found)


def exact_triangles_meet(*points):
    """Whether two triangles have more in common than corners and sides that both have."""
    points = [vector(p) for p in points]
    s, t = points[:3], points[3:]
    if any(not any(cross(minus(q, p), minus(r, p))) for p, q, r in (s, t)):
        return False
    both = set(s) & set(t)
    common = common_points(s, t)
    if len(both) == 3:
        return True
    return not common <= both
