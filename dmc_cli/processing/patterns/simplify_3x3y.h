// Choose quads that go at once: see simplify_3x3y.py.
#pragma once
#include "builtin.h"

template <unsigned int KEY_FACTOR>
bool comes_first(wp::array_t<wp::int32> twin, wp::array_t<wp::uint8> state, wp::int32 q) {
    const int* twins = (const int*)twin.data;
    const unsigned char* may_go = (const unsigned char*)state.data;
    auto is_before = [&](int other) {
        return may_go[other] & ((unsigned int)other * KEY_FACTOR < (unsigned int)q * KEY_FACTOR);
    };
    int before = 0;
    for (int c = 0; c < 4; ++c) {
        int t = twins[4 * (size_t)q + c];
        before |= is_before(t >> 2);
        for (int step = 1; step < 4; ++step) before |= is_before(twins[(t & ~3) | ((t + step) & 3)] >> 2);
    }
    return before == 0;
}
