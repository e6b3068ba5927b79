// Ask for memory ahead of its use: see prefetch.py.
#pragma once
#include "builtin.h"

inline void fetch_neighbors(wp::array_t<wp::int32> corners, wp::array_t<wp::int32> twin, wp::int32 q) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)

    const int* t = (const int*)twin.data + 4 * (size_t)q;
    for (int c = 0; c < 4; ++c) {
        __builtin_prefetch((const int*)corners.data + (t[c] & ~3));
        __builtin_prefetch((const int*)twin.data + (t[c] & ~3));
    }

#endif
}

inline void fetch_onward(wp::array_t<wp::int32> quads, wp::array_t<wp::int32> twin, wp::int32 n) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)

    const int* listed = (const int*)quads.data;
    if (n + 16 < quads.shape[0]) {
        __builtin_prefetch((const int*)twin.data + 4 * (size_t)listed[n + 16]);
        const int* t = (const int*)twin.data + 4 * (size_t)listed[n + 8];
        for (int c = 0; c < 4; ++c) __builtin_prefetch((const int*)twin.data + (t[c] & ~3));
    }

#endif
}

inline void fetch_vertices(wp::array_t<wp::int32> corners, wp::array_t<wp::vec_t<3, wp::float32>> position,
                           wp::array_t<wp::int64> cell, wp::array_t<wp::vec_t<3, wp::float32>> local,
                           wp::int32 q) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)

    const int* corner = (const int*)corners.data + 4 * (size_t)q;
    for (int c = 0; c < 4; ++c) {
        __builtin_prefetch((const float*)position.data + 3 * (size_t)corner[c]);
        __builtin_prefetch((const float*)local.data + 3 * (size_t)corner[c]);
        __builtin_prefetch((const long long*)cell.data + corner[c]);
    }

#endif
}

inline void fetch_surroundings(wp::array_t<wp::int32> corners, wp::array_t<wp::int32> twin,
                               wp::array_t<wp::vec_t<3, wp::float32>> position, wp::int32 q) {
#if defined(__clang__) && !defined(__CUDA_ARCH__)

    const int* t = (const int*)twin.data + 4 * (size_t)q;
    for (int c = 0; c < 4; ++c) {
        if (t[c] < 0) continue;
        const int* corner = (const int*)corners.data + (t[c] & ~3);
        for (int n = 2; n < 4; ++n)  // the two that the quad does not have
            __builtin_prefetch((const float*)position.data + 3 * (size_t)corner[(t[c] + n) & 3]);
    }

#endif
}
