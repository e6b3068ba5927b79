// Keep the least and the greatest value of each brick of nodes: see brick_ranges.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/field/sample_reader.h"
#include "dmc_cli/runtime/pointers.h"

inline void widen_ranges(wp::array_t<wp::uint8> values, int kind, wp::int64 at, int count, bool is_first,
                         wp::array_t<double> low, wp::array_t<double> high, int row) {
    auto read = [&](auto nodes) {
        POINTER(double) lows = ROW(double, low, row);
        POINTER(double) highs = ROW(double, high, row);
        const double infinity = INFINITY;
        for (int begin = 0; begin < count; begin += 32) {
            const int length = count - begin < 32 ? count - begin : 32;
            auto least = nodes[begin];
            auto greatest = least;
            auto zero = least * 0;
            int n = 1;
#if defined(__clang__) && !defined(__CUDA_ARCH__)
            typedef decltype(least) halves_t __attribute__((ext_vector_type(16), aligned(1)));
            if (length == 32) {
                halves_t a = *(const halves_t*)RUN(nodes + begin, 16);
                halves_t b = *(const halves_t*)RUN(nodes + begin + 16, 16);
                halves_t less = b < a ? b : a, more = b < a ? a : b, zeros = a * 0 + b * 0;
                for (n = 0; n < 16; ++n) {
                    least = less[n] < least ? less[n] : least;
                    greatest = greatest < more[n] ? more[n] : greatest;
                    zero += zeros[n];
                }
                n = 32;
            }
#endif
            for (; n < length; ++n) {
                const auto value = nodes[begin + n];
                least = value < least ? value : least;
                greatest = greatest < value ? value : greatest;
                zero += value * 0;
            }
            double from = least, to = greatest;
            if (!(zero == 0)) from = -infinity, to = infinity;
            const int w = begin / 32;
            lows[w] = is_first || from < lows[w] ? from : lows[w];
            highs[w] = is_first || highs[w] < to ? to : highs[w];
        }
    };
    RETURN_FROM_NODES(read)
}

inline void compare_bricks(wp::array_t<wp::uint8> values, int kind, wp::int64 at, wp::vec_t<3, int> size,
                           wp::vec_t<2, wp::int64> step, double threshold, wp::array_t<double> low,
                           wp::array_t<double> high, int bricks, wp::array_t<wp::uint32> out, int row,
                           int layer) {
    auto read = [&](auto nodes) {
        auto first = [&] { return *nodes; };  // not read: there may be none
        const auto level = (decltype(first()))threshold;
        POINTER(const double) lows = ROW(const double, low, bricks);
        POINTER(const double) highs = ROW(const double, high, bricks);
        for (int n = 0; n < size[1] * size[2]; ++n) {
            const int j = n % size[1], k = n / size[1], count = size[0];
            auto line = nodes + (j * step[0] + k * step[1]);
            POINTER(unsigned int) words = ROW(unsigned int, out, row + j + k * layer);
            int w = 0;
#if defined(__clang__) && !defined(__CUDA_ARCH__)
            typedef decltype(level) values_t __attribute__((ext_vector_type(32), aligned(1)));
            typedef bool bits_t __attribute__((ext_vector_type(32)));
            for (; 32 * w + 32 <= count; ++w) {
                unsigned int bits = lows[w] >= threshold ? ~0u : 0;
                if (highs[w] >= threshold && lows[w] < threshold) {
                    values_t word = *(const values_t*)RUN(line + 32 * w, 32);
                    bits_t is_above = __builtin_convertvector(word >= level, bits_t);
                    bits = __builtin_bit_cast(unsigned int, is_above);
                }
                words[w] = bits;
            }
#endif
            for (; 32 * w < count; ++w) {
                unsigned int bits = 0;
                for (int b = 0; b < 32 && 32 * w + b < count; ++b)
                    bits |= (unsigned int)(line[32 * w + b] >= level) << b;
                words[w] = bits;
            }
        }
    };
    RETURN_FROM_NODES(read)
}
