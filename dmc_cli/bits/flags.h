// Look at 32 flags at once: see flags.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

inline wp::uint32 flagged(wp::array_t<wp::uint8> flags, wp::int32 start, wp::int32 span, wp::int32 wanted) {
    POINTER(const unsigned char) flag = ITEMS(const unsigned char, flags) + start;
    const int remaining = (int)flags.shape[0] - start;
    unsigned int items = 0;
    if (span == 32 && remaining >= 32) {
        for (int n = 0; n < 32; ++n) items |= (unsigned int)((flag[n] & wanted) != 0) << n;
    } else {
        for (int n = 0; n < (remaining < span ? remaining : span); ++n)
            items |= (unsigned int)((flag[n] & wanted) != 0) << n;
    }
    return items;
}
