// Take values and differences at the corners of sixteen cells: see corner_gradients.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

// The rows are those of the cell's corners, four values each; the pairs lie beyond them along y and z
inline wp::vec_t<512, wp::float32> corner_lanes(
    wp::vec_t<64, wp::float64> row00, wp::vec_t<64, wp::float64> row10, wp::vec_t<64, wp::float64> row01,
    wp::vec_t<64, wp::float64> row11, wp::vec_t<32, wp::float64> before0, wp::vec_t<32, wp::float64> after0,
    wp::vec_t<32, wp::float64> before1, wp::vec_t<32, wp::float64> after1, wp::vec_t<32, wp::float64> below0,
    wp::vec_t<32, wp::float64> below1, wp::vec_t<32, wp::float64> above0, wp::vec_t<32, wp::float64> above1,
    wp::float64 sign, wp::float64 isovalue) {
    wp::vec_t<512, float> lanes;
    POINTER(float) out = COMPONENTS(float, lanes);
    int lane = 0;
    const float least = -1.0e-30f;  // stands for a negative number too small for float32
#if defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
    typedef double number_t __attribute__((ext_vector_type(16)));
    typedef float single_t __attribute__((ext_vector_type(16)));
    typedef int mask_t __attribute__((ext_vector_type(16)));
    auto load = [&](POINTER(double) first) {
        number_t found;
        __builtin_memcpy(&found, RUN(first, 16), sizeof(found));
        return found;
    };
    auto store = [&](int at, single_t found) {
        __builtin_memcpy(RUN(out + 16 * at, 16), &found, sizeof(found));
    };
    auto narrow = [&](number_t a) { return __builtin_convertvector(a, single_t); };
    auto below_zero = [&](number_t f) {
        single_t rounded = narrow(f);
        mask_t is_below = __builtin_convertvector(f < 0.0, mask_t);
        single_t lower = rounded < least ? rounded : (single_t)least;
        return is_below ? lower : rounded;
    };
    const int blocks = 1;
#else
    typedef double number_t;
    auto load = [&](POINTER(double) first) { return first[lane]; };
    auto store = [&](int at, float found) { out[16 * at + lane] = found; };
    auto narrow = [&](double a) { return (float)a; };
    auto below_zero = [&](double f) {
        float rounded = (float)f;
        return f < 0.0 && !(rounded < least) ? least : rounded;
    };
    const int blocks = 16;
#endif
    for (int block = 0; block < blocks; ++block) {
        auto put_step = [&](int at, number_t low, number_t high) { store(at, narrow(0.5 * (high - low))); };
        auto put_row = [&](int r, POINTER(double) row) {
            number_t v0 = load(row), v1 = load(row + 16), v2 = load(row + 32), v3 = load(row + 48);
            store(2 * r, below_zero(sign * (v1 - isovalue)));
            store(2 * r + 1, below_zero(sign * (v2 - isovalue)));
            put_step(8 + 2 * r, v0, v2);
            put_step(8 + 2 * r + 1, v1, v3);
        };
        auto put_pair = [&](int at, POINTER(double) low, POINTER(double) high) {
            put_step(at, load(low), load(high));
            put_step(at + 1, load(low + 16), load(high + 16));
        };
        POINTER(double)
        rows[4] = {COMPONENTS(double, row00), COMPONENTS(double, row10), COMPONENTS(double, row01),
                   COMPONENTS(double, row11)};
        for (int r = 0; r < 4; ++r) put_row(r, rows[r]);
        put_pair(16, COMPONENTS(double, before0), rows[1] + 16);
        put_pair(18, rows[0] + 16, COMPONENTS(double, after0));
        put_pair(20, COMPONENTS(double, before1), rows[3] + 16);
        put_pair(22, rows[2] + 16, COMPONENTS(double, after1));
        put_pair(24, COMPONENTS(double, below0), rows[2] + 16);
        put_pair(26, COMPONENTS(double, below1), rows[3] + 16);
        put_pair(28, rows[0] + 16, COMPONENTS(double, above0));
        put_pair(30, rows[1] + 16, COMPONENTS(double, above1));
        ++lane;
    }
    return lanes;
}
