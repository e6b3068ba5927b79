// Blend values along an axis: see blending.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

// Write a row of weighted sums of `count` rows from `first` on, `step` rows apart
inline void blend_rows(wp::array_t<float> values, int first, int count, int step, wp::array_t<float> weights,
                       int at, wp::array_t<float> out, int row) {
    const int width = values.shape[1];
    POINTER(const float) weight = ROW(const float, weights, at);
    POINTER(float) sums = ROW(float, out, row);
    for (int i = 0; i < width; ++i) sums[i] = 0.0f;
    for (int t = 0; t < count; ++t) {
        POINTER(const float) from = ROW(const float, values, first + t * step);
        const float share = weight[t];
        for (int i = 0; i < width; ++i) sums[i] += share * from[i];
    }
}

// Write a row of weighted sums of `count` values each of the same row, from `starts` on
inline void blend_row(wp::array_t<float> values, wp::array_t<int> starts, int count,
                      wp::array_t<float> weights, wp::array_t<float> out, int row) {
    const int width = out.shape[1];
    POINTER(const float) from = ROW(const float, values, row);
    POINTER(const int) begin = ITEMS(const int, starts);
    POINTER(float) sums = ROW(float, out, row);
    for (int i = 0; i < width; ++i) {
        POINTER(const float) weight = ROW(const float, weights, i);
        float sum = 0.0f;
        for (int t = 0; t < count; ++t) sum += weight[t] * from[begin[i] + t];
        sums[i] = sum;
    }
}
