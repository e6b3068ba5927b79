// Find the vertices on the edges of cells: see cell_edges.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/contouring/stages/edge_rows.h"
#include "dmc_cli/runtime/pointers.h"

namespace cell_edges {

// The edges of cells lie in eight runs of words: along x in their row, the next one, that of the next layer
// and its next; along y in their row and that of the next layer; along z in their row and the next one. A
// cell's vertices are the first ones of all runs that have not been passed, and those after its own edges
// there, which are the next node's; these sixteen entries have a -1 where no edge is meant
enum { RUNS = 8, ENTRIES = 16, BLOCK = 16 };

// A word of cells: the inside bits of its corners, and the edges of each run
struct Word {
    unsigned int corners[RUNS];
    unsigned int edges[RUNS];
};

// Return where the vertex on an edge of a cell is among the entries
static CUDA_CALLABLE int entry_of(int edge) {
    const int entries[12] = {0, 12, 1, 4, 2, 13, 3, 5, 6, 14, 15, 7};
    return entries[edge];
}

#if defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
typedef unsigned int runs __attribute__((ext_vector_type(8)));

static CUDA_CALLABLE runs load(const unsigned int* a) {
    runs all;
    __builtin_memcpy(&all, a, sizeof(all));
    return all;
}

static CUDA_CALLABLE int case_of(const Word& word, int b) {
    const runs corners = load(word.corners);
#if defined(__AVX__)
    typedef float v8sf __attribute__((vector_size(32)));
    return __builtin_ia32_movmskps256((v8sf)(corners << (unsigned int)(31 - b)));
#else
    int found = 0;
    for (int c = 0; c < RUNS; ++c) found |= (int)(corners[c] >> b & 1) << c;
    return found;
#endif
}

// Write the vertices of the cell at bit b, by entry, and pass its edges; all edges before it have been passed
static CUDA_CALLABLE void pass(unsigned int* first, const Word& word, int b, int* vertices) {
    typedef unsigned int listed __attribute__((ext_vector_type(16)));
    const runs before = load(first), no_vertex = {~0u, ~0u, ~0u, ~0u, 0, 0, 0, 0};
    const runs after = before + (load(word.edges) >> (unsigned int)b & 1u);
    const listed all = __builtin_shufflevector(before, after | no_vertex, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10,
                                               11, 12, 13, 14, 15);
    __builtin_memcpy(vertices, &all, sizeof(all));
    __builtin_memcpy(first, &after, sizeof(after));
}
#else
static CUDA_CALLABLE int case_of(const Word& word, int b) {
    int found = 0;
    for (int c = 0; c < RUNS; ++c) found |= (int)(word.corners[c] >> b & 1) << c;
    return found;
}

static CUDA_CALLABLE void pass(unsigned int* first, const Word& word, int b, int* vertices) {
    for (int run = 0; run < RUNS; ++run) {
        vertices[run] = (int)first[run];
        first[run] += word.edges[run] >> b & 1;
        vertices[RUNS + run] = run < 4 ? -1 : (int)first[run];
    }
}
#endif

// Return the bits of the nodes with an edge in any run
static CUDA_CALLABLE unsigned int any_edge(const Word& word) {
    unsigned int some = 0;
    for (int run = 0; run < RUNS; ++run) some |= word.edges[run];
    return some;
}

// Begin a row of cells: the first edges of each run
static CUDA_CALLABLE void begin(unsigned int* first, POINTER(const long long) starts,
                                POINTER(const int) along_x, POINTER(const int) along_y, int row,
                                int next_layer) {
    const int layer = row + next_layer;
    first[0] = (unsigned int)starts[row];
    first[1] = (unsigned int)starts[row + 1];
    first[2] = (unsigned int)starts[layer];
    first[3] = (unsigned int)starts[layer + 1];
    first[4] = first[0] + along_x[row];
    first[5] = first[2] + along_x[layer];
    first[6] = first[4] + along_y[row];
    first[7] = first[1] + along_x[row + 1] + along_y[row + 1];
}

// Load word w of a row, n of the lines; return its crossed cells
static CUDA_CALLABLE unsigned int load(Word& word, const edge_rows::Lines& lines, int n, int w) {
    const int rows[4] = {n, n + lines.row, n + lines.layer, n + lines.layer + lines.row};
    unsigned int some = 0, every = ~0u;
    for (int r = 0; r < 4; ++r) {
        word.corners[2 * r] = lines.inside[rows[r]];
        word.corners[2 * r + 1] = edge_rows::next(lines.inside, rows[r]);
        some |= word.corners[2 * r] | word.corners[2 * r + 1];
        every &= word.corners[2 * r] & word.corners[2 * r + 1];
    }
    const unsigned int there = edge_rows::low_bits(lines.nx - 1 - 32 * w);
    if (lines.is_marked) {
        for (int r = 0; r < 4; ++r) word.edges[r] = edge_rows::along_x(lines, rows[r], w);
        word.edges[4] = edge_rows::along_y(lines, rows[0]);
        word.edges[5] = edge_rows::along_y(lines, rows[2]);
        word.edges[6] = edge_rows::along_z(lines, rows[0]);
        word.edges[7] = edge_rows::along_z(lines, rows[1]);
        return some & ~every & there & lines.exists[n];
    }
    for (int r = 0; r < 4; ++r) word.edges[r] = (word.corners[2 * r] ^ word.corners[2 * r + 1]) & there;
    word.edges[4] = word.corners[0] ^ word.corners[2];
    word.edges[5] = word.corners[4] ^ word.corners[6];
    word.edges[6] = word.corners[0] ^ word.corners[4];
    word.edges[7] = word.corners[2] ^ word.corners[6];
    return some & ~every & there;
}

}  // namespace cell_edges

inline wp::vec_t<12, wp::int32> vertices_of_cell(wp::array_t<wp::vec_t<16, wp::uint32>> inside,
                                                 wp::array_t<wp::vec_t<16, wp::uint32>> exists,
                                                 wp::int32 is_marked, wp::vec_t<3, wp::int32> nodes,
                                                 wp::int32 words, wp::int32 ahead, wp::int32 row, wp::int32 i,
                                                 wp::array_t<wp::int64> starts,
                                                 wp::array_t<wp::int32> along_x,
                                                 wp::array_t<wp::int32> along_y) {
    const edge_rows::Lines lines{ITEMS(const unsigned int, inside),
                                 ITEMS(const unsigned int, exists),
                                 is_marked != 0,
                                 words,
                                 words * nodes[1],
                                 nodes[0]};
    unsigned int first[cell_edges::RUNS];
    cell_edges::begin(first, ITEMS(const long long, starts), ITEMS(const int, along_x),
                      ITEMS(const int, along_y), row, nodes[1]);
    cell_edges::Word word;
    for (int w = 0; w <= i / 32; ++w) {
        cell_edges::load(word, lines, ahead + row * words + w, w);
        const unsigned int before = w < i / 32 ? ~0u : (1u << i % 32) - 1u;
        for (int run = 0; run < cell_edges::RUNS; ++run)
            first[run] += wp::bit_count(word.edges[run] & before);
    }
    int entries[cell_edges::ENTRIES];
    cell_edges::pass(first, word, i % 32, entries);
    wp::vec_t<12, wp::int32> vertices;
    for (int edge = 0; edge < 12; ++edge) vertices[edge] = entries[cell_edges::entry_of(edge)];
    return vertices;
}
