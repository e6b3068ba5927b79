// Connect the triangles of the cells of some rows: see cell_triangles.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/bits/bit_lists.h"
#include "dmc_cli/contouring/stages/cell_edges.h"
#include "dmc_cli/contouring/stages/edge_rows.h"
#include "dmc_cli/contouring/stages/polygon_lists.h"
#include "dmc_cli/runtime/pointers.h"

// Places have WIDTH numbers: see polygon_lists.h. Where vertices have left their edges, `poor_out` says of
// each row whether it has a triangle of less quality than `least`
template <int WIDTH>
inline void connect_rows(
    wp::array_t<wp::vec_t<16, wp::uint32>> inside, wp::array_t<wp::vec_t<16, wp::uint32>> exists,
    wp::int32 is_marked, wp::vec_t<3, wp::int32> nodes, wp::int32 words, wp::int32 ahead, wp::int32 start,
    wp::int32 end, wp::array_t<wp::int64> edge_starts, wp::array_t<wp::int32> along_x,
    wp::array_t<wp::int32> along_y, wp::array_t<wp::int64> triangle_starts, wp::array_t<wp::float64> depths,
    wp::array_t<wp::float32> place, wp::array_t<wp::float32> frame, wp::array_t<wp::uint8> polygon_count,
    wp::array_t<wp::int32> first_polygon, wp::array_t<wp::uint32> edges, wp::array_t<wp::uint8> sizes,
    wp::array_t<wp::uint8> standard, wp::array_t<wp::uint64> allowed, wp::array_t<wp::uint8> corners,
    wp::array_t<wp::uint8> members, wp::int32 is_best, wp::int32 is_reversed, wp::float32 least,
    wp::array_t<wp::vec_t<4, wp::int32>> faces_out, wp::array_t<wp::uint8> poor_out) {
    const int ny = nodes[1];
    const edge_rows::Lines lines{ITEMS(const unsigned int, inside),
                                 ITEMS(const unsigned int, exists),
                                 is_marked != 0,
                                 words,
                                 words * ny,
                                 nodes[0]};
    const polygon_lists::Tables tables{
        ITEMS(const unsigned int, edges),
        ITEMS(const unsigned char, sizes),
        ITEMS(const unsigned char, standard),
        ITEMS(const unsigned long long, allowed),
        ITEMS(const unsigned char, corners) + (is_reversed ? 64 * polygon_lists::CORNERS : 0),
        ITEMS(const unsigned char, members)};
    POINTER(const long long) triangles = ITEMS(const long long, triangle_starts);
    POINTER(const float) of_frame = ITEMS(const float, frame);
    POINTER(const unsigned char) counts = ITEMS(const unsigned char, polygon_count);
    POINTER(const int) firsts = ITEMS(const int, first_polygon);
    POINTER(const double) depth = ITEMS(const double, depths);
    POINTER(const float) places = ITEMS(const float, place);
    POINTER(int) faces = ITEMS(int, faces_out);
    POINTER(unsigned char) poor = ITEMS(unsigned char, poor_out);
    polygon_lists::Lists lists;
    polygon_lists::Points points;
    polygon_lists::clear(lists);
    lists.least = least;
    auto store = [&](int of_sizes) __attribute__((noinline)) {
        polygon_lists::store_sizes(lists, tables, points, places, WIDTH, is_best != 0, of_sizes, faces);
        for (int n = 0; n < lists.poor_count && WIDTH > 1; ++n) {
            int row = start;
            while (triangles[row + 1] <= lists.poor[n]) ++row;
            poor[row] = 1;
        }
        lists.poor_count = 0;
    };
    for (int row = start, layer = -1; row < end; ++row) {
        if (WIDTH > 1) poor[row] = 0;
        if (triangles[row] == triangles[row + 1]) continue;
        int slot = (int)triangles[row];
        if (row / ny != layer && (layer < 0 || depths.shape[0])) {
            store(~0);  // where slices are uneven, points of another layer lie otherwise
            layer = row / ny;
            const float step = depths.shape[0] ? (float)(depth[layer + 1] - depth[layer]) : 1.0f;
            for (int n = 0; n < 36; ++n) {
                const int axis = n / 12, edge = n % 12, entry = cell_edges::entry_of(edge);
                POINTER(const float) of_edge = of_frame + 16 * axis + edge;
                points.base[axis][entry] = of_edge[0] + step * of_edge[48];
                points.along[axis][entry] = of_edge[96] + step * of_edge[144];
            }
        }
        unsigned int first[cell_edges::RUNS];
        cell_edges::begin(first, ITEMS(const long long, edge_starts), ITEMS(const int, along_x),
                          ITEMS(const int, along_y), row, ny);
        for (int begin = 0; begin < words; begin += cell_edges::BLOCK) {
            cell_edges::Word cells[cell_edges::BLOCK];
            unsigned int crossed[cell_edges::BLOCK];
            unsigned short codes[32 * cell_edges::BLOCK + 32];
            POINTER(unsigned short) to = codes;
            int count = 0;
            const int left = words - begin;
            unsigned int near = edge_rows::crossed_words(lines, ahead + row * words + begin);
            near &= left < cell_edges::BLOCK ? (1u << left) - 1u : 0xffffu;
            for (; near; near &= near - 1) {
                const int m = (int)wp::bit_count(~near & (near - 1)), w = begin + m;
                crossed[m] = cell_edges::load(cells[m], lines, ahead + row * words + w, w);
                // edges of cells that do not exist are to be passed, too
                const unsigned int passed = is_marked ? cell_edges::any_edge(cells[m]) : crossed[m];
                count += wp::bit_count(passed);
                to = bit_lists::list_bits(passed, m << 5, to);
            }
            for (int n = 0; n < count; ++n) {
                const int m = codes[n] >> 5, b = codes[n] & 31;
                int vertices[cell_edges::ENTRIES];
                cell_edges::pass(first, cells[m], b, vertices);
                if (is_marked && !(crossed[m] >> b & 1)) continue;
                const int found = cell_edges::case_of(cells[m], b), polygons = counts[found];
                for (int polygon = firsts[found]; polygon < firsts[found] + polygons; ++polygon) {
                    const int size = polygon_lists::list(lists, tables, polygon, vertices, slot);
                    if (polygon_lists::is_full(lists, size)) store(1 << size);
                    slot += size - 2;
                }
            }
        }
    }
    store(~0);
}
