// Bring the vertices of some rows to the surface, near the middles of their edges: see surface_steps.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/contouring/macet/edge_batch.h"
#include "dmc_cli/contouring/macet/grid_values.h"
#include "dmc_cli/contouring/macet/step_lanes.h"
#include "dmc_cli/field/sample_reader.h"
#include "dmc_cli/runtime/pointers.h"

inline void settle_rows(
    wp::array_t<wp::uint8> values, wp::int32 kind, wp::float64 isovalue, wp::float64 sign,
    wp::float64 farthest, wp::float64 outside, wp::float64 at_least, wp::int32 has_nodata, wp::float64 nodata,
    wp::float64 padding_low, wp::float64 padding_high, wp::array_t<wp::vec_t<16, wp::uint32>> exists,
    wp::int32 is_marked, wp::vec_t<3, wp::int32> nodes, wp::int32 border, wp::int32 words, wp::int32 ahead,
    wp::int32 start, wp::int32 end, wp::array_t<wp::int64> starts, wp::array_t<wp::int32> along_x,
    wp::array_t<wp::int32> along_y, wp::vec_t<4, wp::float64> to_x, wp::vec_t<4, wp::float64> to_y,
    wp::vec_t<4, wp::float64> to_z, wp::array_t<wp::float32> crossing, wp::float32 reach,
    wp::array_t<wp::vec_t<4, wp::float32>> sums, wp::array_t<wp::int64> cell_inout,
    wp::array_t<wp::vec_t<3, wp::float32>> local_inout, wp::array_t<wp::vec_t<3, wp::float32>> step_inout,
    wp::array_t<wp::vec_t<3, wp::float32>> position_inout, wp::array_t<wp::uint8> state_out) {
    constexpr int LANES = steps::LANES;
    const long long row = nodes[0] - 2 * border;
    const grid_values::Source source{isovalue,
                                     sign,
                                     farthest,
                                     outside,
                                     at_least,
                                     nodata,
                                     padding_low,
                                     padding_high,
                                     has_nodata != 0,
                                     border,
                                     {nodes[0], nodes[1], nodes[2]},
                                     row,
                                     row * (nodes[1] - 2 * border)};
    const edge_batch::Cells existing{
        ITEMS(const unsigned int, exists), is_marked != 0, words, ahead, {nodes[0], nodes[1], nodes[2]}};
    const edge_batch::Vertices vertices{ITEMS(long long, cell_inout), ITEMS(float, local_inout),
                                        ITEMS(float, step_inout), ITEMS(float, position_inout),
                                        ITEMS(const float, crossing)};
    POINTER(const float) around = ITEMS(const float, sums);
    POINTER(const long long) first = ITEMS(const long long, starts);
    POINTER(const int) count_x = ITEMS(const int, along_x);
    POINTER(const int) count_y = ITEMS(const int, along_y);
    POINTER(unsigned char) states = ITEMS(unsigned char, state_out);
    const bool is_smoothing = sums.shape[0] != 0;
    const long long at = 0;
    // Write F at the corners of the lanes' cells; where single precision may not hold it, scaled
    auto load_cells = [&](const int* i, const int* j, const int* k, steps::Corners& near) {
        auto read = [&](auto stored) {
            auto one = [&] { return *stored; };  // not read: there may be none
            decltype(one()) numbers[8][LANES];
            for (int lane = 0; lane < LANES; ++lane) {
                const int x = i[lane], y = j[lane], z = k[lane];
                if (grid_values::is_outer(source, x, y, z)) {
                    for (int c = 0; c < 8; ++c)
                        numbers[c][lane] = stored[grid_values::nearest_node(source, x, y, z, c)];
                    continue;
                }
                const long long n = grid_values::lowest_node(source, x, y, z);
                for (int c = 0; c < 8; ++c)
                    numbers[c][lane] =
                        stored[n + (c & 1) + (c >> 1 & 1) * source.row + (c >> 2) * source.layer];
            }
            for (int c = 0; c < 8; ++c) {
                double wide[LANES];
                for (int lane = 0; lane < LANES; ++lane) wide[lane] = (double)numbers[c][lane];
                lanes::store(near.f[c], grid_values::distances(source, wide));
            }
            int needs_care[LANES];
            if (!grid_values::find_care(source, i, j, k, near, needs_care)) return;
            for (int lane = 0; lane < LANES; ++lane) {
                if (!needs_care[lane]) continue;
                double corners[8];
                for (int c = 0; c < 8; ++c)
                    corners[c] =
                        grid_values::value_at(source, (double)numbers[c][lane], i[lane], j[lane], k[lane], c);
                steps::store_scaled(corners, near, lane);
            }
        };
        RETURN_FROM_NODES(read)
    };
    // Move the vertices of a batch
    auto settle = [&](edge_batch::Batch& batch) {
        edge_batch::fill(batch);
        const steps::Edges edges = steps::edges_at(batch.i, batch.j, batch.k, batch.axis, batch.is_held,
                                                   nodes[0], nodes[1], nodes[2]);
        const steps::numbers none = 0.0f;
        steps::Vector before, way = {none, none, none};
        steps::Search search = steps::begin_search(way);
        if (is_smoothing) {
            way = edge_batch::ways_to_means(batch, vertices, around);
            before = search.step = edge_batch::gathered(batch, vertices.step, 3);
        } else {
            before = edge_batch::steps_to_crossings(batch, vertices, edges);
        }
        steps::Corners near = {};
        for (int n = is_smoothing ? -1 : 0; n < steps::MOST_STEPS && lanes::any(search.active); ++n) {
            if (steps::enter_cells(search, edges, reach)) {
                int i[LANES], j[LANES], k[LANES];
                lanes::store(i, search.place.i);
                lanes::store(j, search.place.j);
                lanes::store(k, search.place.k);
                load_cells(i, j, k, near);
            }
            if (n < 0)
                steps::slide(search, edges, near, way);
            else
                steps::descend(search, edges, near);
        }
        steps::Place place = steps::end_search(search, edges, reach);
        const steps::Vector step =
            steps::chosen(edge_batch::in_cells(search.found, place, existing), search.step, before);
        edge_batch::scatter(batch, step, vertices.step);
        if (is_smoothing) {
            place = steps::place_of(edges, step);
            edge_batch::store_places(batch, vertices, existing, place, edges, step, to_x, to_y, to_z);
            return;
        }
        edge_batch::scatter(batch, steps::position_of(edges, step), vertices.position);
        for (int lane = 0; lane < batch.used; ++lane)
            states[batch.vertex + lane] = (unsigned char)batch.axis[lane];
    };
    edge_batch::Batch batch;
    batch.used = 0;
    for (int number = start; number < end; ++number) {
        const int k = number / nodes[1], j = number - k * nodes[1];
        const long long to_y = first[number] + count_x[number], to_z = to_y + count_y[number];
        const long long ends[4] = {first[number], to_y, to_z, first[number + 1]};
        for (int axis = 0; axis < 3; ++axis) {
            const edge_batch::Row of_edges = edge_batch::row_of(existing, j, k, axis);
            for (long long v = ends[axis]; v < ends[axis + 1]; ++v) {
                edge_batch::add(batch, vertices, existing, of_edges, v);
                if (batch.used < LANES && v + 1 < first[end]) continue;
                settle(batch);
                batch.used = 0;
            }
        }
    }
}
