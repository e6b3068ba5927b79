// Find the vertices on the edges of cells: see cell_edges.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/contouring/stages/edge_rows.h"
#include "dmc_cli/runtime/pointers.h"

namespace cell_edges {

// The edges of cells lie in eight runs of words: along x in their row, the next one, that of the next layer
// and its next; along y in their row and that of the next layer; along z in their row and the next one
enum { RUNS = 8, LISTED = 16, BLOCK = 16 };

// A word of cells: the inside bits of its corners, and the edges of each run with the number of the first one
struct Word {
    unsigned int corners[RUNS];
    unsigned int edges[RUNS];
    int first[RUNS];
};

#if defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
typedef unsigned int runs __attribute__((ext_vector_type(8)));
typedef unsigned int listed __attribute__((ext_vector_type(16)));

// What the twelve edges of a cell of the word have in common with other cells, edge by edge
struct Cells {
    listed edges, first;
    runs corners;
};

static CUDA_CALLABLE Cells spread(const Word& word) {
    Cells cells;
    runs edges, first;
    __builtin_memcpy(&edges, word.edges, sizeof(edges));
    __builtin_memcpy(&first, word.first, sizeof(first));
    __builtin_memcpy(&cells.corners, word.corners, sizeof(cells.corners));
    const runs no_edges = 0, no_vertex = ~0u;
    cells.edges = __builtin_shufflevector(edges, no_edges, 0, 4, 1, 4, 2, 5, 3, 5, 6, 6, 7, 7, 8, 8, 8, 8);
    cells.first = __builtin_shufflevector(first, no_vertex, 0, 4, 1, 4, 2, 5, 3, 5, 6, 6, 7, 7, 8, 8, 8, 8);
    return cells;
}

static CUDA_CALLABLE int case_of(const Cells& cells, int b) {
#if defined(__AVX__)
    typedef float v8sf __attribute__((vector_size(32)));
    return __builtin_ia32_movmskps256((v8sf)(cells.corners << (unsigned int)(31 - b)));
#else
    int found = 0;
    for (int c = 0; c < RUNS; ++c) found |= (int)(cells.corners[c] >> b & 1) << c;
    return found;
#endif
}

// Write the vertices on the edges of the cell at bit b, and -1 behind them; edges 1, 5, 9 and 10 are those of
// the next node
static CUDA_CALLABLE void find_vertices(const Cells& cells, int b, int* vertices) {
    const listed next = {0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0};
    const listed before = (1u << b) - 1u;
    listed found =
        cells.first + __builtin_elementwise_popcount(cells.edges & (before | next << (unsigned int)b));
    __builtin_memcpy(vertices, &found, sizeof(found));
}

static CUDA_CALLABLE void pass(Word& word) {
    runs edges, first;
    __builtin_memcpy(&edges, word.edges, sizeof(edges));
    __builtin_memcpy(&first, word.first, sizeof(first));
    first += __builtin_elementwise_popcount(edges);
    __builtin_memcpy(word.first, &first, sizeof(first));
}
#else
typedef Word Cells;

static CUDA_CALLABLE Word spread(const Word& word) { return word; }

static CUDA_CALLABLE int case_of(const Word& word, int b) {
    int found = 0;
    for (int c = 0; c < RUNS; ++c) found |= (int)(word.corners[c] >> b & 1) << c;
    return found;
}

static CUDA_CALLABLE void find_vertices(const Word& word, int b, int* vertices) {
    const int run[12] = {0, 4, 1, 4, 2, 5, 3, 5, 6, 6, 7, 7};
    for (int edge = 0; edge < 12; ++edge) {
        bool is_next = edge == 1 || edge == 5 || edge == 9 || edge == 10;
        unsigned int below = (1u << b) - 1u | (is_next ? 1u << b : 0u);
        vertices[edge] = word.first[run[edge]] + (int)wp::bit_count(word.edges[run[edge]] & below);
    }
    for (int n = 12; n < LISTED; ++n) vertices[n] = -1;
}

// Go on to the next word: the first edges of each run
static CUDA_CALLABLE void pass(Word& word) {
    for (int run = 0; run < RUNS; ++run) word.first[run] += (int)wp::bit_count(word.edges[run]);
}
#endif

// Begin a row of cells: the first edges of each run
static CUDA_CALLABLE void begin(Word& word, POINTER(const long long) starts, POINTER(const int) along_x,
                                POINTER(const int) along_y, int row, int next_layer) {
    const int layer = row + next_layer;
    word.first[0] = (int)starts[row];
    word.first[1] = (int)starts[row + 1];
    word.first[2] = (int)starts[layer];
    word.first[3] = (int)starts[layer + 1];
    word.first[4] = word.first[0] + along_x[row];
    word.first[5] = word.first[2] + along_x[layer];
    word.first[6] = word.first[4] + along_y[row];
    word.first[7] = word.first[1] + along_x[row + 1] + along_y[row + 1];
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
    cell_edges::Word word;
    cell_edges::begin(word, ITEMS(const long long, starts), ITEMS(const int, along_x),
                      ITEMS(const int, along_y), row, nodes[1]);
    for (int w = 0; w <= i / 32; ++w) {
        cell_edges::load(word, lines, ahead + row * words + w, w);
        if (w < i / 32) cell_edges::pass(word);
    }
    int found[cell_edges::LISTED];
    cell_edges::find_vertices(cell_edges::spread(word), i % 32, found);
    wp::vec_t<12, wp::int32> vertices;
    for (int edge = 0; edge < 12; ++edge) vertices[edge] = found[edge];
    return vertices;
}
