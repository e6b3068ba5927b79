// Load and store sixteen cells and points: see simd_cells.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

inline wp::vec_t<16, wp::float64> load_cells(wp::array_t<wp::int64> cells, wp::int32 start, wp::int32 size) {
    POINTER(const long long) first = ITEMS(const long long, cells) + start;
    wp::vec_t<16, double> numbers;
    if (size == 16) {
        for (int lane = 0; lane < 16; ++lane) numbers[lane] = (double)first[lane];
    } else {
        for (int lane = 0; lane < 16; ++lane) numbers[lane] = (double)first[lane < size ? lane : size - 1];
    }
    return numbers;
}

inline void store_points(wp::vec_t<16, wp::float32> x, wp::vec_t<16, wp::float32> y,
                         wp::vec_t<16, wp::float32> z, wp::int32 start, wp::int32 size,
                         wp::array_t<wp::vec_t<3, wp::float32>> out) {
    POINTER(float) points = ITEMS(float, out) + 3 * (size_t)start;
    if (size == 16) {
        for (int lane = 0; lane < 16; ++lane) {
            points[3 * lane] = x[lane];
            points[3 * lane + 1] = y[lane];
            points[3 * lane + 2] = z[lane];
        }
    } else {
        for (int lane = 0; lane < size; ++lane) {
            points[3 * lane] = x[lane];
            points[3 * lane + 1] = y[lane];
            points[3 * lane + 2] = z[lane];
        }
    }
}

inline wp::vec_t<48, wp::float32> load_points(wp::array_t<wp::vec_t<3, wp::float32>> points, wp::int32 start,
                                              wp::int32 size) {
    POINTER(const float) first = ITEMS(const float, points) + 3 * (size_t)start;
    wp::vec_t<48, float> lanes;
    for (int lane = 0; lane < 16; ++lane) {
        POINTER(const float) point = first + 3 * (lane < size ? lane : size - 1);
        lanes[lane] = point[0];
        lanes[16 + lane] = point[1];
        lanes[32 + lane] = point[2];
    }
    return lanes;
}
