// Connect the triangles of the cells of some rows: see cell_triangles.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/bits/bit_lists.h"
#include "dmc_cli/contouring/stages/cell_edges.h"
#include "dmc_cli/contouring/stages/edge_rows.h"
#include "dmc_cli/contouring/stages/polygon_lists.h"
#include "dmc_cli/runtime/pointers.h"

// Places have WIDTH numbers: see polygon_lists.h
template <int WIDTH>
inline void connect_rows(wp::array_t<wp::vec_t<16, wp::uint32>> inside,
                         wp::array_t<wp::vec_t<16, wp::uint32>> exists, wp::int32 is_marked,
                         wp::vec_t<3, wp::int32> nodes, wp::int32 words, wp::int32 ahead, wp::int32 start,
                         wp::int32 end, wp::array_t<wp::int64> edge_starts, wp::array_t<wp::int32> along_x,
                         wp::array_t<wp::int32> along_y, wp::array_t<wp::int64> triangle_starts,
                         wp::array_t<wp::float64> depths, wp::array_t<wp::float32> place,
                         wp::array_t<wp::float32> frame, wp::array_t<wp::uint8> polygon_count,
                         wp::array_t<wp::int32> first_polygon, wp::array_t<wp::uint8> edges,
                         wp::array_t<wp::uint8> standard, wp::array_t<wp::uint64> allowed,
                         wp::array_t<wp::uint8> corners, wp::array_t<wp::uint8> members, wp::int32 is_best,
                         wp::int32 is_reversed, wp::array_t<wp::vec_t<4, wp::int32>> faces_out) {
    const int ny = nodes[1];
    const edge_rows::Lines lines{ITEMS(const unsigned int, inside),
                                 ITEMS(const unsigned int, exists),
                                 is_marked != 0,
                                 words,
                                 words * ny,
                                 nodes[0]};
    const polygon_lists::Tables tables{
        ITEMS(const unsigned char, edges), ITEMS(const unsigned char, standard),
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
    polygon_lists::Lists lists;
    polygon_lists::Points points;
    polygon_lists::clear(lists);
    cell_edges::Word word;
    auto store = [&] { polygon_lists::store_all(lists, tables, points, places, WIDTH, is_best != 0, faces); };
    for (int row = start, layer = -1; row < end; ++row) {
        if (triangles[row] == triangles[row + 1]) continue;
        int slot = (int)triangles[row];
        if (row / ny != layer && (layer < 0 || depths.shape[0])) {
            store();  // where slices are uneven, points of another layer lie otherwise
            layer = row / ny;
            const float step = depths.shape[0] ? (float)(depth[layer + 1] - depth[layer]) : 1.0f;
            for (int n = 0; n < 48; ++n) {
                points.base[n / 16][n % 16] = of_frame[n] + step * of_frame[48 + n];
                points.along[n / 16][n % 16] = of_frame[96 + n] + step * of_frame[144 + n];
            }
        }
        cell_edges::begin(word, ITEMS(const long long, edge_starts), ITEMS(const int, along_x),
                          ITEMS(const int, along_y), row, ny);
        for (int begin = 0; begin < words; begin += cell_edges::BLOCK) {
            cell_edges::Cells cells[cell_edges::BLOCK];
            unsigned short codes[32 * cell_edges::BLOCK + 32];
            POINTER(unsigned short) to = codes;
            int count = 0;
            const int left = words - begin;
            unsigned int near = edge_rows::crossed_words(lines, ahead + row * words + begin);
            near &= left < cell_edges::BLOCK ? (1u << left) - 1u : 0xffffu;
            for (; near; near &= near - 1, cell_edges::pass(word)) {  // others have no edges to pass
                const int w = begin + (int)wp::bit_count(~near & (near - 1));
                const unsigned int crossed = cell_edges::load(word, lines, ahead + row * words + w, w);
                if (crossed == 0) continue;
                cells[w - begin] = cell_edges::spread(word);
                count += wp::bit_count(crossed);
                to = bit_lists::list_bits(crossed, (w - begin) << 5, to);
            }
            for (int m = 0; m < count; ++m) {
                const cell_edges::Cells& near = cells[codes[m] >> 5];
                const int b = codes[m] & 31, found = cell_edges::case_of(near, b), first = firsts[found];
                const int polygons = counts[found];
                int vertices[cell_edges::LISTED];
                cell_edges::find_vertices(near, b, vertices);
                for (int n = 0; n < polygons; ++n)
                    slot += polygon_lists::list(lists, tables, first + n, vertices, slot) - 2;
                if (lists.count > polygon_lists::ROOM - 4) store();
            }
        }
    }
    store();
}
