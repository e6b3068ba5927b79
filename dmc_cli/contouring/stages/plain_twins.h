// Store twins of plain quads: see plain_twins.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

inline void store_plain_twins(wp::array_t<wp::vec_t<4, wp::uint32>> words, wp::int32 n, wp::int32 row,
                              wp::int32 layer, wp::uint32 known, wp::uint32 forward, wp::int32 q,
                              wp::array_t<wp::vec_t<4, wp::int32>> twins_out) {
    POINTER(const unsigned int) here = ITEMS(const unsigned int, words) + 4 * (size_t)n;
    POINTER(int) twin = ITEMS(int, twins_out) + 4 * (size_t)q;
    // the number of the quad from node i of the word `offset` words on; i may be in the words beside it
    auto has = [&](int offset, int i, int axis) {
        return (here[4 * (offset + (i >> 5)) + axis] >> (i & 31)) & 1u;
    };
    auto number = [&](int offset, int i, int axis) {
        POINTER(const unsigned int) word = here + 4 * (offset + (i >> 5));
        unsigned int below = (1u << (i & 31)) - 1u;
        int count = (int)word[3] + wp::bit_count(word[0] & (axis == 0 ? below : ~0u));
        count += wp::bit_count(word[1] & (axis == 0 ? 0u : axis == 1 ? below : ~0u));
        return count + wp::bit_count(word[2] & (axis == 2 ? below : 0u));
    };
    int b = 0, reversal = 0;
    auto find = [&](int side, int axis, int parallel, int parallel_i, int across, int same, int same_i,
                    int opposite, int opposite_i) {
        unsigned int is_parallel = has(parallel, parallel_i, axis), is_same = has(same, same_i, across);
        bool is_one = is_parallel + is_same + has(opposite, opposite_i, across) == 1u;
        int offset = is_same ? same : opposite, i = is_same ? same_i : opposite_i, along = across;
        offset = is_parallel ? parallel : offset;
        i = is_parallel ? parallel_i : i;
        along = is_parallel ? axis : along;
        int other = is_parallel ? side ^ 2 : is_same ? side ^ 3 : side ^ 2;
        int found = 4 * number(offset, i, along) + (other ^ reversal);
        twin[side ^ reversal] = is_one ? found : -2;
    };
    const int z = layer, y = row;
    // the same inside the word, with planes of bits and first numbers looked up once for all of its quads
    struct Plane {
        unsigned int bits;
        int first;
    };
    auto plane = [&](int offset, int axis, int shift) {
        POINTER(const unsigned int) word = here + 4 * offset;
        int first = (int)word[3] + shift;
        for (int n = 0; n < axis; ++n) first += wp::bit_count(word[n]);
        return Plane{word[axis], first};
    };
    auto pick = [&](int side, Plane parallel, int parallel_i, Plane same, int same_i, Plane opposite,
                    int opposite_i) {
        unsigned int is_parallel = parallel.bits >> parallel_i & 1u, is_same = same.bits >> same_i & 1u;
        bool is_one = is_parallel + is_same + (opposite.bits >> opposite_i & 1u) == 1u;
        unsigned int bits = is_same ? same.bits : opposite.bits;
        int first = is_same ? same.first : opposite.first;
        bits = is_parallel ? parallel.bits : bits;
        first = is_parallel ? parallel.first : first;
        int found =
            4 * (first + wp::bit_count(bits & ((1u << b) - 1u))) + (side ^ 2 ^ (int)is_same ^ reversal);
        twin[side ^ reversal] = is_one ? found : -2;
    };
    if (here[0] & known) {
        Plane a0 = plane(-z, 0, 0), a1 = plane(y, 0, 0), a2 = plane(z, 0, 0), a3 = plane(-y, 0, 0);
        Plane c0 = plane(-z, 2, 0), c1 = plane(0, 1, 0), c2 = plane(0, 2, 0), c3 = plane(-y, 1, 0);
        for (unsigned int left = here[0]; left; left &= left - 1, twin += 4) {
            b = wp::bit_count(~left & (left - 1));
            if (!(known >> b & 1)) continue;
            reversal = forward >> b & 1 ? 0 : 3;
            if (b < 31) {
                pick(0, a0, b, c0, b + 1, c0, b);
                pick(1, a1, b, c1, b, c1, b + 1);
                pick(2, a2, b, c2, b, c2, b + 1);
                pick(3, a3, b, c3, b + 1, c3, b);
            } else {
                find(0, 0, -z, b, 2, -z, b + 1, -z, b);
                find(1, 0, y, b, 1, 0, b, 0, b + 1);
                find(2, 0, z, b, 2, 0, b, 0, b + 1);
                find(3, 0, -y, b, 1, -y, b + 1, -y, b);
            }
        }
    } else {
        twin += 4 * wp::bit_count(here[0]);
    }
    if (here[1] & known) {
        Plane before = plane(0, 1, -1), after = plane(0, 1, 1), a1 = plane(z, 1, 0), a3 = plane(-z, 1, 0);
        Plane x0 = plane(0, 0, -1), xy = plane(y, 0, -1), here_x = plane(0, 0, 0), y_x = plane(y, 0, 0);
        Plane z0 = plane(0, 2, 0), zy = plane(y, 2, 0), zyz = plane(y - z, 2, 0), zz = plane(-z, 2, 0);
        for (unsigned int left = here[1]; left; left &= left - 1, twin += 4) {
            b = wp::bit_count(~left & (left - 1));
            if (!(known >> b & 1)) continue;
            reversal = forward >> b & 1 ? 0 : 3;
            if (b > 0 && b < 31) {
                pick(0, before, b - 1, xy, b - 1, x0, b - 1);
                pick(2, after, b + 1, here_x, b, y_x, b);
            } else {
                find(0, 1, 0, b - 1, 0, y, b - 1, 0, b - 1);
                find(2, 1, 0, b + 1, 0, 0, b, y, b);
            }
            pick(1, a1, b, z0, b, zy, b);
            pick(3, a3, b, zyz, b, zz, b);
        }
    } else {
        twin += 4 * wp::bit_count(here[1]);
    }
    if (here[2] & known) {
        Plane before = plane(0, 2, -1), after = plane(0, 2, 1), a0 = plane(-y, 2, 0), a2 = plane(y, 2, 0);
        Plane x0 = plane(0, 0, -1), xz = plane(z, 0, -1), here_x = plane(0, 0, 0), z_x = plane(z, 0, 0);
        Plane y0 = plane(0, 1, 0), yz = plane(z, 1, 0), yzy = plane(z - y, 1, 0), yy = plane(-y, 1, 0);
        for (unsigned int left = here[2]; left; left &= left - 1, twin += 4) {
            b = wp::bit_count(~left & (left - 1));
            if (!(known >> b & 1)) continue;
            reversal = forward >> b & 1 ? 0 : 3;
            if (b > 0 && b < 31) {
                pick(1, after, b + 1, here_x, b, z_x, b);
                pick(3, before, b - 1, xz, b - 1, x0, b - 1);
            } else {
                find(1, 2, 0, b + 1, 0, 0, b, z, b);
                find(3, 2, 0, b - 1, 0, z, b - 1, 0, b - 1);
            }
            pick(0, a0, b, yzy, b, yy, b);
            pick(2, a2, b, y0, b, yz, b);
        }
    }
}
