// Ask for memory ahead of its use: see prefetch.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

inline void prefetch_neighbors(wp::array_t<wp::int32> corners, wp::array_t<wp::int32> twin, wp::int32 q) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)

    POINTER(const int) t = ITEMS(const int, twin) + 4 * (size_t)q;
    for (int c = 0; c < 4; ++c) {
        __builtin_prefetch(ITEMS(const int, corners) + (t[c] & ~3));
        __builtin_prefetch(ITEMS(const int, twin) + (t[c] & ~3));
    }

#endif
}

inline void prefetch_onward(wp::array_t<wp::int32> quads, wp::array_t<wp::int32> twin, wp::int32 n) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)

    POINTER(const int) listed = ITEMS(const int, quads);
    if (n + 16 < quads.shape[0]) {
        __builtin_prefetch(ITEMS(const int, twin) + 4 * (size_t)listed[n + 16]);
        POINTER(const int) t = ITEMS(const int, twin) + 4 * (size_t)listed[n + 8];
        for (int c = 0; c < 4; ++c) __builtin_prefetch(ITEMS(const int, twin) + (t[c] & ~3));
    }

#endif
}

inline void prefetch_vertices(wp::array_t<wp::int32> corners, wp::array_t<wp::vec_t<3, wp::float32>> position,
                              wp::array_t<wp::int64> cell, wp::array_t<wp::vec_t<3, wp::float32>> local,
                              wp::int32 q) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)

    POINTER(const int) corner = ITEMS(const int, corners) + 4 * (size_t)q;
    for (int c = 0; c < 4; ++c) {
        __builtin_prefetch(ITEMS(const float, position) + 3 * (size_t)corner[c]);
        __builtin_prefetch(ITEMS(const float, local) + 3 * (size_t)corner[c]);
        __builtin_prefetch(ITEMS(const long long, cell) + corner[c]);
    }

#endif
}

inline void prefetch_surroundings(wp::array_t<wp::int32> corners, wp::array_t<wp::int32> twin,
                                  wp::array_t<wp::vec_t<3, wp::float32>> position, wp::int32 q) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)

    POINTER(const int) t = ITEMS(const int, twin) + 4 * (size_t)q;
    for (int c = 0; c < 4; ++c) {
        if (t[c] < 0) continue;
        POINTER(const int) corner = ITEMS(const int, corners) + (t[c] & ~3);
        for (int n = 2; n < 4; ++n)  // the two that the quad does not have
            __builtin_prefetch(ITEMS(const float, position) + 3 * (size_t)corner[(t[c] + n) & 3]);
    }

#endif
}
