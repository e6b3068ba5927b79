// Bring the vertices of some rows to the surface, near the middles of their edges: see surface_steps.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/contouring/stages/edge_rows.h"
#include "dmc_cli/field/sample_reader.h"
#include "dmc_cli/runtime/pointers.h"
#include "dmc_cli/contouring/macet/step_lanes.h"

inline void settle_rows(
    wp::array_t<wp::uint8> values, wp::int32 kind, wp::float64 isovalue, wp::float64 sign,
    wp::float64 farthest, wp::float64 outside, wp::float64 at_least, wp::int32 has_nodata, wp::float64 nodata,
    wp::float64 padding_low, wp::float64 padding_high, wp::array_t<wp::vec_t<16, wp::uint32>> exists,
    wp::int32 is_marked, wp::vec_t<3, wp::int32> nodes, wp::int32 border, wp::int32 words, wp::int32 ahead,
    wp::int32 start, wp::int32 end, wp::array_t<wp::int64> starts, wp::array_t<wp::int32> along_x,
    wp::array_t<wp::int32> along_y, wp::array_t<wp::int64> cell, wp::array_t<wp::vec_t<3, wp::float32>> local,
    wp::array_t<wp::float32> crossing, wp::float32 reach, wp::array_t<wp::vec_t<4, wp::float32>> sums,
    wp::array_t<wp::vec_t<3, wp::float32>> step_inout, wp::array_t<wp::vec_t<3, wp::float32>> position_inout,
    wp::array_t<wp::uint8> state_out) {
    constexpr int LANES = steps::LANES;
    const int nx = nodes[0], ny = nodes[1], nz = nodes[2];
    const int size[3] = {nx - 2 * border, ny - 2 * border, nz - 2 * border};
    const bool is_smoothing = sums.shape[0] != 0;
    POINTER(const long long) first = ITEMS(const long long, starts);
    POINTER(const int) count_x = ITEMS(const int, along_x);
    POINTER(const int) count_y = ITEMS(const int, along_y);
    POINTER(const long long) cells = ITEMS(const long long, cell);
    POINTER(const float) locals = ITEMS(const float, local);
    POINTER(const float) crossings = ITEMS(const float, crossing);
    POINTER(const float) around = ITEMS(const float, sums);
    POINTER(float) moved = ITEMS(float, step_inout);
    POINTER(float) positions = ITEMS(float, position_inout);
    POINTER(unsigned char) states = ITEMS(unsigned char, state_out);
    POINTER(const unsigned int) existing = ITEMS(const unsigned int, exists);
    auto is_cell = [&](int i, int j, int k) {
        if (i < 0 || j < 0 || k < 0 || i >= nx - 1 || j >= ny - 1 || k >= nz - 1) return false;
        return !is_marked || (existing[ahead + (j + k * ny) * words + i / 32] >> i % 32 & 1) != 0;
    };
    const long long at = 0;
    const long long row = size[0], layer = row * size[1];
    auto distance = [&](double stored_value) {
        const double f = sign * (stored_value - isovalue);
        return f > farthest ? farthest : f < -farthest ? -farthest : f;
    };
    // F at a node of the grid, by the stored value of the nearest one of the volume
    auto careful = [&](double number, bool is_virtual) {
        double f = distance(number);
        const bool is_data = number - number == 0.0 && (number < padding_low || number > padding_high);
        if (border && has_nodata && !is_data) f = nodata;
        if (!is_virtual) return f;
        f = f < 0.0 ? -f : f;
        return outside * (f > at_least ? f : at_least);
    };
    auto nearest = [&](int index, int count) {
        return index < border ? 0 : index - border < count ? index - border : count - 1;
    };
    // Write F at the corners of the cells of the lanes that are changed; where single precision may not hold
    // it, scaled
    auto load_cells = [&](const int* changed, const int* i, const int* j, const int* k, bool is_scaled,
                          steps::Corners& near) {
        auto read = [&](auto stored) {
            for (int lane = 0; lane < LANES; ++lane) {
                if (!changed[lane]) continue;
                const int x = i[lane], y = j[lane], z = k[lane];
                const bool is_outer = x == 0 || y == 0 || z == 0 || x == nx - 2 || y == ny - 2 || z == nz - 2;
                double corners[8];
                if (border && (is_outer || has_nodata)) {
                    for (int c = 0; c < 8; ++c) {
                        const int on_x = x + (c & 1), on_y = y + (c >> 1 & 1), on_z = z + (c >> 2);
                        const int p = nearest(on_x, size[0]), q = nearest(on_y, size[1]),
                                  r = nearest(on_z, size[2]);
                        const bool is_virtual =
                            p + border != on_x || q + border != on_y || r + border != on_z;
                        corners[c] = careful((double)stored[r * layer + q * row + p], is_virtual);
                    }
                } else {
                    const long long n = (z - border) * layer + (y - border) * row + (x - border);
                    for (int c = 0; c < 8; ++c)
                        corners[c] =
                            distance((double)stored[n + (c & 1) + (c >> 1 & 1) * row + (c >> 2) * layer]);
                }
                if (is_scaled)
                    steps::store_scaled(corners, near, lane);
                else
                    for (int c = 0; c < 8; ++c) near.f[c][lane] = (float)corners[c];
            }
        };
        RETURN_FROM_NODES(read)
    };
    int node_i[LANES], node_j[LANES], node_k[LANES], axes[LANES], is_held[LANES];
    auto settle = [&](long long vertex, int used) {
        for (int lane = used; lane < LANES; ++lane) {
            node_i[lane] = node_i[0];
            node_j[lane] = node_j[0];
            node_k[lane] = node_k[0];
            axes[lane] = axes[0];
        }
        for (int lane = 0; lane < LANES; ++lane) {
            is_held[lane] = 0;
            if (!is_marked) continue;
            for (int n = 0; n < 4; ++n) {
                int beside[3] = {node_i[lane], node_j[lane], node_k[lane]};
                const int b = (axes[lane] + 1) % 3, c = (axes[lane] + 2) % 3;
                beside[b] -= n & 1;
                beside[c] -= n >> 1;
                if (!is_cell(beside[0], beside[1], beside[2])) is_held[lane] = 1;
            }
        }
        const steps::Edges edges = steps::edges_at(node_i, node_j, node_k, axes, is_held, nx, ny, nz);
        const steps::numbers none = 0.0f, one = 1.0f;
        steps::Corners near = {};
        float numbers[3][LANES];
        steps::integers last_i = -1, last_j = -1, last_k = -1, active = none == 0.0f, found = 0;
        steps::Vector step = {none, none, none}, before, way;
        auto look = [&](const steps::Place& place) {
            int changed[LANES], i[LANES], j[LANES], k[LANES];
            const steps::integers is_other =
                active & ((place.i != last_i) | (place.j != last_j) | (place.k != last_k));
            last_i = place.i;
            last_j = place.j;
            last_k = place.k;
            if (!steps::any(is_other)) return;
            steps::store(changed, is_other);
            steps::store(i, place.i);
            steps::store(j, place.j);
            steps::store(k, place.k);
            for (int is_scaled = 0; is_scaled < 2; ++is_scaled) {
                load_cells(changed, i, j, k, is_scaled != 0, near);
                const steps::numbers largest = steps::largest(near);
                const steps::integers is_odd = is_other & (((largest > 1.0e-15f) & (largest < 1.0e15f)) == 0);
                if (!steps::any(is_odd)) break;
                steps::store(changed, is_odd);
            }
        };
        if (is_smoothing) {
            float sum[3][LANES], place[3][LANES];
            for (int lane = 0; lane < LANES; ++lane) {
                const long long v = vertex + (lane < used ? lane : 0);
                const float share = 1.0f / around[4 * v + 3];
                for (int n = 0; n < 3; ++n) {
                    numbers[n][lane] = moved[3 * v + n];
                    place[n][lane] = positions[3 * v + n];
                    sum[n][lane] = around[4 * v + n] * share;
                }
            }
            step = {steps::load(numbers[0]), steps::load(numbers[1]), steps::load(numbers[2])};
            way = {steps::load(sum[0]) - steps::load(place[0]), steps::load(sum[1]) - steps::load(place[1]),
                   steps::load(sum[2]) - steps::load(place[2])};
            before = step;
        }
        for (int n = is_smoothing ? -1 : 0; n < steps::MOST_STEPS && steps::any(active); ++n) {
            steps::numbers long_one = steps::length(step);
            steps::integers is_out = active & (long_one > reach);
            step = steps::scaled(is_out ? reach / (is_out ? long_one : one) : one, step);
            step = steps::on_grid(edges, step);
            const steps::Place place = steps::place_of(edges, step, nx, ny, nz);
            look(place);
            const steps::numbers value = steps::value(near, place.local);
            const steps::Vector slope = steps::product(edges.free, steps::gradient(near, place.local));
            if (n < 0) {
                way = steps::along_plane(steps::product(edges.free, way), slope);
                // a vertex beside a cell that does not exist may have no gradient
                const steps::integers is_way = steps::dot(way, way) < 1.0e30f;
                step = steps::chosen(is_way, steps::sum(step, steps::scaled(one * 0.5f, way)), step);
                continue;
            }
            way = steps::newton(value, slope);
            long_one = steps::length(way);
            const steps::integers is_short = long_one <= steps::shortest(), is_one = long_one < 1.0e30f;
            is_out = long_one > steps::longest();
            const steps::numbers share = is_out ? steps::longest() / (is_out ? long_one : one) : one;
            const steps::integers moves = active & is_one;
            step = steps::chosen(moves, steps::less(step, steps::scaled(share, way)), step);
            found = found | (active & is_short & ((long_one > 0.0f) | (value == 0.0f)));
            active = active & (is_short == 0) & is_one;
        }
        step = steps::on_grid(edges, step);
        found = found & (steps::length(step) <= reach);
        int is_found[LANES];
        if (is_marked) {
            int i[LANES], j[LANES], k[LANES];
            const steps::Place place = steps::place_of(edges, step, nx, ny, nz);
            steps::store(i, place.i);
            steps::store(j, place.j);
            steps::store(k, place.k);
            steps::store(is_found, found);
            for (int lane = 0; lane < LANES; ++lane)
                is_found[lane] = is_found[lane] && is_cell(i[lane], j[lane], k[lane]) ? 1 : 0;
            found = steps::load(is_found) != 0;
        }
        if (!is_smoothing) {
            float along[LANES];
            for (int lane = 0; lane < LANES; ++lane)
                along[lane] = crossings[vertex + (lane < used ? lane : 0)] - 0.5f;
            before = steps::scaled(one + one, steps::scaled(steps::load(along), edges.half));
        }
        step = steps::chosen(found, step, before);
        steps::store(numbers[0], step.x);
        steps::store(numbers[1], step.y);
        steps::store(numbers[2], step.z);
        for (int lane = 0; lane < used; ++lane)
            for (int n = 0; n < 3; ++n) moved[3 * (vertex + lane) + n] = numbers[n][lane];
        steps::store(numbers[0], steps::number(edges.i) + (edges.half.x + step.x));
        steps::store(numbers[1], steps::number(edges.j) + (edges.half.y + step.y));
        steps::store(numbers[2], steps::number(edges.k) + (edges.half.z + step.z));
        for (int lane = 0; lane < used; ++lane) {
            for (int n = 0; n < 3; ++n) positions[3 * (vertex + lane) + n] = numbers[n][lane];
            if (!is_smoothing) states[vertex + lane] = (unsigned char)axes[lane];
        }
    };
    int used = 0;
    for (int number = start; number < end; ++number) {
        const int k = number / ny, j = number - k * ny;
        const long long from = first[number], to = first[number + 1];
        const long long from_y = from + count_x[number], from_z = from_y + count_y[number];
        for (long long v = from; v < to; ++v) {
            const int axis = (v >= from_y) + (v >= from_z);
            const int back_x = axis == 0 ? 0 : (int)locals[3 * v];
            const int back_y = axis == 1 ? 0 : (int)locals[3 * v + 1];
            const int back_z = axis == 2 ? 0 : (int)locals[3 * v + 2];
            const long long before = (long long)(j - back_y + ny * (k - back_z)) * nx;
            node_i[used] = (int)(cells[v] - before) + back_x;
            node_j[used] = j;
            node_k[used] = k;
            axes[used++] = axis;
            if (used < LANES && v + 1 < first[end]) continue;
            settle(v + 1 - used, used);
            used = 0;
        }
    }
}
