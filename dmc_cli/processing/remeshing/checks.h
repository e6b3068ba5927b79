// Judge the ring of quads round a vertex: see checks.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

template <int MOST_VALENCE>
inline wp::bool is_ring_sound(wp::array_t<wp::int32> corners, wp::array_t<wp::int32> twin, wp::int32 v,
                              wp::int32 start, wp::int32 size) {
    if (size < 3 || size > MOST_VALENCE) return false;
    POINTER(const int) corner = ITEMS(const int, corners);
    int others[2 * MOST_VALENCE];
    int h = start;
    for (int n = 0; n < size; ++n) {
        if (corner[h] != v || (n > 0 && h == start)) return false;
        const int first = h & ~3;
        others[2 * n] = corner[first | ((h + 1) & 3)];
        others[2 * n + 1] = corner[first | ((h + 2) & 3)];
        h = ITEMS(const int, twin)[first | ((h + 3) & 3)];
    }
    bool is_sound = h == start;
    for (int m = 0; m < 2 * size; ++m) {
        is_sound &= others[m] != v;
        for (int n = 0; n < m; ++n) is_sound &= others[n] != others[m];
    }
    return is_sound;
}
