// Reach beside arrays: see broken.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/runtime/pointers.h"

inline wp::int32 read_item(wp::array_t<wp::int32> items, wp::int32 at) {
    POINTER(const int) item = ITEMS(const int, items);
    return item[at];
}

inline wp::int32 read_run(wp::array_t<wp::int32> items, wp::int32 at) {
    int word[2];
    __builtin_memcpy(word, RUN(ITEMS(const int, items) + at, 2), sizeof(word));
    return word[1];
}

inline void write_row(wp::array_t<wp::int32> rows, wp::int32 at) {
    POINTER(int) row = ROW(int, rows, 1);
    row += at;
    *row++ = 1;
}

inline wp::int32 read_list(wp::int32 at) {
    int list[4] = {at, at, at, at};
    return list[at];
}
