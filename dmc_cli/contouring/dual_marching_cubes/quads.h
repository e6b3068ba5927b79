// Look at a word of a line: see quads.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

inline wp::uint32 word_at(wp::array_t<wp::vec_t<16, wp::uint32>> line, wp::int32 at) {
    return ITEMS(const unsigned int, line)[at];
}
