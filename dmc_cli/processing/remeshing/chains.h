// Draw numbers and look for rotations: see chains.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

namespace numbers {
static CUDA_CALLABLE unsigned int hash(unsigned int number) {
    const unsigned int state = number * 747796405u + 2891336453u;
    const unsigned int word = ((state >> ((state >> 28) + 4)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}
}  // namespace numbers

inline wp::uint32 scrambled(wp::uint32 number) {
    // The permuted congruential generator's 32-bit hash (O'Neill 2014)
    return numbers::hash(number);
}

template <int ASCENT, int TIES>
inline wp::int32 cheapest_rotation(wp::array_t<wp::int32> corners, wp::array_t<wp::int32> twin,
                                   wp::array_t<wp::int32> valence, wp::array_t<wp::int32> vertex_region,
                                   wp::array_t<wp::int32> vertex_halfedge, wp::array_t<wp::uint8> vertex_gone,
                                   wp::array_t<wp::int32> core, wp::int32 touched,
                                   wp::array_t<wp::int32> chain, wp::int32 linked, wp::int32 b,
                                   wp::int32 change, wp::uint32 number) {
    POINTER(const int) corner = ITEMS(const int, corners);
    POINTER(const int) twins = ITEMS(const int, twin);
    POINTER(const int) valences = ITEMS(const int, valence);
    POINTER(const int) region = ITEMS(const int, vertex_region);
    POINTER(const int) vertices = ROW(const int, core, b);
    POINTER(const int) rotated = ROW(const int, chain, b);
    unsigned int draw = number;
    int best = ASCENT * TIES + TIES, found = -1;
    for (int n = 0; n < touched; ++n) {
        const int v = vertices[n];
        if (ITEMS(const wp::uint8, vertex_gone)[v] || valences[v] == 4) continue;
        int h = ITEMS(const int, vertex_halfedge)[v];
        for (int ring = valences[v]; ring > 0; --ring) {
            const int first = h & ~3;
            int more[4];  // quads round a corner, more than 3; none where the edge there must stay
            bool is_own[4];
            for (int c = 0; c < 4; ++c) {
                const int w = corner[first + c];
                more[c] = valences[w] - 3;
                is_own[c] = region[w] == b;
            }
            for (int c = 0; c < 4; ++c) {
                const int next = (c + 1) & 3;
                if (more[c] <= 0 || more[next] <= 0 || !is_own[c] || !is_own[next]) continue;
                const int side = first + c, t = twins[side];
                for (int forward = 0; forward < 2; ++forward) {
                    const int ahead = (c + 3 - forward) & 3, far = (t & ~3) | ((t + 3 - forward) & 3);
                    const int cost =
                        4 - 2 * (more[c] + more[next] - more[ahead] - (valences[corner[far]] - 3));
                    if (cost > ASCENT) continue;
                    ++draw;
                    const int key = cost * TIES + (int)(numbers::hash(draw) & (TIES - 1));
                    if (key >= best) continue;
                    bool is_known = false;
                    for (int m = 0; m < linked; ++m) is_known |= (rotated[m] == side) | (rotated[m] == t);
                    if (is_known) continue;
                    best = key;
                    found = 2 * side + forward;
                }
            }
            h = twins[(h & ~3) | ((h + 3) & 3)];
        }
    }
    return change + best / TIES > ASCENT ? -1 : found;
}
