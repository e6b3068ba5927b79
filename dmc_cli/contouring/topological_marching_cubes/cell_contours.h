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

// Return the edge between two corners that it joins
static CUDA_CALLABLE int edge_between(int a, int b) {
    const int low = a < b ? a : b, along = a ^ b;
    return along == 1 ? low : along == 2 ? (low & 1 ? low : low + 3) : 8 + (low ^ low >> 1);
}

// List the corners of a face, anticlockwise seen from outside the cell
static CUDA_CALLABLE void list_corners(int face, int* found) {
    const int axis = face >> 1, second = 1 << (axis + 1) % 3, third = 1 << (axis + 2) % 3;
    const bool is_high = face & 1;
    const int base = is_high ? 1 << axis : 0;
    found[0] = base;
    found[1] = base + (is_high ? second : third);
    found[2] = base + second + third;
    found[3] = base + (is_high ? third : second);
}

// Return whether two edges lie in one face
static CUDA_CALLABLE bool share_face(int a, int b) {
    const int a0 = low_corner(a), a1 = a0 + (1 << axis_of(a)), b0 = low_corner(b),
              b1 = b0 + (1 << axis_of(b));
    return (((a0 & a1 & b0 & b1) | ~(a0 | a1 | b0 | b1)) & 7) != 0;
}

// Add the segments of a face: each run of inside corners is cut off or, if those of an ambiguous face are
// joined, each outside corner; the inside lies on the same side of all
static CUDA_CALLABLE void add_segments(Contours& contours, int corners, int face, bool is_joined) {
    int round[4], inside = 0;
    list_corners(face, round);
    for (int n = 0; n < 4; ++n) inside |= (corners >> round[n] & 1) << n;
    if (inside == 0 || inside == 15) return;
    const bool is_ambiguous = inside == 5 || inside == 10;
    for (int n = 0; n < 4; ++n) {
        const bool here = inside >> n & 1, before = inside >> ((n + 3) & 3) & 1;
        if (here == before || here == (is_ambiguous && is_joined)) continue;
        int last = n;
        while ((inside >> ((last + 1) & 3) & 1) == (int)here) ++last;
        const int first_edge = edge_between(round[(n + 3) & 3], round[n]);
        const int last_edge = edge_between(round[last & 3], round[(last + 1) & 3]);
        const int start = here ? first_edge : last_edge;
        contours.next[start] = here ? last_edge : first_edge;
        contours.face[start] = face;
        contours.cut[start] = is_ambiguous ? round[n] : NONE;
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
