// Colour the quads of rows of nodes: see color_words.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

namespace color_words {

// Give quad q the lowest colour that no neighbour has
static CUDA_CALLABLE void take_free(POINTER(const int) twins, POINTER(unsigned char) color, int q) {
    POINTER(const int) t = twins + 4 * (size_t)q;
    unsigned int taken = 0;  // where there is no neighbour: its own colour, which is no low one
    for (int c = 0; c < 4; ++c) taken |= 1u << color[t[c] < 0 ? q : t[c] >> 2];
    color[q] = (unsigned char)wp::bit_count((~taken & (taken + 1u)) - 1u);
}

}  // namespace color_words

inline void color_row(wp::array_t<wp::vec_t<4, wp::uint32>> words, wp::int32 row, wp::int32 group,
                      wp::array_t<wp::uint8> colors_out) {
    POINTER(const unsigned int) word = ITEMS(const unsigned int, words) + 4 * (size_t)row * words.shape[1];
    POINTER(unsigned char) color = ITEMS(unsigned char, colors_out);
    for (int w = 0; w < words.shape[1]; ++w, word += 4) {
        if (!(word[0] | word[1] | word[2])) continue;
        POINTER(unsigned char) next = color + word[3];
        for (int axis = 0; axis < 3; ++axis) {
            for (unsigned int left = word[axis]; left; left &= left - 1) {
                int odd = (left & (0u - left) & 0xAAAAAAAAu) != 0;
                *next++ = (unsigned char)(6 * group + axis + 3 * odd);
            }
        }
    }
}

inline void reduce_row(wp::array_t<wp::vec_t<4, wp::uint32>> words, wp::array_t<wp::int32> twin,
                       wp::int32 row, wp::int32 group, wp::array_t<wp::uint8> colors_inout) {
    POINTER(const int) twins = ITEMS(const int, twin);
    POINTER(unsigned char) color = ITEMS(unsigned char, colors_inout);
    POINTER(const unsigned int) start = ITEMS(const unsigned int, words) + 4 * (size_t)row * words.shape[1];

    auto reduce = [&](int w, int odd) {
        POINTER(const unsigned int) word = start + 4 * w;
        unsigned int before = word[3];
        for (int axis = 0; axis < 3; ++axis) {
            unsigned int all = word[axis], left = all & (odd ? 0xAAAAAAAAu : 0x55555555u);
            if (6 * group + 3 * odd + axis < 5) left = 0;
            for (; left; left &= left - 1) {
                int q = (int)before + wp::bit_count(all & ((left ^ (left - 1)) >> 1));
                color_words::take_free(twins, color, q);
            }
            before += wp::bit_count(all);
        }
    };
    int ends = words.shape[1], waits = -1;
    for (int w = 0; w < ends; ++w) {
        POINTER(const unsigned int) word = start + 4 * w;
        if (!(word[0] | word[1] | word[2])) continue;
        reduce(w, 0);
        if (waits >= 0) reduce(waits, 1);
        waits = w;
    }
    if (waits >= 0) reduce(waits, 1);
}

inline void retry_quads(wp::array_t<wp::int32> twin, wp::int32 start, wp::int32 count,
                        wp::array_t<wp::uint8> colors_inout) {
    POINTER(const int) twins = ITEMS(const int, twin);
    POINTER(unsigned char) color = ITEMS(unsigned char, colors_inout) + start;
    unsigned long long last = 0;
    if (count == 64) {
        for (int n = 0; n < 64; ++n) last |= (unsigned long long)(color[n] == 4) << n;
    } else {
        for (int n = 0; n < count; ++n) last |= (unsigned long long)(color[n] == 4) << n;
    }
    color -= start;

    for (; last; last &= last - 1) {
        int q = start + wp::bit_count((wp::uint64)(~last & (last - 1)));
        color_words::take_free(twins, color, q);
    }
}
