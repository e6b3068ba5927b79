// Store a halfedge and the valence of plain vertices: see plain_rings.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

inline void store_plain_rings(wp::array_t<wp::vec_t<4, wp::uint32>> words, wp::int32 n, wp::int32 row,
                              wp::int32 layer, wp::uint32 ordinary, wp::int32 v, wp::uint32 inside,
                              wp::uint32 inside_y, wp::uint32 inside_z, wp::uint32 inside_yz,
                              wp::array_t<wp::int32> halfedge_out, wp::array_t<wp::int32> valence_out) {
    typedef unsigned int bits_t;
    const bits_t none[4] = {0, 0, 0, 0};
    POINTER(const bits_t) here = ITEMS(const bits_t, words) + 4 * (size_t)n;
    POINTER(const bits_t) y = here + 4 * row;
    POINTER(const bits_t) z = here + 4 * layer;
    POINTER(const bits_t) yz = z + 4 * row;
    bool is_last = (n + 1) % row == 0;
    auto next = [&](POINTER(const bits_t) word, int axis) {
        return word[axis] >> 1 | (is_last ? (POINTER(const bits_t))none : word + 4)[axis] << 31;
    };
    auto digit = [](bits_t a, bits_t b, bits_t c) { return a ^ b ^ c; };
    auto carry = [](bits_t a, bits_t b, bits_t c) { return (a & b) | (c & (a ^ b)); };
    bits_t y_after = next(here, 1), yz_after = next(z, 1), z_after = next(here, 2), zy_after = next(y, 2);
    bits_t a = digit(here[0], y[0], z[0]), b = digit(yz[0], here[1], z[1]);
    bits_t c = digit(y_after, yz_after, here[2]), d = digit(y[2], z_after, zy_after);
    bits_t some = digit(a, b, c), ones = some ^ d;
    bits_t e = carry(here[0], y[0], z[0]), f = carry(yz[0], here[1], z[1]);
    bits_t g = carry(y_after, yz_after, here[2]), h = carry(y[2], z_after, zy_after);
    bits_t i = carry(a, b, c), j = some & d;
    bits_t k = digit(e, f, g), l = digit(h, i, j), twos = k ^ l;
    bits_t m = carry(e, f, g), o = carry(h, i, j), p = k & l;
    bits_t fours = digit(m, o, p), eights = carry(m, o, p);

    // candidates in their order: their quads, the first one's number, which normals are forward
    const bits_t planes[8] = {here[0], y[0], z[0], yz[0], here[1], z[1], here[2], y[2]};
    const bits_t forward[8] = {inside, inside_y, inside_z, inside_yz, inside, inside_z, inside, inside_y};
    bits_t ahead = wp::bit_count(here[0]);
    const bits_t firsts[8] = {here[3],
                              y[3],
                              z[3],
                              yz[3],
                              here[3] + ahead,
                              z[3] + wp::bit_count(z[0]),
                              here[3] + ahead + wp::bit_count(here[1]),
                              y[3] + wp::bit_count(y[0]) + wp::bit_count(y[1])};
    const int corners = 2 << 0 | 3 << 2 | 1 << 4 | 0 << 6 | 2 << 8 | 3 << 10 | 2 << 12 | 1 << 14;
    bits_t left = ordinary, choice[3] = {0, 0, 0};
    for (int n = 0; n < 8; ++n) {
        bits_t chosen = n < 7 ? left & planes[n] : left;
        left &= ~chosen;
        for (int digit = 0; digit < 3; ++digit) choice[digit] |= n >> digit & 1 ? chosen : 0u;
    }
    POINTER(int) halfedge = ITEMS(int, halfedge_out) + v;
    POINTER(int) valence = ITEMS(int, valence_out) + v;
    for (left = ordinary; left; left &= left - 1) {
        int bit = wp::bit_count(~left & (left - 1));
        int n = (choice[0] >> bit & 1) | (choice[1] >> bit & 1) << 1 | (choice[2] >> bit & 1) << 2;
        int q = (int)firsts[n] + wp::bit_count(planes[n] & ((1u << bit) - 1u));
        int corner = corners >> 2 * n & 3;
        *halfedge++ = 4 * q + (forward[n] >> bit & 1 ? corner : -corner & 3);
        int low = (ones >> bit & 1) | (twos >> bit & 1) << 1;
        *valence++ = low | (fours >> bit & 1) << 2 | (eights >> bit & 1) << 3;
    }
}
