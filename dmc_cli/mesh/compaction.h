// Look at sixteen faces at once: see compaction.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

inline wp::int32 highest_corner(wp::array_t<wp::int32> corners, wp::int32 block) {
    POINTER(const int) corner = ITEMS(const int, corners) + 64 * (size_t)block;
    int highest = -1;
    for (int n = 0; n < 64; ++n) highest = corner[n] > highest ? corner[n] : highest;
    return highest;
}
