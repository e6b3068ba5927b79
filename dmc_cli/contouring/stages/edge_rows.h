// Find the crossed edges of a row, a word at a time: see edge_ranks.py, which does the same for sixteen
// words.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

namespace edge_rows {

// Lines of words, and the distances of rows and layers in them
struct Lines {
    POINTER(const unsigned int) inside;
    POINTER(const unsigned int) exists;  // cells; not looked at where all exist
    bool is_marked;
    int row, layer, nx;
};

// Return the lowest bits of a word, as many as `count` says, which may be below 0 or above 32
static CUDA_CALLABLE unsigned int low_bits(int count) {
    return count >= 32 ? ~0u : count <= 0 ? 0u : (1u << count) - 1u;
}

// Return the bits of the nodes one step along x: word n of a line
static CUDA_CALLABLE unsigned int next(POINTER(const unsigned int) line, int n) {
    return line[n] >> 1 | line[n + 1] << 31;
}

// Return a bit for each of sixteen words from n on: whether corners of a cell at one of its nodes differ, so
// that there may be crossed edges; ends of rows are not looked at
static CUDA_CALLABLE unsigned int crossed_words(const Lines& lines, int n) {
    POINTER(const unsigned int) a = lines.inside + n;
    POINTER(const unsigned int) b = a + lines.row;
    POINTER(const unsigned int) c = a + lines.layer;
    POINTER(const unsigned int) d = c + lines.row;
    unsigned int words = 0;
    for (int lane = 0; lane < 16; ++lane) {
        unsigned int some = a[lane] | b[lane] | c[lane] | d[lane];
        unsigned int every = a[lane] & b[lane] & c[lane] & d[lane];
        unsigned int next_some = a[lane + 1] | b[lane + 1] | c[lane + 1] | d[lane + 1];
        unsigned int next_every = a[lane + 1] & b[lane + 1] & c[lane + 1] & d[lane + 1];
        unsigned int crossed =
            (some | some >> 1 | next_some << 31) & ~(every & (every >> 1 | next_every << 31));
        words |= (unsigned int)(crossed != 0) << lane;
    }
    return words;
}

// Return the bits of the nodes with a cell at them or one before, in either of two rows
static CUDA_CALLABLE unsigned int cells_round(const Lines& lines, int n, int other) {
    POINTER(const unsigned int) cells = lines.exists;
    unsigned int here = cells[n] | cells[n - other];
    return here | here << 1 | (cells[n - 1] | cells[n - 1 - other]) >> 31;
}

// Return the bits of the nodes with a cell in one of the four rows round an edge along x
static CUDA_CALLABLE unsigned int cells_beside(const Lines& lines, int n) {
    POINTER(const unsigned int) cells = lines.exists;
    return cells[n] | cells[n - lines.row] | cells[n - lines.layer] | cells[n - lines.layer - lines.row];
}

// Return the case of the cell at bit b of word n
static CUDA_CALLABLE int case_at(const Lines& lines, int n, int b) {
    const int rows[4] = {n, n + lines.row, n + lines.layer, n + lines.layer + lines.row};
    int found = 0;
    for (int r = 0; r < 4; ++r) {
        unsigned long long word = lines.inside[rows[r]] | (unsigned long long)lines.inside[rows[r] + 1] << 32;
        found |= (int)(word >> b & 3) << 2 * r;
    }
    return found;
}

// Return the edges with a vertex along an axis from the nodes of word n of the lines, word w of its row; for
// y and z the next row or layer is there
static CUDA_CALLABLE unsigned int along_x(const Lines& lines, int n, int w) {
    unsigned int edges = (lines.inside[n] ^ next(lines.inside, n)) & low_bits(lines.nx - 1 - 32 * w);
    if (lines.is_marked) {
        POINTER(const unsigned int) cells = lines.exists;
        edges &=
            cells[n] | cells[n - lines.row] | cells[n - lines.layer] | cells[n - lines.layer - lines.row];
    }
    return edges;
}
static CUDA_CALLABLE unsigned int along_y(const Lines& lines, int n) {
    unsigned int edges = lines.inside[n] ^ lines.inside[n + lines.row];
    return lines.is_marked ? edges & cells_round(lines, n, lines.layer) : edges;
}
static CUDA_CALLABLE unsigned int along_z(const Lines& lines, int n) {
    unsigned int edges = lines.inside[n] ^ lines.inside[n + lines.layer];
    return lines.is_marked ? edges & cells_round(lines, n, lines.row) : edges;
}

}  // namespace edge_rows
