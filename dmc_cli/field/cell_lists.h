// List the cells of a block of words: see cell_lists.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/bits/bit_lists.h"
#include "dmc_cli/runtime/pointers.h"

inline void store_cells(wp::vec_t<16, wp::uint32> words, wp::int32 n, wp::int32 words_a_row, wp::int32 nx,
                        wp::int32 v, wp::array_t<wp::int64> cell_out) {
    POINTER(long long) cell = ITEMS(long long, cell_out) + v;
    auto first_cell = [&](int lane) {  // of a word
        int row = (n + lane) / words_a_row;
        return (long long)row * nx + 32 * (n + lane - row * words_a_row);
    };
#if defined(__CUDA_ARCH__) || !defined(__clang__) || defined(DMC_AS_ON_GPU)
    for (int lane = 0; lane < 16; ++lane) {
        for (unsigned int left = words[lane]; left; left &= left - 1) {
            *cell++ = first_cell(lane) + wp::bit_count(~left & (left - 1));
        }
    }
#else
    long long firsts[16];
    unsigned short codes[16 * 32 + 32];
    POINTER(unsigned short) end = codes;
    for (int lane = 0; lane < 16; ++lane) {
        if (!words[lane]) continue;
        firsts[lane] = first_cell(lane);
        end = bit_lists::list_bits(words[lane], lane << 5, end);
    }
    for (POINTER(const unsigned short) code = codes; code < end; ++code)
        *cell++ = firsts[*code >> 5] + (*code & 31);
#endif
}
