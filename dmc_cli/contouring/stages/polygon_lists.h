// Triangulate polygons of some cells, those of a size side by side: see cell_triangles.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

namespace polygon_lists {

enum { LONGEST = 7, EDGES = 16, SIZE = 8, CORNERS = 32, MEMBERS = 5 };

// The tables of cases and triangulations: see triangulations.py
struct Tables {
    POINTER(const unsigned char) edges;  // of each polygon, in a row of sixteen with its size
    POINTER(const unsigned char) standard;
    POINTER(const unsigned long long) allowed;
    POINTER(const unsigned char) corners;  // of the way round that is wanted
    POINTER(const unsigned char) members;
};

// The points of a cell's edges, by axis: base + place * along, a place being how far along its edge a vertex
// lies. Vertices that have left their edges have places of three numbers: steps along the grid's axes, from
// the base in cells
struct Points {
    float base[3][EDGES];
    float along[3][EDGES];
};

enum { EDGE_X = 0, EDGE_Y = 1, EDGE_Z = 8 };  // one edge along each axis

#if defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
// Sixteen polygons side by side
enum { LANES = 16, ROOM = 200 };
typedef float numbers __attribute__((ext_vector_type(16)));
typedef int integers __attribute__((ext_vector_type(16)));
static CUDA_CALLABLE numbers root(numbers a) { return __builtin_elementwise_sqrt(a); }
static CUDA_CALLABLE numbers least(numbers a, numbers b) { return __builtin_elementwise_min(a, b); }
static CUDA_CALLABLE numbers ratio(numbers a, numbers b) { return b > 0.0f ? a / b : (numbers)0.0f; }
static CUDA_CALLABLE integers is_more(numbers a, numbers b) { return a > b; }
static CUDA_CALLABLE numbers load(const float* a) {
    numbers all;
    __builtin_memcpy(&all, a, sizeof(all));
    return all;
}
static CUDA_CALLABLE integers load(const int* a) {
    integers all;
    __builtin_memcpy(&all, a, sizeof(all));
    return all;
}
static CUDA_CALLABLE void spill(integers all, int* to) { __builtin_memcpy(to, &all, sizeof(all)); }
static CUDA_CALLABLE integers if_allowed(integers better, integers allowed) { return better & -allowed; }
static CUDA_CALLABLE numbers looked_up(const float* table, const int* at) {
#if defined(__AVX512F__)
    typedef int v16si __attribute__((vector_size(64)));
    typedef float v16sf __attribute__((vector_size(64)));
    v16si places;
    v16sf all;
    __builtin_memcpy(&places, at, sizeof(places));
    __builtin_memcpy(&all, table, sizeof(all));
    return (numbers)__builtin_ia32_permvarsf512(all, places);
#else
    numbers found;
    for (int lane = 0; lane < LANES; ++lane) found[lane] = table[at[lane]];
    return found;
#endif
}
#else
enum { LANES = 1, ROOM = 8 };
typedef float numbers;
typedef int integers;
static CUDA_CALLABLE float root(float a) { return sqrtf(a); }
static CUDA_CALLABLE float least(float a, float b) { return a < b ? a : b; }
static CUDA_CALLABLE float ratio(float a, float b) { return b > 0.0f ? a / b : 0.0f; }
static CUDA_CALLABLE int is_more(float a, float b) { return a > b; }
static CUDA_CALLABLE float load(const float* a) { return *a; }
static CUDA_CALLABLE int load(const int* a) { return *a; }
static CUDA_CALLABLE void spill(int all, int* to) { *to = all; }
static CUDA_CALLABLE int if_allowed(int better, int allowed) { return better & allowed; }
static CUDA_CALLABLE float looked_up(const float* table, const int* at) { return table[*at]; }
#endif

// Polygons in the order in which they came, and which have each size
struct Lists {
    int vertices[ROOM][8];  // of the mesh; -1 behind the last place
    int slot[ROOM];         // the first triangle
    int kind[ROOM];         // which polygon of all cases
    int count;
    unsigned char listed[LONGEST + 1][ROOM];
    int listed_count[LONGEST + 1];
};

static CUDA_CALLABLE void clear(Lists& lists) {
    lists.count = 0;
    for (int size = 0; size <= LONGEST; ++size) lists.listed_count[size] = 0;
}

// Write down a polygon of a cell, whose edges have these vertices
static CUDA_CALLABLE int list(Lists& lists, const Tables& tables, int kind, const int* vertices, int slot) {
    POINTER(const unsigned char) edges = tables.edges + EDGES * kind;
    const int size = edges[SIZE], p = lists.count++;
    lists.kind[p] = kind;
    lists.slot[p] = slot;
    lists.listed[size][lists.listed_count[size]++] = (unsigned char)p;
#if defined(__AVX512F__) && defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
    typedef unsigned char bytes __attribute__((ext_vector_type(16)));
    typedef int v16si __attribute__((vector_size(64)));
    bytes places;
    v16si all;
    __builtin_memcpy(&places, RUN(edges, 16), sizeof(places));
    __builtin_memcpy(&all, vertices, sizeof(all));
    all = __builtin_ia32_permvarsi512(all, (v16si) __builtin_convertvector(places, integers));
    __builtin_memcpy(lists.vertices[p], &all, 32);
#else
    for (int n = 0; n < LONGEST; ++n) lists.vertices[p][n] = vertices[edges[n]];
    lists.vertices[p][LONGEST] = -1;
#endif
    return size;
}

// Return the first row of a size among the triangulations of all sizes
static CUDA_CALLABLE int first_row(int size) {
    return size == 3 ? 0 : size == 4 ? 1 : size == 5 ? 3 : size == 6 ? 8 : 22;
}

// Return how many triangulations a size has
static CUDA_CALLABLE int row_count(int size) {
    return size == 3 ? 1 : size == 4 ? 2 : size == 5 ? 5 : size == 6 ? 14 : 42;
}

// Store the triangles of a polygon by a row
static CUDA_CALLABLE void store(const int* vertices, POINTER(const unsigned char) corners, int size,
                                POINTER(int) face) {
#if defined(__AVX512F__) && defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
    typedef unsigned char bytes __attribute__((ext_vector_type(16)));
    typedef int v16si __attribute__((vector_size(64)));
    if (size <= 6) {
        bytes places;
        v16si all = {};
        __builtin_memcpy(&places, RUN(corners, 16), sizeof(places));
        __builtin_memcpy(&all, vertices, 32);
        all = __builtin_ia32_permvarsi512(all, (v16si) __builtin_convertvector(places, integers));
        __builtin_memcpy(RUN(face, 4 * (size - 2)), &all, 16 * (size - 2));
        return;
    }
#endif
    for (int n = 0; n < 4 * (size - 2); ++n) face[n] = vertices[corners[n]];
}

// Return the triangulation of each of the polygons `chosen` whose worst triangle is the best; a triangle's
// quality is twice the radius of its inner circle by that of its outer one; a place has `width` numbers
static CUDA_CALLABLE integers find_best(const Lists& lists, const Tables& tables, const Points& points,
                                        POINTER(const float) places, int width, int size, const int* chosen) {
    int edge[LONGEST][LANES];
    float along[3][LONGEST][LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        POINTER(const unsigned char) edges = tables.edges + EDGES * lists.kind[chosen[lane]];
        const int* vertices = lists.vertices[chosen[lane]];
        for (int v = 0; v < size; ++v) {
            edge[v][lane] = edges[v];
            for (int n = 0; n < width; ++n) along[n][v][lane] = places[(size_t)width * vertices[v] + n];
        }
    }
    numbers x[LONGEST][3];
    for (int v = 0; v < size; ++v) {
        for (int axis = 0; axis < 3; ++axis) {
            numbers base = looked_up(points.base[axis], edge[v]);
            if (width == 1)
                x[v][axis] = base + load(along[0][v]) * looked_up(points.along[axis], edge[v]);
            else
                x[v][axis] = base + ((load(along[0][v]) * points.along[axis][EDGE_X] +
                                      load(along[1][v]) * points.along[axis][EDGE_Y]) +
                                     load(along[2][v]) * points.along[axis][EDGE_Z]);
        }
    }
    numbers length[LONGEST][LONGEST];
    for (int a = 0; a < size; ++a) {
        for (int b = a + 1; b < size; ++b) {
            numbers d = x[a][0] - x[b][0], e = x[a][1] - x[b][1], f = x[a][2] - x[b][2];
            length[a][b] = root((d * d + e * e) + f * f);
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
    for (int lane = 0; lane < LANES; ++lane) allowed &= tables.allowed[lists.kind[chosen[lane]]];
    numbers best = -2.0f;
    integers found = 0;
    POINTER(const unsigned char) member = tables.members + MEMBERS * first_row(size);
    for (int row = 0; row < row_count(size); ++row, member += MEMBERS) {
        numbers worst = quality[member[0]];
        for (int n = 1; n < size - 2; ++n) worst = least(worst, quality[member[n]]);
        integers better = is_more(worst, best);
        if (size > 5 && allowed != all) {  // smaller polygons have no diagonal in a face
            int is_allowed[LANES];
            for (int lane = 0; lane < LANES; ++lane)
                is_allowed[lane] = (int)(tables.allowed[lists.kind[chosen[lane]]] >> row & 1);
            better = if_allowed(better, load(is_allowed));
        }
        best = better ? worst : best;
        found = better ? (integers)row : found;
    }
    return found;
}

// Store the triangles of all listed polygons of a size
static CUDA_CALLABLE void store_size(Lists& lists, const Tables& tables, const Points& points,
                                     POINTER(const float) places, int width, bool is_best, int size,
                                     POINTER(int) faces) {
    for (int start = 0; start < lists.listed_count[size]; start += LANES) {
        int used = lists.listed_count[size] - start, chosen[LANES], rows[LANES];
        used = used < LANES ? used : LANES;
        for (int lane = 0; lane < LANES; ++lane)
            chosen[lane] = lists.listed[size][start + (lane < used ? lane : used - 1)];
        if (is_best && size > 3) {
            spill(find_best(lists, tables, points, places, width, size, chosen), rows);
        } else {
            for (int lane = 0; lane < LANES; ++lane) rows[lane] = tables.standard[lists.kind[chosen[lane]]];
        }
        for (int lane = 0; lane < used; ++lane) {
            int p = chosen[lane];
            store(lists.vertices[p], tables.corners + CORNERS * (first_row(size) + rows[lane]), size,
                  faces + 4 * (size_t)lists.slot[p]);
        }
    }
}

// Store the triangles of all listed polygons, and clear the lists; a place has `width` numbers
static CUDA_CALLABLE void store_all(Lists& lists, const Tables& tables, const Points& points,
                                    POINTER(const float) places, int width, bool is_best,
                                    POINTER(int) faces) {
    // by constants, so that loops over a polygon's edges are unrolled
    store_size(lists, tables, points, places, width, is_best, 3, faces);
    store_size(lists, tables, points, places, width, is_best, 4, faces);
    store_size(lists, tables, points, places, width, is_best, 5, faces);
    store_size(lists, tables, points, places, width, is_best, 6, faces);
    store_size(lists, tables, points, places, width, is_best, 7, faces);
    clear(lists);
}

}  // namespace polygon_lists
