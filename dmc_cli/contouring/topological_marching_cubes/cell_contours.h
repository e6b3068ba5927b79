// Trace the polygons of a cell whose faces are decided: see trilinear_cells.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

namespace cell_contours {

enum { EDGES = 12, FACES = 6, NONE = -1, MOST = 4 };

// The segments of the cell's faces, by the edge where they start: the edge where they end, their face and,
// where that is ambiguous, the corner that they cut off; and the polygons that they make, each as its edges
struct Contours {
    int next[EDGES], face[EDGES], cut[EDGES];
    int edges[EDGES];     // of all polygons, one after the other
    int start[MOST + 1];  // of each polygon among them
    int count;
};

// Return the lower corner of an edge
static CUDA_CALLABLE int low_corner(int edge) {
    const int corners[EDGES] = {0, 1, 2, 0, 4, 5, 6, 4, 0, 1, 3, 2};
    return corners[edge];
}

// Return the axis along which an edge runs
static CUDA_CALLABLE int axis_of(int edge) { return edge < 8 ? edge & 1 : 2; }

// Return the edge between two corners
static CUDA_CALLABLE int edge_between(int a, int b) {
    const int low = a < b ? a : b;
    int found = NONE;
    for (int edge = 0; edge < EDGES; ++edge)
        if (low_corner(edge) == low && 1 << axis_of(edge) == (a ^ b)) found = edge;
    return found;
}

// Return corner n of a face, anticlockwise seen from outside the cell
static CUDA_CALLABLE int corner_of(int face, int n) {
    const int axis = face >> 1, second = 1 << (axis + 1) % 3, third = 1 << (axis + 2) % 3;
    const bool is_high = face & 1;
    const int round[4] = {0, is_high ? second : third, second + third, is_high ? third : second};
    return round[n & 3] + (is_high ? 1 << axis : 0);
}

// Return whether two edges lie in one face
static CUDA_CALLABLE bool share_face(int a, int b) {
    const int a0 = low_corner(a), a1 = a0 + (1 << axis_of(a)), b0 = low_corner(b),
              b1 = b0 + (1 << axis_of(b));
    bool found = false;
    for (int axis = 0; axis < 3; ++axis) {
        const int bits = (a0 >> axis & 1) + (a1 >> axis & 1) + (b0 >> axis & 1) + (b1 >> axis & 1);
        found = found || bits == 0 || bits == 4;
    }
    return found;
}

// Add the segments of a face: each run of inside corners is cut off or, if those of an ambiguous face are
// joined, each outside corner; the inside lies on the same side of all
static CUDA_CALLABLE void add_segments(Contours& contours, int corners, int face, bool is_joined) {
    int inside = 0;
    for (int n = 0; n < 4; ++n) inside |= (corners >> corner_of(face, n) & 1) << n;
    const bool is_ambiguous = inside == 5 || inside == 10;
    for (int n = 0; n < 4; ++n) {
        const bool here = inside >> n & 1, before = inside >> ((n + 3) & 3) & 1;
        if (here == before || here == (is_ambiguous && is_joined)) continue;
        int last = n;
        while ((inside >> ((last + 1) & 3) & 1) == (int)here) ++last;
        const int first_edge = edge_between(corner_of(face, n + 3), corner_of(face, n));
        const int last_edge = edge_between(corner_of(face, last), corner_of(face, last + 1));
        const int start = here ? first_edge : last_edge;
        contours.next[start] = here ? last_edge : first_edge;
        contours.face[start] = face;
        contours.cut[start] = is_ambiguous ? corner_of(face, n) : NONE;
    }
}

// Trace the polygons of a case, the decisions on its faces a bit each; their normals point out of the inside
static CUDA_CALLABLE void trace(Contours& contours, int corners, int joined) {
    for (int edge = 0; edge < EDGES; ++edge) contours.next[edge] = NONE;
    for (int face = 0; face < FACES; ++face) add_segments(contours, corners, face, joined >> face & 1);
    contours.count = contours.start[0] = 0;
    bool is_done[EDGES] = {};
    int length = 0;
    for (int first = 0; first < EDGES; ++first) {
        if (contours.next[first] == NONE || is_done[first]) continue;
        for (int edge = first; !is_done[edge]; edge = contours.next[edge]) {
            is_done[edge] = true;
            contours.edges[length++] = edge;
        }
        contours.start[++contours.count] = length;
    }
}

}  // namespace cell_contours
