// Gather sixteen cells and place their vertices: see placement.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/contouring/dual_contouring/cell_planes.h"
#include "dmc_cli/field/lanes.h"
#include "dmc_cli/field/sample_reader.h"
#include "dmc_cli/runtime/pointers.h"

inline wp::vec_t<64, wp::float32> place_block(wp::array_t<wp::uint8> values, wp::int32 kind, wp::int64 node,
                                              wp::vec_t<16, wp::int32> offsets, wp::vec_t<16, wp::int32> ends,
                                              wp::int64 row, wp::int64 layer, wp::float64 sign,
                                              wp::float64 isovalue, wp::int32 steps, wp::float32 step_size) {
    constexpr int LANES = lanes::LANES;
    typedef lanes::numbers numbers;
    typedef lanes::integers integers;
    const wp::int64 at = 0, strides[3] = {1, row, layer};
    cell_planes::Cells cells;
    // Of the lanes that are gone through at once: their ends, and from `node` to the nodes where reading
    // begins: those before their cells along each axis, and those behind; at the volume's ends there are none
    integers at_end[3][2];
    wp::int64 places[3][2][LANES];
    auto find_places = [&](int start) {
        const integers none = 0, all = lanes::load(&ends[0] + start);
        for (int axis = 0; axis < 3; ++axis)
            for (int end = 0; end < 2; ++end) {
                const int bit = 1 << (2 * axis + end);
                at_end[axis][end] = (all & bit) != none;
                const wp::int64 step = end ? strides[axis] : -strides[axis];
                for (int lane = 0; lane < LANES; ++lane)
                    places[axis][end][lane] = offsets[start + lane] + (ends[start + lane] & bit ? 0 : step);
            }
        // The four values of a row begin before a cell; at the volume's ends, with it or one node earlier
        for (int lane = 0; lane < LANES; ++lane) places[0][0][lane] -= ends[start + lane] & 2 ? 1 : 0;
    };
    auto gather = [&](auto nodes) {
        auto one = [&] { return *nodes; };  // not read: there may be none
        typedef decltype(one()) value_t;
        // Differences are taken in single precision where values of the type lie in it
        constexpr bool is_single = sizeof(value_t) < 4 || (sizeof(value_t) == 4 && (value_t)0.5f != 0);
        auto wide = [] {
            if constexpr (is_single)
                return numbers();
            else
                return lanes::doubles();
        };
        typedef decltype(wide()) wide_t;
        // Take the two or four values from nodes of the lanes on, a vector of each
#if defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
        typedef value_t two_t __attribute__((ext_vector_type(2)));
        typedef value_t four_t __attribute__((ext_vector_type(4)));
        typedef value_t eight_t __attribute__((ext_vector_type(8)));
        auto join_four = [](four_t a, four_t b) {
            return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
        };
        auto join_eight = [](eight_t a, eight_t b) {
            return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        };
        auto join = [&](four_t a, four_t b, four_t c, four_t d) {
            return join_eight(join_four(a, b), join_four(c, d));
        };
#define EVERY_SECOND(n, a, b)                                                                            \
    __builtin_shufflevector(a, b, n, n + 2, n + 4, n + 6, n + 8, n + 10, n + 12, n + 14, n + 16, n + 18, \
                            n + 20, n + 22, n + 24, n + 26, n + 28, n + 30)
        auto take_two = [&](auto first, wide_t& a, wide_t& b) {
            two_t two[16];
            four_t four[8];
            for (int lane = 0; lane < 16; ++lane)
                __builtin_memcpy(&two[lane], RUN(first(lane), 2), sizeof(two_t));
            for (int n = 0; n < 8; ++n)
                four[n] = __builtin_shufflevector(two[2 * n], two[2 * n + 1], 0, 1, 2, 3);
            auto low = join(four[0], four[1], four[2], four[3]),
                 high = join(four[4], four[5], four[6], four[7]);
            a = __builtin_convertvector(EVERY_SECOND(0, low, high), wide_t);
            b = __builtin_convertvector(EVERY_SECOND(1, low, high), wide_t);
        };
        auto take_four = [&](auto first, wide_t& a, wide_t& b, wide_t& c, wide_t& d) {
            four_t four[16];
            for (int lane = 0; lane < 16; ++lane)
                __builtin_memcpy(&four[lane], RUN(first(lane), 4), sizeof(four_t));
            auto all0 = join(four[0], four[1], four[2], four[3]),
                 all1 = join(four[4], four[5], four[6], four[7]);
            auto all2 = join(four[8], four[9], four[10], four[11]);
            auto all3 = join(four[12], four[13], four[14], four[15]);
            auto low0 = EVERY_SECOND(0, all0, all1), low1 = EVERY_SECOND(0, all2, all3);
            auto high0 = EVERY_SECOND(1, all0, all1), high1 = EVERY_SECOND(1, all2, all3);
            a = __builtin_convertvector(EVERY_SECOND(0, low0, low1), wide_t);
            b = __builtin_convertvector(EVERY_SECOND(0, high0, high1), wide_t);
            c = __builtin_convertvector(EVERY_SECOND(1, low0, low1), wide_t);
            d = __builtin_convertvector(EVERY_SECOND(1, high0, high1), wide_t);
        };
#else
        auto take_two = [&](auto first, wide_t& a, wide_t& b) {
            a = (wide_t)first(0)[0];
            b = (wide_t)first(0)[1];
        };
        auto take_four = [&](auto first, wide_t& a, wide_t& b, wide_t& c, wide_t& d) {
            take_two(first, a, b);
            take_two([&](int lane) { return first(lane) + 2; }, c, d);
        };
#endif
        const bool is_any_end = lanes::any(at_end[0][0] | at_end[0][1]);
        wide_t inner[8], outer[3][8];  // at the corners, and beyond them along each axis
        for (int r = 0; r < 4; ++r) {
            auto corner = nodes + (node + (r & 1) * row + (r >> 1) * layer);
            wide_t &before = outer[0][2 * r], &low = inner[2 * r];
            wide_t &high = inner[2 * r + 1], &behind = outer[0][2 * r + 1];
            take_four([&](int lane) { return corner + places[0][0][lane]; }, before, low, high, behind);
            if (is_any_end) {  // along x, where the four begin at the cell or two nodes before it
                const integers is_first = at_end[0][0], is_last = at_end[0][1];
                const wide_t second = low, third = high;
                low = lanes::chosen(is_first, before, lanes::chosen(is_last, third, second));
                high = lanes::chosen(is_first, second, lanes::chosen(is_last, behind, third));
                before = lanes::chosen(is_last, second, before);
                behind = lanes::chosen(is_first, third, behind);
            }
            for (int axis = 1; axis < 3; ++axis) {
                const int end = r >> (axis - 1) & 1;
                take_two([&](int lane) { return corner + places[axis][end][lane]; }, outer[axis][2 * r],
                         outer[axis][2 * r + 1]);
            }
        }
        for (int axis = 0; axis < 3; ++axis) {
            for (int c = 0; c < 8; ++c) {
                const int end = c >> axis & 1;
                const numbers whole = end ? 1.0f : -1.0f, share = at_end[axis][end] ? whole : 0.5f * whole;
                cells.slope[axis][c] = share * lanes::narrowed(outer[axis][c] - inner[c ^ (1 << axis)]);
            }
        }
        for (int c = 0; c < 8; ++c)
            cells.f[c] = cell_planes::below_zero(sign * (lanes::widened(inner[c]) - isovalue));
    };
    auto read = [&](auto nodes) { return gather(nodes); };
    auto gather_values = [&] { RETURN_FROM_NODES(read) };
    wp::vec_t<64, float> out;
    for (int start = 0; start < 16; start += LANES) {
        find_places(start);
        gather_values();
        cell_planes::place_lanes(cells, steps, step_size, &out[0] + start);
    }
    return out;
}
