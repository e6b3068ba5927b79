"""Colour the quads of whole rows, in C++: what a quad costs here is a few instructions.

Warp's arrays have strides, and its branches copy what they change; this took three times as long.
"""

import warp as wp

from dmc_cli.contouring.dual_marching_cubes.halfedges.quad_ranks import QuadWord

TAKE_FREE = """
    auto take_free = [&](int q) {
        const int* t = twins + 4 * (size_t)q;
        unsigned int taken = 0;  // where there is no neighbour: its own colour, which is no low one
        for (int c = 0; c < 4; ++c) taken |= 1u << color[t[c] < 0 ? q : t[c] >> 2];
        color[q] = (unsigned char)wp::bit_count((~taken & (taken + 1u)) - 1u);
    };
"""
"""C++ that gives a quad the lowest colour that no neighbour has."""


@wp.func_native(
    """
    const unsigned int* word = (const unsigned int*)words.data + 4 * (size_t)row * words.shape[1];
    unsigned char* color = (unsigned char*)colors_out.data;
    for (int w = 0; w < words.shape[1]; ++w, word += 4) {
        if (!(word[0] | word[1] | word[2])) continue;
        unsigned char* next = color + word[3];
        for (int axis = 0; axis < 3; ++axis) {
            for (unsigned int left = word[axis]; left; left &= left - 1) {
                int odd = (left & (0u - left) & 0xAAAAAAAAu) != 0;
                *next++ = (unsigned char)(6 * group + axis + 3 * odd);
            }
        }
    }
    """
)
def color_row(
    words: wp.array2d(dtype=QuadWord), row: wp.int32, group: wp.int32, colors_out: wp.array(dtype=wp.uint8)
) -> None:
    """Give the quads of a row of nodes their colours from the grid; bit 0 of a word has an even index."""
    ...


@wp.func_native(
    """
    const int* twins = (const int*)twin.data;
    unsigned char* color = (unsigned char*)colors_inout.data;
    const unsigned int* start = (const unsigned int*)words.data + 4 * (size_t)row * words.shape[1];
"""
    + TAKE_FREE
    + """
    auto reduce = [&](int w, int odd) {
        const unsigned int* word = start + 4 * w;
        unsigned int before = word[3];
        for (int axis = 0; axis < 3; ++axis) {
            unsigned int all = word[axis], left = all & (odd ? 0xAAAAAAAAu : 0x55555555u);
            if (6 * group + 3 * odd + axis < 5) left = 0;
            for (; left; left &= left - 1) {
                int q = (int)before + wp::bit_count(all & ((left ^ (left - 1)) >> 1));
                take_free(q);
            }
            before += wp::bit_count(all);
        }
    };
    int ends = words.shape[1], waits = -1;
    for (int w = 0; w < ends; ++w) {
        const unsigned int* word = start + 4 * w;
        if (!(word[0] | word[1] | word[2])) continue;
        reduce(w, 0);
        if (waits >= 0) reduce(waits, 1);
        waits = w;
    }
    if (waits >= 0) reduce(waits, 1);
    """
)
def reduce_row(
    words: wp.array2d(dtype=QuadWord),
    twin: wp.array(dtype=wp.int32),
    row: wp.int32,
    group: wp.int32,
    colors_inout: wp.array(dtype=wp.uint8),
) -> None:
    """Give the quads of the classes of a row their lowest free colour, class after class.

    Quads of even nodes are neighbours only at the same node, and so are those of odd nodes; what is odd only
    has to wait for the even nodes beside it. So a word behind is far enough.
    """
    ...


@wp.func_native(
    """
    const int* twins = (const int*)twin.data;
    unsigned char* color = (unsigned char*)colors_inout.data + start;
    unsigned long long last = 0;
    if (count == 64) {
        for (int n = 0; n < 64; ++n) last |= (unsigned long long)(color[n] == 4) << n;
    } else {
        for (int n = 0; n < count; ++n) last |= (unsigned long long)(color[n] == 4) << n;
    }
    color -= start;
    """
    + TAKE_FREE
    + """
    for (; last; last &= last - 1) {
        int q = start + wp::bit_count((wp::uint64)(~last & (last - 1)));
        take_free(q);
    }
    """
)
def retry_quads(
    twin: wp.array(dtype=wp.int32), start: wp.int32, count: wp.int32, colors_inout: wp.array(dtype=wp.uint8)
) -> None:
    """Let those of `count` quads from `start` on, 64 at most, that have colour 4 retry the others."""
    ...
