// Triangulate polygons of some cells, those of a size side by side: see cell_triangles.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/field/lanes.h"
#include "dmc_cli/runtime/pointers.h"

namespace polygon_lists {

enum { SHORTEST = 3, LONGEST = 7, SIZES = LONGEST - SHORTEST + 1, ENTRIES = 16, CORNERS = 32, MEMBERS = 5 };

// The tables of cases and triangulations: see triangulations.py
struct Tables {
    POINTER(const unsigned int) edges;  // of each polygon: their entries, four bits each
    POINTER(const unsigned char) sizes;
    POINTER(const unsigned char) standard;
    POINTER(const unsigned long long) allowed;
    POINTER(const unsigned char) corners;  // of the way round that is wanted
    POINTER(const unsigned char) members;
};

// The points of a cell's edges, by axis: base + place * along, a place being how far along its edge a vertex
// lies. Vertices that have left their edges have places of three numbers: steps along the grid's axes, from
// the base in cells
struct Points {
    float base[3][ENTRIES];
    float along[3][ENTRIES];
};

enum { EDGE_X = 0, EDGE_Y = 4, EDGE_Z = 6 };  // entries of one edge along each axis

typedef lanes::numbers numbers;
typedef lanes::integers integers;

#if defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
// Sixteen polygons side by side
enum { LANES = 16, ROOM = 64 };
typedef unsigned int codes __attribute__((ext_vector_type(16)));
static numbers ratio(numbers a, numbers b) { return b > 0.0f ? a / b : (numbers)0.0f; }
static integers is_more(numbers a, numbers b) { return a > b; }
static codes load(const unsigned int* a) {
    codes all;
    __builtin_memcpy(&all, a, sizeof(all));
    return all;
}
static integers if_allowed(integers better, integers allowed) { return better & -allowed; }
#else
enum { LANES = 1, ROOM = 1 };
typedef unsigned int codes;
static CUDA_CALLABLE float ratio(float a, float b) { return b > 0.0f ? a / b : 0.0f; }
static CUDA_CALLABLE int is_more(float a, float b) { return a > b; }
static CUDA_CALLABLE unsigned int load(const unsigned int* a) { return *a; }
static CUDA_CALLABLE int if_allowed(int better, int allowed) { return better & allowed; }
#endif

#if defined(__AVX512F__) && defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
typedef int v16si __attribute__((vector_size(64)));
typedef float v16sf __attribute__((vector_size(64)));

// Return a table's numbers at the lowest four bits of codes
static CUDA_CALLABLE numbers looked_up(const float* table, codes at) {
    v16sf all;
    __builtin_memcpy(&all, table, sizeof(all));
    return (numbers)__builtin_ia32_permvarsf512(all, (v16si)at);
}

// Write the vertices of a polygon, whose edges have these entries, and -1 behind
static CUDA_CALLABLE void pick(const int* vertices, unsigned int code, int* to) {
    const codes shifts = {0, 4, 8, 12, 16, 20, 24, 28, 0, 0, 0, 0, 0, 0, 0, 0};
    v16si all;
    __builtin_memcpy(&all, vertices, sizeof(all));
    all = __builtin_ia32_permvarsi512(all, (v16si)((codes)code >> shifts));
    __builtin_memcpy(to, &all, 32);
}

// Write the corners of the faces of a polygon
static CUDA_CALLABLE void store(const int* vertices, POINTER(const unsigned char) corners, int size,
                                POINTER(int) face) {
    typedef unsigned char bytes __attribute__((ext_vector_type(16)));
    bytes places;
    v16si all = {};
    __builtin_memcpy(&places, RUN(corners, 16), sizeof(places));
    __builtin_memcpy(&all, vertices, 32);
    all = __builtin_ia32_permvarsi512(all, (v16si) __builtin_convertvector(places, integers));
    const int count = size < LONGEST ? size - 2 : LONGEST - 3;
    __builtin_memcpy(RUN(face, 4 * count), &all, 16 * count);
    for (int n = 4 * count; n < 4 * (size - 2); ++n) face[n] = vertices[corners[n]];
}
#else
static CUDA_CALLABLE numbers looked_up(const float* table, codes at) {
#if defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
    numbers found;
    for (int lane = 0; lane < LANES; ++lane) found[lane] = table[at[lane] & 15];
    return found;
#else
    return table[at & 15];
#endif
}

static CUDA_CALLABLE void pick(const int* vertices, unsigned int code, int* to) {
    for (int n = 0; n < 8; ++n) to[n] = vertices[code >> 4 * n & 15];
}

static CUDA_CALLABLE void store(const int* vertices, POINTER(const unsigned char) corners, int size,
                                POINTER(int) face) {
    for (int n = 0; n < 4 * (size - 2); ++n) face[n] = vertices[corners[n]];
}
#endif

// Polygons of a size
struct List {
    int vertices[ROOM][8];  // of the mesh; -1 behind the last place
    int slot[ROOM];         // the first triangle
    int kind[ROOM];         // which polygon of all cases
    unsigned int code[ROOM];
    int count;
};

// Where vertices have left their edges, polygons with a triangle of less quality than `least`: their first
// triangles
struct Lists {
    List of[SIZES];
    float least;
    int poor[SIZES * ROOM];
    int poor_count;
};

static CUDA_CALLABLE void clear(Lists& lists) {
    for (int n = 0; n < SIZES; ++n) lists.of[n].count = 0;
    lists.poor_count = 0;
}

// Write down a polygon of a cell, whose edges have these vertices, by entry; return its size
static CUDA_CALLABLE int list(Lists& lists, const Tables& tables, int kind, const int* vertices, int slot) {
    const unsigned int code = tables.edges[kind];
    const int size = tables.sizes[kind];
    List& found = lists.of[size - SHORTEST];
    const int p = found.count++;
    found.kind[p] = kind;
    found.slot[p] = slot;
    found.code[p] = code;
    pick(vertices, code, found.vertices[p]);
    return size;
}

// Return whether there is no room for another polygon of a size
static CUDA_CALLABLE bool is_full(const Lists& lists, int size) {
    return lists.of[size - SHORTEST].count == ROOM;
}

// Return the first row of a size among the triangulations of all sizes
static CUDA_CALLABLE int first_row(int size) {
    return size == 3 ? 0 : size == 4 ? 1 : size == 5 ? 3 : size == 6 ? 8 : 22;
}

// Return how many triangulations a size has
static CUDA_CALLABLE int row_count(int size) {
    return size == 3 ? 1 : size == 4 ? 2 : size == 5 ? 5 : size == 6 ? 14 : 42;
}

// Return the n-th number of the places of the v-th vertices of the polygons from `start` on
static CUDA_CALLABLE numbers places_of(const List& list, int start, int v, POINTER(const float) places,
                                       int width, int n) {
#if defined(__AVX512F__) && defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU) && \
    !defined(DMC_CHECKED)
    if (width == 1) {
        const v16si rows = {0, 8, 16, 24, 32, 40, 48, 56, 64, 72, 80, 88, 96, 104, 112, 120};
        v16si vertex = __builtin_ia32_gathersiv16si((v16si){}, &list.vertices[start][v], rows, -1, 4);
        return (numbers)__builtin_ia32_gathersiv16sf((v16sf){}, places, vertex, -1, 4);
    }
#endif
    float found[LANES];
    for (int lane = 0; lane < LANES; ++lane)
        found[lane] = places[(size_t)width * list.vertices[start + lane][v] + n];
    return lanes::load(found);
}

// Return the triangulation of each of the polygons from `start` on whose worst triangle is the best; a
// triangle's quality is twice the radius of its inner circle by that of its outer one; a place has `width`
// numbers. Write the worst triangle's quality into `best`
static CUDA_CALLABLE integers find_best(const List& list, int start, const Tables& tables,
                                        const Points& points, POINTER(const float) places, int width,
                                        int size, numbers& best) {
    const codes code = load(list.code + start);
    numbers x[LONGEST][3];
    for (int v = 0; v < size; ++v) {
        const codes at = code >> (unsigned int)(4 * v);
        numbers along[3];
        for (int n = 0; n < width; ++n) along[n] = places_of(list, start, v, places, width, n);
        for (int axis = 0; axis < 3; ++axis) {
            numbers base = looked_up(points.base[axis], at);
            if (width == 1)
                x[v][axis] = base + along[0] * looked_up(points.along[axis], at);
            else
                x[v][axis] =
                    base + ((along[0] * points.along[axis][EDGE_X] + along[1] * points.along[axis][EDGE_Y]) +
                            along[2] * points.along[axis][EDGE_Z]);
        }
    }
    numbers length[LONGEST][LONGEST];
    for (int a = 0; a < size; ++a) {
        for (int b = a + 1; b < size; ++b) {
            numbers d = x[a][0] - x[b][0], e = x[a][1] - x[b][1], f = x[a][2] - x[b][2];
            length[a][b] = lanes::root((d * d + e * e) + f * f);
        }
    }
    numbers quality[35];
    int count = 0;
    for (int a = 0; a < size; ++a) {
        for (int b = a + 1; b < size; ++b) {
            for (int c = b + 1; c < size; ++c) {
                numbers p = length[a][b], q = length[b][c], r = length[a][c];
                quality[count++] = ratio(((p + q) - r) * (((q + r) - p) * ((r + p) - q)), p * q * r);
            }
        }
    }
    const unsigned long long all = ~0ull >> (64 - row_count(size));
    unsigned long long allowed = all;
    for (int lane = 0; lane < LANES; ++lane) allowed &= tables.allowed[list.kind[start + lane]];
    best = -2.0f;
    integers found = 0;
    POINTER(const unsigned char) member = tables.members + MEMBERS * first_row(size);
    for (int row = 0; row < row_count(size); ++row, member += MEMBERS) {
        numbers worst = quality[member[0]];
        for (int n = 1; n < size - 2; ++n) worst = lanes::least(worst, quality[member[n]]);
        integers better = is_more(worst, best);
        if (size > 5 && allowed != all) {  // smaller polygons have no diagonal in a face
            int is_allowed[LANES];
            for (int lane = 0; lane < LANES; ++lane)
                is_allowed[lane] = (int)(tables.allowed[list.kind[start + lane]] >> row & 1);
            better = if_allowed(better, lanes::load(is_allowed));
        }
        best = better ? worst : best;
        found = better ? (integers)row : found;
    }
    return found;
}

// Store the triangles of the listed polygons of a size, and clear the list; a place has `width` numbers
static CUDA_CALLABLE void store_size(Lists& lists, const Tables& tables, const Points& points,
                                     POINTER(const float) places, int width, bool is_best, int size,
                                     POINTER(int) faces) {
    List& list = lists.of[size - SHORTEST];
    for (int start = 0; start < list.count; start += LANES) {
        const int used = list.count - start < LANES ? list.count - start : LANES;
        int rows[LANES];
        if (is_best && (size > 3 || width > 1)) {
            for (int n = start + used; n < start + LANES; ++n) {  // as the last one
                list.kind[n] = list.kind[n - 1];
                list.code[n] = list.code[n - 1];
                for (int v = 0; v < LONGEST; ++v) list.vertices[n][v] = list.vertices[n - 1][v];
            }
            numbers best;
            float worst[LANES];
            lanes::store(rows, find_best(list, start, tables, points, places, width, size, best));
            lanes::store(worst, best);
            for (int lane = 0; lane < used && width > 1; ++lane)
                if (!(worst[lane] >= lists.least)) lists.poor[lists.poor_count++] = list.slot[start + lane];
        } else {
            for (int lane = 0; lane < used; ++lane) rows[lane] = tables.standard[list.kind[start + lane]];
        }
        for (int lane = 0; lane < used; ++lane)
            store(list.vertices[start + lane], tables.corners + CORNERS * (first_row(size) + rows[lane]),
                  size, faces + 4 * (size_t)list.slot[start + lane]);
    }
    list.count = 0;
}

// Store the triangles of the listed polygons whose sizes have a bit, and clear their lists; a place has
// `width` numbers
static CUDA_CALLABLE void store_sizes(Lists& lists, const Tables& tables, const Points& points,
                                      POINTER(const float) places, int width, bool is_best, int sizes,
                                      POINTER(int) faces) {
    // by constants, so that loops over a polygon's edges are unrolled
    if (sizes & 1 << 3) store_size(lists, tables, points, places, width, is_best, 3, faces);
    if (sizes & 1 << 4) store_size(lists, tables, points, places, width, is_best, 4, faces);
    if (sizes & 1 << 5) store_size(lists, tables, points, places, width, is_best, 5, faces);
    if (sizes & 1 << 6) store_size(lists, tables, points, places, width, is_best, 6, faces);
    if (sizes & 1 << 7) store_size(lists, tables, points, places, width, is_best, 7, faces);
}

}  // namespace polygon_lists
