// Store quads of ordinary cells: see plain_quads.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/bits/bit_lists.h"
#include "dmc_cli/runtime/pointers.h"

inline void store_plain_quads(wp::vec_t<48, wp::uint32> edges, wp::vec_t<16, wp::uint32> forward,
                              wp::array_t<wp::vec_t<16, wp::uint32>> ordinary, wp::array_t<wp::int32> rank,
                              wp::int32 at, wp::int32 n, wp::int32 row, wp::int32 layer, wp::int32 q,
                              wp::array_t<wp::vec_t<4, wp::int32>> quads_out) {
    struct Side {
        unsigned int cells;  // a word of them
        int first;           // the vertex of the first
    };
    auto vertex = [](const Side& side, unsigned int below) {
        return side.first + (int)wp::bit_count(side.cells & below);
    };
    auto store = [&](const Side* sides, unsigned int forward, int axis, int b, POINTER(int) quad) {
        unsigned int below = (1u << b) - 1u;
        int here = vertex(sides[0], below), low = vertex(sides[1], below);
        int front = vertex(sides[2], below), both = vertex(sides[3], below);
        int second = axis == 2 ? low : front;
        int first = axis == 0 ? both : second - 1, last = axis == 0 ? low : here - 1;
        bool is_reversed = (axis == 1) == (forward >> b & 1u);
        quad[0] = first;
        quad[1] = is_reversed ? last : second;
        quad[2] = here;
        quad[3] = is_reversed ? second : last;
    };
    POINTER(const unsigned int) cells = ITEMS(const unsigned int, ordinary) + at;
    POINTER(const int) ranks = ITEMS(const int, rank);
    const int offsets[4] = {0, row, layer, layer + row};
    auto look_up = [&](int lane, Side* sides) {
        for (int side = 0; side < 4; ++side) {
            int word = n + lane - offsets[side];
            sides[side] = Side{cells[lane - offsets[side]], ranks[word > 0 ? word : 0]};
        }
    };
    POINTER(int) quad = ITEMS(int, quads_out) + 4 * (size_t)q;
#if defined(__CUDA_ARCH__) || !defined(__clang__) || defined(DMC_AS_ON_GPU)
    for (int lane = 0; lane < 16; ++lane) {
        if (!(edges[lane] | edges[16 + lane] | edges[32 + lane])) continue;
        Side sides[4];
        look_up(lane, sides);
        for (int axis = 0; axis < 3; ++axis) {
            for (unsigned int left = edges[16 * axis + lane]; left; left &= left - 1, quad += 4) {
                store(sides, forward[lane], axis, wp::bit_count(~left & (left - 1)), quad);
            }
        }
    }
#else
    Side sides[16][4];
    unsigned short codes[3 * 16 * 32 + 32];
    POINTER(unsigned short) end = codes;
    for (int lane = 0; lane < 16; ++lane) {
        if (!(edges[lane] | edges[16 + lane] | edges[32 + lane])) continue;
        look_up(lane, sides[lane]);
        for (int axis = 0; axis < 3; ++axis) {
            end = bit_lists::list_bits(edges[16 * axis + lane], lane << 7 | axis << 5, end);
        }
    }
    for (POINTER(const unsigned short) code = codes; code < end; ++code, quad += 4) {
        store(sides[*code >> 7], forward[*code >> 7], *code >> 5 & 3, *code & 31, quad);
    }
#endif
}
