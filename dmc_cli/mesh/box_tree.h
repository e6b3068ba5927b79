// Look at the boxes that are joined to one: see box_tree.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

inline wp::uint32 boxes_near(wp::array_t<wp::vec_t<3, wp::float32>> lows,
                             wp::array_t<wp::vec_t<3, wp::float32>> highs, wp::int32 start, wp::int32 count,
                             wp::vec_t<3, wp::float64> p, wp::float64 reach) {
    POINTER(const float) low = ITEMS(const float, lows) + 3 * (size_t)start;
    POINTER(const float) high = ITEMS(const float, highs) + 3 * (size_t)start;
    unsigned int found = 0;
    for (int n = 0; n < count; ++n) {
        double square = 0.0;
        for (int x = 0; x < 3; ++x) {
            const double below = low[3 * n + x] - p[x], above = p[x] - high[3 * n + x];
            const double beyond = below > above ? below : above;
            square += beyond > 0.0 ? beyond * beyond : 0.0;
        }
        found |= (unsigned int)(square < reach) << n;
    }
    return found;
}

inline wp::uint32 boxes_on_ray(wp::array_t<wp::vec_t<3, wp::float32>> lows,
                               wp::array_t<wp::vec_t<3, wp::float32>> highs, wp::int32 start, wp::int32 count,
                               wp::vec_t<3, wp::float64> p, wp::vec_t<3, wp::float64> inverse,
                               wp::float64 reach) {
    POINTER(const float) low = ITEMS(const float, lows) + 3 * (size_t)start;
    POINTER(const float) high = ITEMS(const float, highs) + 3 * (size_t)start;
    unsigned int found = 0;
    for (int n = 0; n < count; ++n) {
        double enters = 0.0, leaves = reach;
        for (int x = 0; x < 3; ++x) {
            const double below = low[3 * n + x], above = high[3 * n + x];
            const double least = below < 0.0 ? -below : below, most = above < 0.0 ? -above : above;
            const double slack = 1.0e-9 * (least > most ? least : most);
            const double to_low = (below - slack - p[x]) * inverse[x];
            const double to_high = (above + slack - p[x]) * inverse[x];
            const double near = to_low < to_high ? to_low : to_high;
            const double far = to_low < to_high ? to_high : to_low;
            enters = near > enters ? near : enters;
            leaves = far < leaves ? far : leaves;
        }
        found |= (unsigned int)(enters <= leaves) << n;
    }
    return found;
}

inline wp::uint32 boxes_meeting(wp::array_t<wp::vec_t<3, wp::float32>> lows,
                                wp::array_t<wp::vec_t<3, wp::float32>> highs, wp::int32 start,
                                wp::int32 count, wp::int32 box) {
    POINTER(const float) low = ITEMS(const float, lows) + 3 * (size_t)start;
    POINTER(const float) high = ITEMS(const float, highs) + 3 * (size_t)start;
    POINTER(const float) own_low = ITEMS(const float, lows) + 3 * (size_t)box;
    POINTER(const float) own_high = ITEMS(const float, highs) + 3 * (size_t)box;
    const float low_x = own_low[0], low_y = own_low[1], low_z = own_low[2];
    const float high_x = own_high[0], high_y = own_high[1], high_z = own_high[2];
    unsigned int found = 0;
    for (int n = 0; n < count; ++n) {
        const bool meets = (low[3 * n] <= high_x) & (low[3 * n + 1] <= high_y) & (low[3 * n + 2] <= high_z) &
                           (high[3 * n] >= low_x) & (high[3 * n + 1] >= low_y) & (high[3 * n + 2] >= low_z);
        found |= (unsigned int)meets << n;
    }
    return found;
}
