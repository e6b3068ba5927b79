// Cover nodes by balls: see morphology.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

// Add to a row of `out` the rows of `bits` that the steps from `first` to before `last` lead to
inline void add_rows(wp::array_t<wp::uint32> bits, wp::array_t<wp::vec2i> steps, int first, int last, int row,
                     int ny, wp::array_t<wp::uint32> out) {
    constexpr int MOST = 16;  // words of a row that stay in registers while other rows are added to them
    const int words = out.shape[1], rows = out.shape[0], k = row / ny, j = row - k * ny;
    POINTER(const wp::vec2i) step = ITEMS(const wp::vec2i, steps);
    POINTER(wp::uint32) to = ROW(wp::uint32, out, row);
    for (int w = 0; w < words; w += MOST) {
        const int count = words - w < MOST ? words - w : MOST;
        wp::uint32 sum[MOST];
        for (int n = 0; n < count; ++n) sum[n] = to[w + n];
        for (int s = first; s < last; ++s) {
            const int y = j + step[s][0], z = k + step[s][1];
            if (y < 0 || y >= ny || z < 0 || z * ny >= rows) continue;
            POINTER(const wp::uint32) from = ROW(const wp::uint32, bits, y + ny * z) + w;
            if (count == MOST) {
                for (int n = 0; n < MOST; ++n) sum[n] |= from[n];
            } else {
                for (int n = 0; n < count; ++n) sum[n] |= from[n];
            }
        }
        for (int n = 0; n < count; ++n) to[w + n] = sum[n];
    }
}
