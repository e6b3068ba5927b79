// Count the crossed edges and triangles of some rows: see edge_ranks.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/contouring/stages/edge_rows.h"
#include "dmc_cli/runtime/pointers.h"

namespace edge_counts {

enum { LANES = 16 };

// Where the words of a block lie: all nodes, those with a next one along x, and whether the next row and the
// next layer are there; words beyond those that are counted have no nodes
struct Masks {
    unsigned int nodes[LANES], along[LANES], rows[LANES], layers[LANES];
};

// What each word has; special cells and their corners where there are some
struct Counts {
    int x[LANES], y[LANES], z[LANES], triangles[LANES], special[LANES], active[LANES];
    unsigned int several[LANES];
};

// Return bits of faces with corners a b c d, a and d diagonal: whether they are ambiguous
static CUDA_CALLABLE unsigned int ambiguous(unsigned int a, unsigned int b, unsigned int c, unsigned int d) {
    return (a ^ b) & (a ^ c) & ~(a ^ d);
}

// Return bits of cells: whether corner a and the opposite one, e, are alone; b c d are neighbours of a
static CUDA_CALLABLE unsigned int lone(unsigned int a, unsigned int b, unsigned int c, unsigned int d,
                                       unsigned int e) {
    return ~(a ^ e) & (a ^ b) & (a ^ c) & (a ^ d);
}

static CUDA_CALLABLE Masks find_masks(const edge_rows::Lines& lines, int ny, int nz, int w, int j, int k,
                                      int count) {
    Masks masks;
    for (int lane = 0; lane < LANES; ++lane) {
        bool is_there = lane < count;
        masks.nodes[lane] = is_there ? ~0u : 0u;
        masks.along[lane] = is_there ? edge_rows::low_bits(lines.nx - 1 - 32 * w) : 0u;
        masks.rows[lane] = is_there && j < ny - 1 ? ~0u : 0u;
        masks.layers[lane] = is_there && k < nz - 1 ? ~0u : 0u;
        if (++w == lines.row) {
            w = 0;
            if (++j == ny) j = 0, ++k;
        }
    }
    return masks;
}

// Count in each of sixteen words from n of the lines on
static CUDA_CALLABLE void count_words(const edge_rows::Lines& lines, int n, const Masks& masks,
                                      Counts& counts) {
    POINTER(const unsigned int) a = lines.inside + n;
    POINTER(const unsigned int) b = a + lines.row;
    POINTER(const unsigned int) c = a + lines.layer;
    POINTER(const unsigned int) d = c + lines.row;
    unsigned int x_there[LANES], y_there[LANES], z_there[LANES], there[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        x_there[lane] = masks.along[lane];
        y_there[lane] = masks.rows[lane];
        z_there[lane] = masks.layers[lane];
        there[lane] = masks.along[lane] & masks.rows[lane] & masks.layers[lane];
    }
    if (lines.is_marked) {
        for (int lane = 0; lane < LANES; ++lane) {
            x_there[lane] &= edge_rows::cells_beside(lines, n + lane);
            y_there[lane] &= edge_rows::cells_round(lines, n + lane, lines.layer);
            z_there[lane] &= edge_rows::cells_round(lines, n + lane, lines.row);
            there[lane] &= lines.exists[n + lane];
        }
    }
    for (int lane = 0; lane < LANES; ++lane) {
        unsigned int c0 = a[lane], c1 = c0 >> 1 | a[lane + 1] << 31;
        unsigned int c2 = b[lane], c3 = c2 >> 1 | b[lane + 1] << 31;
        unsigned int c4 = c[lane], c5 = c4 >> 1 | c[lane + 1] << 31;
        unsigned int c6 = d[lane], c7 = c6 >> 1 | d[lane + 1] << 31;
        counts.x[lane] = wp::bit_count((c0 ^ c1) & x_there[lane]);
        counts.y[lane] = wp::bit_count((c0 ^ c2) & y_there[lane]);
        counts.z[lane] = wp::bit_count((c0 ^ c4) & z_there[lane]);
        unsigned int cells =
            ((c0 | c1 | c2 | c3 | c4 | c5 | c6 | c7) & ~(c0 & c1 & c2 & c3 & c4 & c5 & c6 & c7));
        cells &= there[lane];
        unsigned int several = ambiguous(c0, c1, c2, c3) | ambiguous(c4, c5, c6, c7);
        several |= ambiguous(c0, c1, c4, c5) | ambiguous(c2, c3, c6, c7);
        several |= ambiguous(c0, c2, c4, c6) | ambiguous(c1, c3, c5, c7);
        several |= lone(c0, c1, c2, c4, c7) | lone(c1, c0, c3, c5, c6);
        several |= lone(c2, c0, c3, c6, c5) | lone(c3, c1, c2, c7, c4);
        several &= cells;
        unsigned int plain = cells & ~several;
        int edges = wp::bit_count((c0 ^ c1) & plain) + wp::bit_count((c2 ^ c3) & plain);
        edges += wp::bit_count((c4 ^ c5) & plain) + wp::bit_count((c6 ^ c7) & plain);
        edges += wp::bit_count((c0 ^ c2) & plain) + wp::bit_count((c1 ^ c3) & plain);
        edges += wp::bit_count((c4 ^ c6) & plain) + wp::bit_count((c5 ^ c7) & plain);
        edges += wp::bit_count((c0 ^ c4) & plain) + wp::bit_count((c1 ^ c5) & plain);
        edges += wp::bit_count((c2 ^ c6) & plain) + wp::bit_count((c3 ^ c7) & plain);
        counts.triangles[lane] = edges - 2 * (int)wp::bit_count(plain);
        counts.special[lane] = wp::bit_count(several);
        counts.active[lane] = wp::bit_count(cells);
        counts.several[lane] = several;
    }
}

// Add the triangles of the special cells of a word
static CUDA_CALLABLE int special_triangles(const edge_rows::Lines& lines, int n, unsigned int cells,
                                           POINTER(const unsigned char) case_triangles) {
    int triangles = 0;
    for (; cells; cells &= cells - 1)
        triangles += case_triangles[edge_rows::case_at(lines, n, wp::bit_count(~cells & (cells - 1)))];
    return triangles;
}

}  // namespace edge_counts

inline void count_rows(wp::array_t<wp::vec_t<16, wp::uint32>> inside,
                       wp::array_t<wp::vec_t<16, wp::uint32>> exists, wp::int32 is_marked,
                       wp::vec_t<3, wp::int32> nodes, wp::int32 words, wp::int32 ahead, wp::int32 row,
                       wp::int32 span, wp::array_t<wp::uint8> case_triangles,
                       wp::array_t<wp::int64> counts_out, wp::array_t<wp::int32> along_x_out,
                       wp::array_t<wp::int32> along_y_out, wp::array_t<wp::int32> active_out) {
    const int rows = nodes[1] * nodes[2];
    const int end = row + span < rows ? row + span : rows;
    const edge_rows::Lines lines{ITEMS(const unsigned int, inside),
                                 ITEMS(const unsigned int, exists),
                                 is_marked != 0,
                                 words,
                                 words * nodes[1],
                                 nodes[0]};
    POINTER(const unsigned char) of_case = ITEMS(const unsigned char, case_triangles);
    POINTER(int) along_x = ITEMS(int, along_x_out);
    POINTER(int) along_y = ITEMS(int, along_y_out);
    POINTER(int) active = ITEMS(int, active_out);
    POINTER(long long) sums = ITEMS(long long, counts_out);
    for (int r = row; r < end; ++r) {
        along_x[r] = along_y[r] = active[r] = 0;
        sums[r] = sums[rows + r] = sums[2 * (size_t)rows + r] = 0;
    }
    const int count = (end - row) * words;
    for (int done = 0; done < count; done += edge_counts::LANES) {
        const int n = ahead + row * words + done;
        if (!edge_rows::crossed_words(lines, n)) continue;
        const int first = row + done / words, k = first / nodes[1], left = count - done;
        const int lanes = left < edge_counts::LANES ? left : edge_counts::LANES;
        int w = done % words;
        edge_counts::Counts counts;
        edge_counts::count_words(
            lines, n, edge_counts::find_masks(lines, nodes[1], nodes[2], w, first - k * nodes[1], k, lanes),
            counts);
        for (int lane = 0, r = first; lane < lanes; ++lane) {
            int triangles = counts.triangles[lane];
            if (counts.several[lane])
                triangles += edge_counts::special_triangles(lines, n + lane, counts.several[lane], of_case);
            along_x[r] += counts.x[lane];
            along_y[r] += counts.y[lane];
            active[r] += counts.active[lane];
            sums[r] += counts.x[lane] + counts.y[lane] + counts.z[lane];
            sums[rows + r] += triangles;
            sums[2 * (size_t)rows + r] += counts.special[lane];
            if (++w == words) w = 0, ++r;
        }
    }
}
