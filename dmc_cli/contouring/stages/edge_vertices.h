// Place the vertices on the edges from some rows of nodes: see edge_vertices.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/bits/bit_lists.h"
#include "dmc_cli/contouring/stages/edge_rows.h"
#include "dmc_cli/field/sample_reader.h"
#include "dmc_cli/runtime/pointers.h"

namespace crossings {

enum { LANES = 16, WORDS = 16, BATCH = 128, ROOM = BATCH + 32 * WORDS + LANES, AHEAD = 2 };

// Edges of several rows and axes, in the order of their vertices: the lower node, the axis, and whether the
// vertex's cell is one before along y and z; the node in the volume and the step to the other; the cell, as
// if it were the one at the node
struct Edges {
    int i[ROOM], j[ROOM], k[ROOM], axis[ROOM], back_y[ROOM], back_z[ROOM];
    long long at[ROOM], step[ROOM], cell[ROOM];
};

// What all edges of a row along an axis have
struct Row {
    int j, k, axis, back_y, back_z, border, last;
    long long at, step, cell;
};

// Append edges at nodes `first` + codes of a row, `count` of them; some more are written and count for
// nothing
static CUDA_CALLABLE void append(Edges& edges, int end, const unsigned short* codes, int count, int first,
                                 const Row& row) {
    for (int start = 0; start < count; start += LANES) {
        for (int lane = 0; lane < LANES; ++lane) {
            int n = end + start + lane, i = first + codes[start + lane];
            int along = i - row.border;
            along = along < 0 ? 0 : along > row.last ? row.last : along;
            edges.i[n] = i;
            edges.j[n] = row.j;
            edges.k[n] = row.k;
            edges.axis[n] = row.axis;
            edges.back_y[n] = row.back_y;
            edges.back_z[n] = row.back_z;
            edges.at[n] = row.at + along;
            edges.step[n] = row.step;
            edges.cell[n] = row.cell + i;
        }
    }
}

// Move the edges from `start` on to the front
static CUDA_CALLABLE void keep(Edges& edges, int start) {
    for (int lane = 0; lane < LANES; ++lane) {
        edges.i[lane] = edges.i[start + lane];
        edges.j[lane] = edges.j[start + lane];
        edges.k[lane] = edges.k[start + lane];
        edges.axis[lane] = edges.axis[start + lane];
        edges.back_y[lane] = edges.back_y[start + lane];
        edges.back_z[lane] = edges.back_z[start + lane];
        edges.at[lane] = edges.at[start + lane];
        edges.step[lane] = edges.step[start + lane];
        edges.cell[lane] = edges.cell[start + lane];
    }
}

// Return how far along its edge F is zero, between F at its ends
static CUDA_CALLABLE float crossing(double low, double high, double farthest) {
    low = low > farthest ? farthest : low < -farthest ? -farthest : low;
    high = high > farthest ? farthest : high < -farthest ? -farthest : high;
    return (float)(low / (low - high));
}

// Return one world coordinate in double precision, rounded once, as `world_coordinate` does
static CUDA_CALLABLE float coordinate(const wp::vec_t<4, wp::float64>& row, double x, double y, double z) {
    return (float)(row[0] * x + row[1] * y + row[2] * z + row[3]);
}

}  // namespace crossings

inline void place_rows(wp::array_t<wp::uint8> values, wp::int32 kind, wp::float64 isovalue, wp::float64 sign,
                       wp::float64 farthest, wp::array_t<wp::vec_t<16, wp::uint32>> inside,
                       wp::array_t<wp::vec_t<16, wp::uint32>> exists, wp::int32 is_marked,
                       wp::vec_t<3, wp::int32> nodes, wp::int32 border, wp::int32 words, wp::int32 ahead,
                       wp::int32 start, wp::int32 end, wp::array_t<wp::int64> starts,
                       wp::vec_t<4, wp::float64> to_x, wp::vec_t<4, wp::float64> to_y,
                       wp::vec_t<4, wp::float64> to_z, wp::array_t<wp::vec_t<3, wp::float32>> position_out,
                       wp::array_t<wp::int64> cell_out, wp::array_t<wp::vec_t<3, wp::float32>> local_out,
                       wp::array_t<wp::float32> crossing_out) {
    constexpr int LANES = crossings::LANES, WORDS = crossings::WORDS;
    const int nx = nodes[0], ny = nodes[1], nz = nodes[2];
    const int size[3] = {nx - 2 * border, ny - 2 * border, nz - 2 * border};
    const edge_rows::Lines lines{ITEMS(const unsigned int, inside),
                                 ITEMS(const unsigned int, exists),
                                 is_marked != 0,
                                 words,
                                 words * ny,
                                 nx};
    POINTER(const long long) first = ITEMS(const long long, starts);
    POINTER(float) positions = ITEMS(float, position_out);
    POINTER(float) locals = ITEMS(float, local_out);
    POINTER(long long) cells = ITEMS(long long, cell_out);
    POINTER(float) crossing = ITEMS(float, crossing_out);
    crossings::Edges edges;
    // the layer of the volume that is nearest to one of the border
    auto nearest = [&](int index, int count) {
        return index < border ? 0 : index - border < count ? index - border : count - 1;
    };
    const long long at = 0;
    auto read = [&](auto stored) {
        size_t vertex = (size_t)first[start];
        auto place = [&](int from, int used) {
            float t[LANES], x[LANES], y[LANES], z[LANES], u[LANES], v[LANES], w[LANES];
            long long own[LANES];
            double low[LANES], high[LANES];
            for (int lane = 0; lane < LANES; ++lane) {
                long long node = edges.at[from + lane];
                low[lane] = (double)stored[node];
                high[lane] = (double)stored[node + edges.step[from + lane]];
            }
            for (int lane = 0; lane < LANES; ++lane)
                t[lane] = crossings::crossing(sign * (low[lane] - isovalue), sign * (high[lane] - isovalue),
                                              farthest);
            for (int lane = 0; lane < LANES; ++lane) {
                const int i = edges.i[from + lane], j = edges.j[from + lane], k = edges.k[from + lane];
                const int axis = edges.axis[from + lane], back = axis != 0 && i == nx - 1;
                const double p = (double)i + (axis == 0 ? (double)t[lane] : 0.0);
                const double q = (double)j + (axis == 1 ? (double)t[lane] : 0.0);
                const double r = (double)k + (axis == 2 ? (double)t[lane] : 0.0);
                x[lane] = crossings::coordinate(to_x, p, q, r);
                y[lane] = crossings::coordinate(to_y, p, q, r);
                z[lane] = crossings::coordinate(to_z, p, q, r);
                u[lane] = axis == 0 ? t[lane] : (float)back;
                v[lane] = axis == 1 ? t[lane] : (float)edges.back_y[from + lane];
                w[lane] = axis == 2 ? t[lane] : (float)edges.back_z[from + lane];
                own[lane] = edges.cell[from + lane] - back;
            }
            auto store = [&](int count) {
                POINTER(float) position = positions + 3 * vertex;
                POINTER(float) local = locals + 3 * vertex;
                for (int lane = 0; lane < count; ++lane) {
                    position[3 * lane] = x[lane];
                    position[3 * lane + 1] = y[lane];
                    position[3 * lane + 2] = z[lane];
                }
                for (int lane = 0; lane < count; ++lane) {
                    local[3 * lane] = u[lane];
                    local[3 * lane + 1] = v[lane];
                    local[3 * lane + 2] = w[lane];
                }
                for (int lane = 0; lane < count; ++lane) cells[vertex + lane] = own[lane];
                for (int lane = 0; lane < count; ++lane) crossing[vertex + lane] = t[lane];
            };
            if (used == LANES)
                store(LANES);
            else
                store(used);
            vertex += used;
        };
        // ask for the values in the next layer that a row will take: they lie scattered
        auto fetch_layer = [&](int number) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
            if (number >= end || first[number] == first[number + 1]) return;
            const int k = number / ny, n = ahead + number * words;
            const int row_y = nearest(number - k * ny, size[1]), row_z = nearest(k + 1, size[2]);
            auto row = stored + (((long long)row_z * size[1] + row_y) * size[0] - border);
            for (int w = 0; w < words; ++w) {
                if (!edge_rows::along_z(lines, n + w)) continue;
                __builtin_prefetch(row + 32 * w);
                __builtin_prefetch(row + 32 * w + 16);
            }
#endif
        };
        int count = 0;
        for (int number = start; number < end; ++number) {
            fetch_layer(number + crossings::AHEAD);
            if (first[number] == first[number + 1]) continue;
            const int k = number / ny, j = number - k * ny, n = ahead + number * words;
            const int row_y = nearest(j, size[1]), row_z = nearest(k, size[2]);
            const long long node = ((long long)row_z * size[1] + row_y) * size[0];
            unsigned int crossed = edge_rows::crossed_words(lines, n);  // of a short row
            for (int axis = 0; axis < 3; ++axis) {
                if ((axis == 1 && j == ny - 1) || (axis == 2 && k == nz - 1)) continue;
                crossings::Row row{j, k, axis, axis != 1 && j == ny - 1, axis != 2 && k == nz - 1, border};
                row.last = axis == 0 ? size[0] - 2 : size[0] - 1;
                row.at = node;
                // a step to a virtual node leads nowhere: that is seen to afterwards
                row.step = axis == 0             ? 1
                           : axis == 1           ? row_y < size[1] - 1 ? size[0] : 0
                           : row_z < size[2] - 1 ? (long long)size[0] * size[1]
                                                 : 0;
                row.cell = ((long long)(k - row.back_z) * ny + (j - row.back_y)) * nx;
                for (int begin = 0; begin < words; begin += WORDS) {
                    if (words > WORDS) crossed = edge_rows::crossed_words(lines, n + begin);
                    unsigned short codes[32 * WORDS + 32];
                    POINTER(unsigned short) to = codes;
                    int listed = 0;
                    const int left = words - begin;
                    unsigned int near = crossed & (left < WORDS ? (1u << left) - 1u : 0xffffu);
                    for (; near; near &= near - 1) {
                        const int m = begin + (int)wp::bit_count(~near & (near - 1));
                        unsigned int bits = axis == 0   ? edge_rows::along_x(lines, n + m, m)
                                            : axis == 1 ? edge_rows::along_y(lines, n + m)
                                                        : edge_rows::along_z(lines, n + m);
                        listed += wp::bit_count(bits);
                        to = bit_lists::list_bits(bits, 32 * (m - begin), to);
                    }
                    crossings::append(edges, count, codes, listed, 32 * begin, row);
                    count += listed;
                    if (count < crossings::BATCH) continue;
                    int done = 0;
                    for (; done + LANES <= count; done += LANES) place(done, LANES);
                    crossings::keep(edges, done);
                    count -= done;
                }
            }
        }
        int done = 0;
        for (; done + LANES <= count; done += LANES) place(done, LANES);
        if (done == count) return;
        for (int n = count; n < done + LANES; ++n) edges.at[n] = edges.step[n] = 0;
        place(done, count - done);
    };
    RETURN_FROM_NODES(read)
}
