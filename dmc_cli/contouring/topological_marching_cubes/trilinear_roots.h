// Find the straight lines in the trilinear surface of a cell: see trilinear_roots.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

namespace trilinear_roots {

enum { SIDES = 6 };

// A number and what an infinitesimal adds to it
struct Near {
    double at, more;
};

static CUDA_CALLABLE int sign(double a) { return (a > 0.0) - (a < 0.0); }
static CUDA_CALLABLE int sign(Near a) { return a.at != 0.0 ? sign(a.at) : sign(a.more); }

// The two roots along an axis where the surface's cut falls into two lines, and whether they lie in the cell.
// Root 0 is where the determinant grows, for x, and where it falls, for y and z: so roots of the same number
// belong to the same line
struct Axis {
    double root[2];
    bool inside[2];
    bool first_is_lower;
};

// The lines: sides 0 to 5 of the hexagon from its vertex s to the next. `inside` says whether a side's line
// lies in the cell
struct Lines {
    Axis axis[3];
    bool inside[SIDES];
    int count;             // of those that lie in the cell
    double infinitesimal;  // that stands for one, where a product is tied
};

// Return which root of an axis a vertex of the hexagon has
static CUDA_CALLABLE int root_at(int vertex, int axis) {
    // vertices (0 0 0) (0 0 1) (1 0 1) (1 1 1) (1 1 0) (0 1 0)
    return axis == 0 ? vertex >= 2 && vertex <= 4 : axis == 1 ? vertex >= 3 : vertex >= 1 && vertex <= 3;
}

// Return the axis along which side s of the hexagon runs
static CUDA_CALLABLE int axis_of_side(int side) { return (side + 2) % 3; }

// Return b^2 - 4 a c with the digits that its terms take from each other
static CUDA_CALLABLE double discriminant(double a, double b, double c) {
    const double square = b * b, product = 4.0 * a * c;
#if defined(__clang__) && !defined(__CUDA_ARCH__)
    const double square_rest = __builtin_fma(b, b, -square);
    const double product_rest = __builtin_fma(4.0 * a, c, -product);
#else
    const double square_rest = fma(b, b, -square), product_rest = fma(4.0 * a, c, -product);
#endif
    return (square - product) + (square_rest - product_rest);
}

// The determinant p s - q r of a cut across an axis as a quadratic: a u^2 + b u + start, each with what
// lifting all values by an infinitesimal adds; and its value at u = 1
struct Quadratic {
    double a;
    Near b, start, end;
};

static CUDA_CALLABLE Quadratic quadratic(const double* f, int axis) {
    const int step = 1 << axis, second = 1 << (axis + 1) % 3, third = 1 << (axis + 2) % 3;
    const int corner[4] = {0, second, third, second + third};
    double low[4], high[4], rise[4];
    for (int n = 0; n < 4; ++n) {
        low[n] = f[corner[n]];
        high[n] = f[corner[n] + step];
        rise[n] = high[n] - low[n];
    }
    Quadratic found;
    found.a = rise[0] * rise[3] - rise[1] * rise[2];
    found.start.at = low[0] * low[3] - low[1] * low[2];
    found.start.more = (low[0] + low[3]) - (low[1] + low[2]);
    found.end.at = high[0] * high[3] - high[1] * high[2];
    found.end.more = (high[0] + high[3]) - (high[1] + high[2]);
    found.b.at = (found.end.at - found.start.at) - found.a;
    found.b.more = found.end.more - found.start.more;
    return found;
}

// Return which roots lie in the open interval, by signs alone; [0]: where the quadratic grows
static CUDA_CALLABLE void find_inside(const Quadratic& p, bool has_roots, bool* inside) {
    const Near slope_end = {2.0 * p.a + p.b.at, p.b.more};
    int start = sign(p.start), end = sign(p.end);
    if (start == 0) start = sign(p.b) != 0 ? sign(p.b) : sign(p.a);  // just behind the root at 0
    if (end == 0) end = sign(slope_end) != 0 ? -sign(slope_end) : sign(p.a);
    inside[0] = inside[1] = false;
    if (start != end) {
        inside[end > 0 ? 0 : 1] = true;
    } else if (has_roots && start * sign(p.b) < 0 && end * sign(slope_end) > 0) {
        inside[0] = inside[1] = true;
    }
}

// Return a root of the quadratic, where it grows or falls, in [0, 1]
static CUDA_CALLABLE double find_root(const Quadratic& p, double wide, bool is_growing,
                                      double infinitesimal) {
    const double b = p.b.at + infinitesimal * p.b.more, c = p.start.at + infinitesimal * p.start.more;
    const double signed_root = is_growing ? wide : -wide;
    double found;
    if ((b <= 0.0) == is_growing)
        found = p.a != 0.0 ? (signed_root - b) / (2.0 * p.a) : 0.0;
    else
        found = b + signed_root != 0.0 ? -2.0 * c / (b + signed_root) : 0.0;
    return found > 0.0 ? (found < 1.0 ? found : 1.0) : 0.0;
}

// Return whether the quadratic grows at root n of an axis
static CUDA_CALLABLE bool grows(int axis, int n) { return (axis == 0) == (n == 0); }

// Find the lines of a cell by its corner values, of which the largest is near 1
static CUDA_CALLABLE Lines find_lines(const double* f) {
    Quadratic of[3];
    bool is_tied = false;
    for (int axis = 0; axis < 3; ++axis) {
        of[axis] = quadratic(f, axis);
        is_tied = is_tied || of[axis].start.at == 0.0 || of[axis].end.at == 0.0 || of[axis].b.at == 0.0 ||
                  2.0 * of[axis].a + of[axis].b.at == 0.0;
    }
    // the discriminants of all axes are the same number
    const Quadratic& p = of[0];
    const double wide = discriminant(p.a, p.b.at, p.start.at);
    const double more = 2.0 * p.b.at * p.b.more - 4.0 * p.a * p.start.more, most = p.b.more * p.b.more;
    const bool has_roots = wide != 0.0 ? wide > 0.0 : more != 0.0 ? more > 0.0 : most > 0.0;
    Lines lines;
    lines.infinitesimal = is_tied || wide == 0.0 ? 1.0 / (1ull << 40) : 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        bool inside[2];
        find_inside(of[axis], has_roots, inside);
        for (int n = 0; n < 2; ++n) lines.axis[axis].inside[n] = inside[grows(axis, n) ? 0 : 1];
        lines.axis[axis].first_is_lower = (of[axis].a > 0.0) != (axis == 0);
    }
    lines.count = 0;
    for (int side = 0; side < SIDES; ++side) {
        lines.inside[side] = true;
        for (int axis = 0; axis < 3; ++axis) {
            if (axis != axis_of_side(side))
                lines.inside[side] = lines.inside[side] && lines.axis[axis].inside[root_at(side, axis)];
        }
        lines.count += lines.inside[side];
    }
    if (lines.count < 2) return lines;  // nothing crosses: nobody asks where the roots are
    const double d = lines.infinitesimal, whole = wide + d * (more + d * most);
    const double root = sqrt(whole > 0.0 ? whole : 0.0);
    for (int axis = 0; axis < 3; ++axis)
        for (int n = 0; n < 2; ++n) lines.axis[axis].root[n] = find_root(of[axis], root, grows(axis, n), d);
    return lines;
}

// Return a coordinate of a vertex of the hexagon
static CUDA_CALLABLE double coordinate(const Lines& lines, int vertex, int axis) {
    return lines.axis[axis].root[root_at(vertex % SIDES, axis)];
}

}  // namespace trilinear_roots
