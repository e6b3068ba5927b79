// Triangulate a cell as the trilinear surface has it: see trilinear_cells.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/contouring/topological_marching_cubes/cell_contours.h"
#include "dmc_cli/contouring/topological_marching_cubes/trilinear_roots.h"
#include "dmc_cli/runtime/pointers.h"

namespace trilinear_cells {

enum { INNER = 12, SIDES = 6, MOST_TRIANGLES = 36, MOST_INNER = 6, LONGEST = 7 };

// The triangles of a cell: numbers below 12 are vertices on its edges, those from 12 on its inner vertices
struct Triangles {
    int corners[MOST_TRIANGLES][3];
    int count;
    double inner[MOST_INNER][3];
    int inner_count;
    bool is_tunnel;
};

// What is known of a cell: F at its corners, the largest near 1, where each edge is crossed, and where that
// is in the world, as far as shapes are concerned
struct Cell {
    double f[8], crossing[12];
    float points[12][3];
    bool is_best;
};

static CUDA_CALLABLE void add(Triangles& triangles, int a, int b, int c) {
    int* corners = triangles.corners[triangles.count++];
    corners[0] = a, corners[1] = b, corners[2] = c;
}

static CUDA_CALLABLE int add_inner(Triangles& triangles, const double* point) {
    for (int axis = 0; axis < 3; ++axis) triangles.inner[triangles.inner_count][axis] = point[axis];
    return INNER + triangles.inner_count++;
}

// Return a coordinate of the vertex on an edge
static CUDA_CALLABLE double place(const Cell& cell, int edge, int axis) {
    if (cell_contours::axis_of(edge) == axis) return cell.crossing[edge];
    return cell_contours::low_corner(edge) >> axis & 1;
}

// Return twice the radius of a triangle's inner circle by that of its outer one
static CUDA_CALLABLE float quality(const Cell& cell, int a, int b, int c) {
    const int corners[4] = {a, b, c, a};
    float length[3];
    for (int n = 0; n < 3; ++n) {
        float square = 0.0f;
        for (int axis = 0; axis < 3; ++axis) {
            float d = cell.points[corners[n]][axis] - cell.points[corners[n + 1]][axis];
            square += d * d;
        }
        length[n] = wp::sqrt(square);
    }
    const float p = length[0], q = length[1], r = length[2], product = p * q * r;
    const float found = product > 0.0f ? ((p + q) - r) * (((q + r) - p) * ((r + p) - q)) / product : 0.0f;
    return found > 0.0f ? found : 0.0f;  // of no extent, by rounding
}

// Fan a polygon from a new inner vertex
static CUDA_CALLABLE void fan(Triangles& triangles, const int* edges, int size, int vertex) {
    for (int n = 0; n < size; ++n) add(triangles, edges[n], edges[(n + 1) % size], vertex);
}

// Triangulate a polygon without a diagonal in a face of the cell: from its first edge on where that goes, or
// so that the worst triangle is the best; return whether there is a way
static CUDA_CALLABLE bool fill(Triangles& triangles, const Cell& cell, const int* edges, int size) {
    if (size > LONGEST) return false;
    if (size == 3) {
        add(triangles, edges[0], edges[1], edges[2]);
        return true;
    }
    float worst[LONGEST][LONGEST];
    int apex[LONGEST][LONGEST];
    for (int length = 1; length < size; ++length) {
        for (int a = 0; a + length < size; ++a) {
            const int c = a + length;
            worst[a][c] = length == 1 ? 2.0f : -1.0f;
            if (length == 1 || (length < size - 1 && cell_contours::share_face(edges[a], edges[c]))) continue;
            for (int b = c - 1; b > a; --b) {
                float least = cell.is_best ? quality(cell, edges[a], edges[b], edges[c]) : 1.0f;
                least = least < worst[a][b] ? least : worst[a][b];
                least = least < worst[b][c] ? least : worst[b][c];
                if (least > worst[a][c]) {
                    worst[a][c] = least;
                    apex[a][c] = b;
                }
            }
        }
    }
    if (worst[0][size - 1] < 0.0f) return false;
    int open[2 * LONGEST], count = 0;
    open[count++] = 0, open[count++] = size - 1;
    while (count) {
        const int c = open[--count], a = open[--count], b = apex[a][c];
        add(triangles, edges[a], edges[b], edges[c]);
        if (b - a > 1) open[count++] = a, open[count++] = b;
        if (c - b > 1) open[count++] = b, open[count++] = c;
    }
    return true;
}

// Triangulate a polygon by itself; where only an inner vertex will do, by the mean of its vertices
static CUDA_CALLABLE void fill_plainly(Triangles& triangles, const Cell& cell, const int* edges, int size) {
    if (fill(triangles, cell, edges, size)) return;
    double mean[3] = {0.0, 0.0, 0.0};
    for (int n = 0; n < size; ++n)
        for (int axis = 0; axis < 3; ++axis) mean[axis] += place(cell, edges[n], axis) / size;
    fan(triangles, edges, size, add_inner(triangles, mean));
}

// Where the lines of the hexagon's sides, prolonged, meet segments of the faces: by the edge where the
// segment starts, up to two; which two vertices of the hexagon follow each other there, `gap` and the next,
// whether the side leaves at its first vertex, and where
struct Meetings {
    int count[12], gap[12][2];
    bool is_first[12][2];
    double at[12][2][3];
};

// Return the edge where the segment of a face starts that passes a point
static CUDA_CALLABLE int segment_at(const cell_contours::Contours& contours, const Cell& cell, int face,
                                    const double* point) {
    const int axis = face >> 1, second = (axis + 1) % 3, third = (axis + 2) % 3;
    const int base = face & 1 ? 1 << axis : 0;
    const double f0 = cell.f[base], f1 = cell.f[base + (1 << second)], f2 = cell.f[base + (1 << third)];
    const double f3 = cell.f[base + (1 << second) + (1 << third)], twist = (f0 - f1) - (f2 - f3);
    // the side of the hyperbola's middle, by the coordinate that is farther from it
    const double away_second = point[second] * twist - (f0 - f2),
                 away_third = point[third] * twist - (f0 - f1);
    const double ahead_second = twist > 0.0 ? away_second : -away_second;
    const double ahead_third = twist > 0.0 ? away_third : -away_third;
    const bool by_second = (ahead_second < 0.0 ? -ahead_second : ahead_second) >
                           (ahead_third < 0.0 ? -ahead_third : ahead_third);
    int found = cell_contours::NONE;
    for (int edge = 0; edge < 12; ++edge) {
        if (contours.next[edge] == cell_contours::NONE || contours.face[edge] != face) continue;
        const int corner = contours.cut[edge];
        const bool is_it =
            corner == cell_contours::NONE || (by_second ? (corner >> second & 1) == (ahead_second > 0.0)
                                                        : (corner >> third & 1) == (ahead_third > 0.0));
        if (is_it) found = edge;
    }
    return found;
}

// Find where the hexagon's sides, prolonged, meet the faces
static CUDA_CALLABLE bool find_meetings(Meetings& meetings, const cell_contours::Contours& contours,
                                        const Cell& cell, const trilinear_roots::Lines& lines) {
    for (int edge = 0; edge < 12; ++edge) meetings.count[edge] = 0;
    for (int side = 0; side < SIDES; ++side) {
        const int axis = trilinear_roots::axis_of_side(side);
        const bool starts_low =
            (trilinear_roots::root_at(side, axis) == 0) == lines.axis[axis].first_is_lower;
        for (int high = 0; high < 2; ++high) {
            const bool is_first = (high == 0) == starts_low;
            double point[3];
            for (int n = 0; n < 3; ++n) point[n] = trilinear_roots::coordinate(lines, side, n);
            point[axis] = high;
            const int edge = segment_at(contours, cell, 2 * axis + high, point);
            if (edge == cell_contours::NONE || meetings.count[edge] == 2) return false;
            const int n = meetings.count[edge]++;
            meetings.gap[edge][n] = (side + (is_first ? 5 : 1)) % SIDES;
            meetings.is_first[edge][n] = is_first;
            for (int m = 0; m < 3; ++m) meetings.at[edge][n][m] = point[m];
        }
    }
    return true;
}

// Return whether the second meeting on a segment comes before the first one
static CUDA_CALLABLE bool is_swapped(const Meetings& meetings, const cell_contours::Contours& contours,
                                     const Cell& cell, int edge) {
    double most = -1.0;
    bool found = false;
    for (int axis = 0; axis < 3; ++axis) {
        const double way = place(cell, contours.next[edge], axis) - place(cell, edge, axis);
        const double length = way < 0.0 ? -way : way;
        if (axis == contours.face[edge] >> 1 || length <= most) continue;
        most = length;
        found = (meetings.at[edge][1][axis] < meetings.at[edge][0][axis]) == (way > 0.0);
    }
    return found;
}

// The way of a polygon round the hexagon: behind which of its edges it goes on to the next vertex, six times
struct Way {
    int count, behind[12], gap[12];
    bool is_forward;
};

// Find the way of a polygon; return whether it goes round once, or not at all
static CUDA_CALLABLE bool find_way(Way& way, const Meetings& meetings,
                                   const cell_contours::Contours& contours, const Cell& cell,
                                   const int* edges, int size, bool first_only) {
    way.count = 0;
    for (int n = 0; n < size; ++n) {
        const int edge = edges[n], met = meetings.count[edge];
        const bool swapped = met == 2 && is_swapped(meetings, contours, cell, edge);
        for (int m = 0; m < met; ++m) {
            const int which = swapped ? 1 - m : m;
            if (first_only && !meetings.is_first[edge][which]) continue;
            way.behind[way.count] = n;
            way.gap[way.count++] = meetings.gap[edge][which];
        }
    }
    if (way.count == 0) return true;
    if (way.count != SIDES) return false;
    way.is_forward = (way.gap[0] + 1) % SIDES == way.gap[1];
    for (int n = 0; n < SIDES; ++n) {
        const int next = way.gap[(n + 1) % SIDES];
        if ((way.gap[n] + (way.is_forward ? 1 : 5)) % SIDES != next) return false;
    }
    return true;
}

// Add the ring of triangles between a polygon and the hexagon, whose first vertex is `hexagon`
static CUDA_CALLABLE void add_ring(Triangles& triangles, const Way& way, const int* edges, int size,
                                   int hexagon) {
    int at = (way.gap[0] + (way.is_forward ? 0 : 1)) % SIDES, passed = 0;
    for (int n = 0; n < size; ++n) {
        for (; passed < SIDES && way.behind[passed] == n; ++passed) {
            const int next = (at + (way.is_forward ? 1 : 5)) % SIDES;
            add(triangles, edges[n], hexagon + next, hexagon + at);
            at = next;
        }
        add(triangles, edges[n], edges[(n + 1) % size], hexagon + at);
    }
}

// Triangulate a cell with the whole hexagon inside: a tunnel, or a disc; return whether the polygons go round
// it
static CUDA_CALLABLE bool join_hexagon(Triangles& triangles, const cell_contours::Contours& contours,
                                       const Cell& cell, const trilinear_roots::Lines& lines) {
    Meetings meetings;
    if (!find_meetings(meetings, contours, cell, lines)) return false;
    const bool is_disc = contours.count == 1;
    Way ways[cell_contours::MOST];
    int rings = 0;
    for (int n = 0; n < contours.count; ++n) {
        const int start = contours.start[n], size = contours.start[n + 1] - start;
        if (!find_way(ways[n], meetings, contours, cell, contours.edges + start, size, is_disc)) return false;
        rings += ways[n].count != 0;
    }
    if (rings != (is_disc ? 1 : 2)) return false;
    for (int vertex = 0; vertex < SIDES; ++vertex) {
        double point[3];
        for (int axis = 0; axis < 3; ++axis) point[axis] = trilinear_roots::coordinate(lines, vertex, axis);
        add_inner(triangles, point);
    }
    for (int n = 0; n < contours.count; ++n) {
        const int* edges = contours.edges + contours.start[n];
        const int size = contours.start[n + 1] - contours.start[n];
        if (ways[n].count)
            add_ring(triangles, ways[n], edges, size, INNER);
        else
            fill_plainly(triangles, cell, edges, size);
    }
    for (int n = 1; is_disc && n < SIDES - 1; ++n) {
        const int a = INNER + n, b = INNER + n + 1;
        add(triangles, INNER, ways[0].is_forward ? a : b, ways[0].is_forward ? b : a);
    }
    triangles.is_tunnel = !is_disc;
    return true;
}

// Find the inner vertex of a cell with lines that cross: the middle of the run of them; return whether there
// are such lines
static CUDA_CALLABLE bool find_crossing(const trilinear_roots::Lines& lines, double* point) {
    for (int first = 0; first < SIDES; ++first) {
        if (lines.inside[(first + 5) % SIDES] || !lines.inside[first]) continue;
        int run = 1;
        while (lines.inside[(first + run) % SIDES]) ++run;
        if (run < 2) continue;
        // sides first to first + run - 1 meet in the vertices first + 1 to first + run - 1
        const int low = first + run / 2, high = first + (run + 1) / 2;
        for (int axis = 0; axis < 3; ++axis) {
            point[axis] = 0.5 * (trilinear_roots::coordinate(lines, low, axis) +
                                 trilinear_roots::coordinate(lines, high, axis));
        }
        return true;
    }
    return false;
}

// Triangulate a cell by its case and the decisions on its faces
static CUDA_CALLABLE void triangulate(Triangles& triangles, const cell_contours::Contours& contours,
                                      const Cell& cell, const trilinear_roots::Lines& lines) {
    triangles.count = triangles.inner_count = 0;
    triangles.is_tunnel = false;
    if (lines.count == SIDES && join_hexagon(triangles, contours, cell, lines)) return;
    double point[3];
    const bool is_crossed = lines.count < SIDES && find_crossing(lines, point);
    for (int n = 0; n < contours.count; ++n) {
        const int* edges = contours.edges + contours.start[n];
        const int size = contours.start[n + 1] - contours.start[n];
        if (is_crossed && size > 3 && triangles.inner_count == 0)
            fan(triangles, edges, size, add_inner(triangles, point));
        else
            fill_plainly(triangles, cell, edges, size);
    }
}

static CUDA_CALLABLE double magnitude(double a) { return a < 0.0 ? -a : a; }

// Return the power of two that brings a number near 1
static CUDA_CALLABLE double scale_of(double number) {
    union {
        double number;
        unsigned long long bits;
    } parts;
    parts.number = number;
    const long long inverse = 2046 - (long long)(parts.bits >> 52 & 2047);
    parts.bits = (unsigned long long)(inverse > 2046 ? 2046 : inverse < 1 ? 1 : inverse) << 52;
    return parts.number;
}

// Scale F
static CUDA_CALLABLE void load(Cell& cell, const double* f) {
    double largest = 0.0;
    for (int c = 0; c < 8; ++c) largest = magnitude(f[c]) > largest ? magnitude(f[c]) : largest;
    const double scale = scale_of(largest);
    for (int c = 0; c < 8; ++c) cell.f[c] = f[c] * scale;
}

// Find the crossings, of F lifted by a little
static CUDA_CALLABLE void cross(Cell& cell, double lift) {
    for (int edge = 0; edge < 12; ++edge) {
        const int low = cell_contours::low_corner(edge), high = low + (1 << cell_contours::axis_of(edge));
        const double a = cell.f[low] + lift, b = cell.f[high] + lift;
        cell.crossing[edge] = a != b ? a / (a - b) : 0.0;
    }
}

}  // namespace trilinear_cells

inline wp::vec_t<4, wp::int32> triangulate_cell(wp::vec_t<8, wp::float64> corner_values, wp::int32 corners,
                                                wp::int32 joined, wp::array_t<wp::float32> frame,
                                                wp::float32 step, wp::int32 is_best, wp::int32 is_reversed,
                                                wp::vec_t<12, wp::int32> vertices, wp::int32 first_inner,
                                                wp::int32 first_triangle,
                                                wp::array_t<wp::vec_t<4, wp::int32>> faces_out,
                                                wp::array_t<wp::vec_t<3, wp::float32>> local_out) {
    double f[8];
    for (int c = 0; c < 8; ++c) f[c] = corner_values[c];
    trilinear_cells::Cell cell = {};
    cell.is_best = is_best != 0 && first_triangle >= 0;  // to count, any triangulation will do
    trilinear_cells::load(cell, f);
    const trilinear_roots::Lines lines = trilinear_roots::find_lines(cell.f);
    if (first_triangle >= 0 || lines.count == trilinear_cells::SIDES)
        trilinear_cells::cross(cell, lines.infinitesimal);
    POINTER(const float) table = ITEMS(const float, frame);
    for (int edge = 0; cell.is_best && edge < 12; ++edge) {
        for (int axis = 0; axis < 3; ++axis) {
            const int at = 16 * axis + edge;
            const float base = table[at] + step * table[48 + at],
                        along = table[96 + at] + step * table[144 + at];
            cell.points[edge][axis] = base + (float)cell.crossing[edge] * along;
        }
    }
    cell_contours::Contours contours;
    cell_contours::trace(contours, corners, joined);
    trilinear_cells::Triangles triangles;
    trilinear_cells::triangulate(triangles, contours, cell, lines);
    if (first_triangle >= 0) {
        POINTER(int) face = ITEMS(int, faces_out) + 4 * (size_t)first_triangle;
        for (int n = 0; n < triangles.count; ++n, face += 4) {
            for (int c = 0; c < 3; ++c) {
                const int corner = triangles.corners[n][is_reversed && c ? 3 - c : c];
                const int inner = first_inner + corner - trilinear_cells::INNER;
                face[c] = corner < trilinear_cells::INNER ? vertices[corner] : inner;
            }
            face[3] = -1;
        }
        POINTER(float) local = ITEMS(float, local_out) + 3 * (size_t)first_inner;
        for (int n = 0; n < 3 * triangles.inner_count; ++n) local[n] = (float)triangles.inner[n / 3][n % 3];
    }
    return wp::vec_t<4, wp::int32>(triangles.count, triangles.inner_count, contours.count,
                                   (int)triangles.is_tunnel);
}
