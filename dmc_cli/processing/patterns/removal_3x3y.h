// Count by several threads: see removal_3x3y.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

inline void lower_valence(wp::array_t<wp::int32> valence, wp::int32 v) {
#if defined(__CUDA_ARCH__)
    atomicSub(RUN(ITEMS(int, valence) + v, 1), 1);
#elif defined(__clang__)
    __atomic_fetch_sub(RUN(ITEMS(int, valence) + v, 1), 1, __ATOMIC_RELAXED);
#endif
}
