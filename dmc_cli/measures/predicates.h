// Decide exactly how points, segments and triangles with float32 coordinates lie: see predicates.py.
#pragma once
#include "builtin.h"

namespace predicates {
typedef wp::vec_t<3, wp::float32> Point;

// A sum of doubles without a rounding error: parts of growing size that do not overlap
struct Sum {
    double parts[48];
    int count = 0;

    CUDA_CALLABLE void add(double term) {
        int kept = 0;
        for (int n = 0; n < count; ++n) {
            const double part = parts[n], sum = term + part, above = sum - term;
            const double error = (term - (sum - above)) + (part - above);
            if (error != 0.0) parts[kept++] = error;
            term = sum;
        }
        if (term != 0.0) parts[kept++] = term;
        count = kept;
    }

    // x y has 48 bits; halves of it, split off by 2^27 + 1, by z have no rounding error
    CUDA_CALLABLE void add_product(double x, double y, double z) {
        const double product = x * y, above = 134217729.0 * product, high = above - (above - product);
        add(high * z);
        add((product - high) * z);
    }

    CUDA_CALLABLE void add_determinant(const Point& a, const Point& b, const Point& c, double sign) {
        for (int x = 0; x < 3; ++x) {
            const int y = (x + 1) % 3, z = (x + 2) % 3;
            add_product(a[x], b[y], sign * c[z]);
            add_product(a[x], b[z], -sign * c[y]);
        }
    }

    CUDA_CALLABLE int sign() const { return count == 0 ? 0 : parts[count - 1] > 0.0 ? 1 : -1; }
};

static CUDA_CALLABLE double magnitude(double x) { return x < 0.0 ? -x : x; }

static CUDA_CALLABLE bool same(const Point& a, const Point& b) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

// The sign of the determinant of a - d, b - d, c - d
static CUDA_CALLABLE int side_of_plane(const Point& a, const Point& b, const Point& c, const Point& d) {
    const double ax = (double)a[0] - d[0], ay = (double)a[1] - d[1], az = (double)a[2] - d[2];
    const double bx = (double)b[0] - d[0], by = (double)b[1] - d[1], bz = (double)b[2] - d[2];
    const double cx = (double)c[0] - d[0], cy = (double)c[1] - d[1], cz = (double)c[2] - d[2];
    const double bc = bx * cy, cb = cx * by, ca = cx * ay, ac = ax * cy, ab = ax * by, ba = bx * ay;
    const double found = az * (bc - cb) + bz * (ca - ac) + cz * (ab - ba);
    const double size = predicates::magnitude(az) * (predicates::magnitude(bc) + predicates::magnitude(cb)) +
                        predicates::magnitude(bz) * (predicates::magnitude(ca) + predicates::magnitude(ac)) +
                        predicates::magnitude(cz) * (predicates::magnitude(ab) + predicates::magnitude(ba));
    const double error = 7.771561172376103e-16 * size;  // Shewchuk's bound o3derrboundA
    if (found > error) return 1;
    if (found < -error) return -1;
    Sum sum;
    sum.add_determinant(a, b, c, 1.0);
    sum.add_determinant(b, c, d, -1.0);
    sum.add_determinant(a, c, d, 1.0);
    sum.add_determinant(a, b, d, -1.0);
    return sum.sign();
}

// The sign of the triangle's area seen along an axis
static CUDA_CALLABLE int side_of_line(const Point& a, const Point& b, const Point& c, int axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double left = ((double)b[u] - a[u]) * ((double)c[v] - a[v]);
    const double right = ((double)b[v] - a[v]) * ((double)c[u] - a[u]);
    const double found = left - right, size = predicates::magnitude(left) + predicates::magnitude(right);
    const double error = 3.3306690738754716e-16 * size;  // his ccwerrboundA
    if (found > error) return 1;
    if (found < -error) return -1;
    Sum sum;
    sum.add((double)a[u] * b[v]);
    sum.add(-(double)a[v] * b[u]);
    sum.add((double)b[u] * c[v]);
    sum.add(-(double)b[v] * c[u]);
    sum.add((double)c[u] * a[v]);
    sum.add(-(double)c[v] * a[u]);
    return sum.sign();
}

// An axis along which a triangle has an area, -1 if it has none at all
static CUDA_CALLABLE int axis_of(const Point* t) {
    for (int axis = 0; axis < 3; ++axis) {
        if (predicates::side_of_line(t[0], t[1], t[2], axis) != 0) return axis;
    }
    return -1;
}

static CUDA_CALLABLE bool ranges_meet(float a, float b, float c, float d) {
    return (a < b ? a : b) <= (c < d ? d : c) && (c < d ? c : d) <= (a < b ? b : a);
}

// Whether segments p q and r s of one plane meet, seen along an axis; ends belong to them
static CUDA_CALLABLE bool segments_meet(const Point& p, const Point& q, const Point& r, const Point& s,
                                        int axis) {
    const int at_r = predicates::side_of_line(p, q, r, axis), at_s = predicates::side_of_line(p, q, s, axis);
    if (at_r * at_s > 0) return false;
    const int at_p = predicates::side_of_line(r, s, p, axis), at_q = predicates::side_of_line(r, s, q, axis);
    if (at_p * at_q > 0) return false;
    if (at_r != 0 || at_s != 0) return true;
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    return predicates::ranges_meet(p[u], q[u], r[u], s[u]) && predicates::ranges_meet(p[v], q[v], r[v], s[v]);
}

// Whether a segment in the plane of a triangle meets it; the border belongs to it
static CUDA_CALLABLE bool meets_in_plane(const Point& p, const Point& q, const Point* t) {
    const int axis = predicates::axis_of(t), turn = predicates::side_of_line(t[0], t[1], t[2], axis);
    bool is_inside = true;
    for (int k = 0; k < 3; ++k) {
        const Point &a = t[k], &b = t[(k + 1) % 3];
        if (predicates::segments_meet(p, q, a, b, axis)) return true;
        is_inside = is_inside && turn * predicates::side_of_line(a, b, p, axis) >= 0;
    }
    return is_inside;
}

// Whether a segment meets a triangle that has an area
static CUDA_CALLABLE bool segment_meets(const Point& p, const Point& q, const Point* t) {
    const int at_p = predicates::side_of_plane(t[0], t[1], t[2], p),
              at_q = predicates::side_of_plane(t[0], t[1], t[2], q);
    if (at_p * at_q > 0) return false;
    if (at_p == 0 && at_q == 0) return predicates::meets_in_plane(p, q, t);
    int least = 1, most = -1;
    for (int k = 0; k < 3; ++k) {
        const int side = predicates::side_of_plane(p, q, t[k], t[(k + 1) % 3]);
        least = side < least ? side : least;
        most = side > most ? side : most;
    }
    return least >= 0 || most <= 0;
}

static CUDA_CALLABLE bool are_beside_plane(const Point* s, const Point* t) {
    const int side = predicates::side_of_plane(t[0], t[1], t[2], s[0]);
    return side != 0 && side == predicates::side_of_plane(t[0], t[1], t[2], s[1]) &&
           side == predicates::side_of_plane(t[0], t[1], t[2], s[2]);
}

// Move the corners that both triangles have to their beginnings, in the same order; return how many there are
static CUDA_CALLABLE int match_corners(Point* s, Point* t) {
    int shared = 0;
    for (int i = 0; i < 3; ++i) {
        for (int k = shared; k < 3; ++k) {
            if (!predicates::same(s[i], t[k])) continue;
            const Point a = s[i], b = t[shared];
            s[i] = s[shared];
            s[shared] = t[shared] = a;
            if (k != shared) t[k] = b;
            ++shared;
            break;
        }
    }
    return shared;
}

// Corners of q, as bits, that are not surely to the left (sense 1) or right (-1) of side k of p, seen along
// an axis
static CUDA_CALLABLE int doubtful_corners(const Point* p, int k, const Point* q, int axis, double sense) {
    const int next = (k + 1) & 3, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double au = p[k][u], av = p[k][v];
    const double du = sense * (p[next][u] - au), dv = sense * (p[next][v] - av);
    int doubtful = 0;
    for (int n = 0; n < 4; ++n) {
        const double left = du * (q[n][v] - av), right = dv * (q[n][u] - au);
        const double size = predicates::magnitude(left) + predicates::magnitude(right);
        doubtful |= (left - right > 3.4e-16 * size ? 0 : 1) << n;
    }
    return doubtful;
}

// Whether all corners of q that are doubtful are ends of side k of p
static CUDA_CALLABLE bool are_ends(const Point* p, int k, const Point* q, int doubtful) {
    for (int n = 0; n < 4; ++n) {
        if ((doubtful >> n & 1) && !predicates::same(p[k], q[n]) && !predicates::same(p[(k + 1) & 3], q[n]))
            return false;
    }
    return true;
}
}  // namespace predicates

inline wp::int32 plane_side(wp::vec_t<3, wp::float32> a, wp::vec_t<3, wp::float32> b,
                            wp::vec_t<3, wp::float32> c, wp::vec_t<3, wp::float32> d) {
    return predicates::side_of_plane(a, b, c, d);
}

inline wp::int32 line_side(wp::vec_t<3, wp::float32> a, wp::vec_t<3, wp::float32> b,
                           wp::vec_t<3, wp::float32> c, wp::int32 axis) {
    return predicates::side_of_line(a, b, c, axis);
}

inline bool triangles_meet(wp::vec_t<3, wp::float32> a, wp::vec_t<3, wp::float32> b,
                           wp::vec_t<3, wp::float32> c, wp::vec_t<3, wp::float32> d,
                           wp::vec_t<3, wp::float32> e, wp::vec_t<3, wp::float32> f) {
    predicates::Point s[3] = {a, b, c}, t[3] = {d, e, f};
    const int axis = predicates::axis_of(s);
    if (axis < 0 || predicates::axis_of(t) < 0) return false;
    const int shared = predicates::match_corners(s, t);
    if (shared == 3) return true;
    if (shared == 2) {
        return predicates::side_of_plane(s[0], s[1], s[2], t[2]) == 0 &&
               predicates::side_of_line(s[0], s[1], s[2], axis) ==
                   predicates::side_of_line(t[0], t[1], t[2], axis);
    }
    if (shared == 1) {
        return predicates::segment_meets(t[1], t[2], s) || predicates::segment_meets(s[1], s[2], t);
    }
    if (predicates::are_beside_plane(s, t) || predicates::are_beside_plane(t, s)) return false;
    for (int k = 0; k < 3; ++k) {
        if (predicates::segment_meets(s[k], s[(k + 1) % 3], t)) return true;
        if (predicates::segment_meets(t[k], t[(k + 1) % 3], s)) return true;
    }
    return false;
}

inline bool are_apart(wp::mat_t<4, 3, wp::float32> face, wp::mat_t<4, 3, wp::float32> other) {
    predicates::Point p[4], q[4];
    for (int n = 0; n < 4; ++n) {
        p[n] = face.get_row(n);
        q[n] = other.get_row(n);
    }
    float normal[3], size[3];
    for (int x = 0; x < 3; ++x) {
        const int y = (x + 1) % 3, z = (x + 2) % 3;
        normal[x] = (p[2][y] - p[0][y]) * (p[3][z] - p[1][z]) - (p[2][z] - p[0][z]) * (p[3][y] - p[1][y]);
        size[x] = normal[x] < 0.0f ? -normal[x] : normal[x];
    }
    const int axis = size[0] > size[1] ? (size[0] > size[2] ? 0 : 2) : (size[1] > size[2] ? 1 : 2);
    const double sense = normal[axis] < 0.0f ? -1.0 : 1.0;
    for (int k = 0; k < 4; ++k) {
        if (!predicates::are_ends(p, k, q, predicates::doubtful_corners(p, k, q, axis, -sense))) continue;
        if (predicates::same(p[k], p[(k + 1) & 3])) continue;
        if (predicates::are_ends(p, k, p, predicates::doubtful_corners(p, k, p, axis, sense))) return true;
    }
    return false;
}
