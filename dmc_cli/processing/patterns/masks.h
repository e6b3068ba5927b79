// Find the patterns of simplification, 32 quads at once: see masks.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

// Return a bit for each of the `count` quads from 32 `word` on, 32 at most: whether its valences have the
// pattern, 3-3-3-3 if ALL_THREE, else 3-X-3-Y
template <int ALL_THREE>
wp::uint32 find_pattern(wp::array_t<wp::int32> corners, wp::array_t<wp::int32> valence, wp::int32 word,
                        wp::int32 count) {
    POINTER(const int) corner = ITEMS(const int, corners) + 128 * (size_t)word;
    POINTER(const int) valences = ITEMS(const int, valence);
    auto bit = [&](int n) {
        int a = valences[corner[4 * n]], b = valences[corner[4 * n + 1]];
        int c = valences[corner[4 * n + 2]], d = valences[corner[4 * n + 3]];
        bool is_found;
        if (ALL_THREE) {
            is_found = (a == 3) & (b == 3) & (c == 3) & (d == 3);
        } else {
            is_found =
                ((a == 3) & (c == 3) & (b >= 5) & (d >= 5)) | ((b == 3) & (d == 3) & (a >= 5) & (c >= 5));
        }
        return (unsigned int)is_found << n;
    };
    unsigned int bits = 0;
    if (count >= 32) {
        for (int n = 0; n < 32; ++n) bits |= bit(n);
    } else {
        for (int n = 0; n < count; ++n) bits |= bit(n);
    }
    return bits;
}
