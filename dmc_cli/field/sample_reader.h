// Read stored values of any type: see sample_reader.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

// Return what `read` makes of a pointer at node `at` of `values`, in the type that the values have
#define RETURN_FROM_NODES(read)                                \
    switch (kind) {                                            \
        case 0:                                                \
            return read(ITEMS(const wp::uint8, values) + at);  \
        case 1:                                                \
            return read(ITEMS(const wp::int8, values) + at);   \
        case 2:                                                \
            return read(ITEMS(const wp::uint16, values) + at); \
        case 3:                                                \
            return read(ITEMS(const wp::int16, values) + at);  \
        case 4:                                                \
            return read(ITEMS(const wp::uint32, values) + at); \
        case 5:                                                \
            return read(ITEMS(const wp::int32, values) + at);  \
        case 6:                                                \
            return read(ITEMS(const float, values) + at);      \
        default:                                               \
            return read(ITEMS(const double, values) + at);     \
    }

inline double value_at(wp::array_t<wp::uint8> values, int kind, wp::int64 at) {
    auto read = [&](auto nodes) { return (double)*nodes; };
    RETURN_FROM_NODES(read)
}

inline wp::vec_t<8, double> cell_at(wp::array_t<wp::uint8> values, int kind, wp::int64 at, wp::int64 row,
                                    wp::int64 layer) {
    auto read = [&](auto nodes) {
        wp::vec_t<8, double> corners;
        for (int c = 0; c < 8; ++c)
            corners[c] = (double)nodes[(c & 1) + (c >> 1 & 1) * row + (c >> 2) * layer];
        return corners;
    };
    RETURN_FROM_NODES(read)
}

inline wp::vec_t<64, double> cube_at(wp::array_t<wp::uint8> values, int kind, wp::vec_t<4, wp::int64> x,
                                     wp::vec_t<4, wp::int64> y, wp::vec_t<4, wp::int64> z) {
    const wp::int64 at = 0;
    auto read = [&](auto nodes) {
        wp::vec_t<64, double> cube;
        for (int n = 0; n < 64; ++n) cube[n] = (double)nodes[x[n & 3] + y[n >> 2 & 3] + z[n >> 4]];
        return cube;
    };
    RETURN_FROM_NODES(read)
}

// Read LENGTH values in a row from each of sixteen nodes; as many of them as MOST bytes hold are read as one
// word, which is taken apart in vectors
template <int LENGTH, int MOST>
wp::vec_t<16 * LENGTH, double> read_rows(wp::array_t<wp::uint8> values, int kind, wp::int64 at,
                                         wp::vec_t<16, wp::int32> offsets) {
    auto read = [&](auto nodes) {
        wp::vec_t<16 * LENGTH, double> lanes;
#if defined(__clang__) && !defined(__CUDA_ARCH__)
        auto first = [&] { return *nodes; };  // not read: the first node may lie outside
        typedef decltype(first()) value_t;
        typedef value_t values_t __attribute__((ext_vector_type(16)));
        typedef double doubles_t __attribute__((ext_vector_type(16)));
        auto unpack = [&](auto word, auto part) {
            typedef decltype(word) words_t __attribute__((ext_vector_type(16)));
            typedef decltype(part) parts_t __attribute__((ext_vector_type(16)));
            const int count = sizeof(word) / sizeof(value_t);
            for (int begin = 0; begin < LENGTH; begin += count) {
                words_t words;
                for (int lane = 0; lane < 16; ++lane) {
                    __builtin_memcpy(&word, RUN(nodes + offsets[lane] + begin, count), sizeof(word));
                    words[lane] = word;
                }
                for (int n = 0; n < count; ++n) {
                    words_t shifted = words >> (decltype(word))(8 * sizeof(value_t) * n);
                    parts_t parts = __builtin_convertvector(shifted, parts_t);
                    doubles_t numbers =
                        __builtin_convertvector(__builtin_bit_cast(values_t, parts), doubles_t);
                    __builtin_memcpy(RUN(COMPONENTS(double, lanes) + 16 * (begin + n), 16), &numbers,
                                     sizeof(numbers));
                }
            }
        };
        constexpr int row = sizeof(value_t) * LENGTH;
        constexpr int size = row < MOST ? row : MOST;
        if constexpr (size > sizeof(value_t)) {
            if constexpr (sizeof(value_t) == 1 && size == 2)
                unpack((unsigned short)0, (unsigned char)0);
            else if constexpr (sizeof(value_t) == 1)
                unpack((unsigned int)0, (unsigned char)0);
            else if constexpr (sizeof(value_t) == 2 && size == 4)
                unpack((unsigned int)0, (unsigned short)0);
            else if constexpr (sizeof(value_t) == 2)
                unpack((unsigned long long)0, (unsigned short)0);
            else
                unpack((unsigned long long)0, (unsigned int)0);
            return lanes;
        }
#endif
        for (int n = 0; n < LENGTH; ++n)
            for (int lane = 0; lane < 16; ++lane) lanes[16 * n + lane] = (double)nodes[offsets[lane] + n];
        return lanes;
    };
    RETURN_FROM_NODES(read)
}

inline unsigned int bits_at_least(wp::array_t<wp::uint8> values, int kind, wp::int64 at, int count,
                                  double threshold) {
    auto read = [&](auto nodes) {
        auto first = [&] { return *nodes; };  // not read: there may be none
        const auto level = (decltype(first()))threshold;
        unsigned int bits = 0;
        for (int b = 0; b < count; ++b) bits |= (unsigned int)(nodes[b] >= level) << b;
        return bits;
    };
    RETURN_FROM_NODES(read)
}

inline unsigned int finite_bits(wp::array_t<wp::uint8> values, int kind, wp::int64 at, int count) {
    auto read = [&](auto nodes) {
        unsigned int bits = 0;
        for (int b = 0; b < count; ++b) bits |= (unsigned int)(nodes[b] * 0 == 0) << b;
        return bits;
    };
    RETURN_FROM_NODES(read)
}

inline bool compare_row(wp::array_t<wp::uint8> values, int kind, wp::int64 at, int count, double threshold,
                        wp::array_t<wp::uint32> out, int row) {
    auto read = [&](auto nodes) {
        auto first = [&] { return *nodes; };  // not read: there may be none
        const auto level = (decltype(first()))threshold;
        POINTER(unsigned int) words = ROW(unsigned int, out, row);
        int done = 0;
        bool is_finite = true;
#if defined(__clang__) && !defined(__CUDA_ARCH__)
        typedef decltype(level) values_t __attribute__((ext_vector_type(32), aligned(1)));
        typedef bool bits_t __attribute__((ext_vector_type(32)));
        values_t zeros = 0;
        for (; done + 32 <= count; done += 32) {
            for (int line = 0; line < (int)sizeof(values_t); line += 64)
                __builtin_prefetch(nodes + done + (line + 4096) / (int)sizeof(level));
            values_t word = *(const values_t*)RUN(nodes + done, 32);
            bits_t is_above = __builtin_convertvector(word >= level, bits_t);
            words[done / 32] = __builtin_bit_cast(unsigned int, is_above);
            zeros += word * (decltype(level))0;
        }
        for (int b = 0; b < 32; ++b) is_finite &= zeros[b] == 0;
#endif
        for (; done < count; done += 32) {
            unsigned int bits = 0;
            for (int b = 0; b < 32 && done + b < count; ++b) {
                bits |= (unsigned int)(nodes[done + b] >= level) << b;
                is_finite &= nodes[done + b] * (decltype(level))0 == 0;
            }
            words[done / 32] = bits;
        }
        return is_finite;
    };
    RETURN_FROM_NODES(read)
}

inline void prefetch_cell(wp::array_t<wp::uint8> values, int kind, wp::int64 at, wp::int64 row,
                          wp::int64 layer) {
    auto read = [&](auto nodes) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)
        __builtin_prefetch(nodes);
        __builtin_prefetch(nodes + row);
        __builtin_prefetch(nodes + layer);
        __builtin_prefetch(nodes + row + layer);
#endif
    };
    RETURN_FROM_NODES(read)
}
