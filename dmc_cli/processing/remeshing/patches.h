// List and measure the quads of a patch: see patches.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/processing/quad_lanes.h"
#include "dmc_cli/runtime/pointers.h"

namespace patches {

// Add a quad to a patch of `count` unless it is there; return its size then: `most` + 1, it is full
static CUDA_CALLABLE int added(POINTER(int) quads, int count, int q, int most) {
    bool is_known = false;
    for (int n = 0; n < count; ++n) is_known |= quads[n] == q;
    if (is_known) return count;
    if (count < most) quads[count] = q;
    return count + 1;
}

// Put the corners of a patch's quads from `first` on into lanes; return how many there are
static CUDA_CALLABLE int gather(POINTER(const int) quads, int count, int first, POINTER(const int) corners,
                                POINTER(const wp::vec3) position, quads::Corners& places) {
    const int some = count - first < lanes::LANES ? count - first : lanes::LANES;
    for (int lane = 0; lane < some; ++lane) {
        quads::put_quad(places, lane, quads[first + lane], corners, position);
    }
    return some;
}

}  // namespace patches

template <int PATCH>
inline wp::int32 add_to_patch(wp::array_t<wp::int32> patch, wp::int32 b, wp::int32 count, wp::int32 q) {
    return patches::added(ROW(int, patch, b), count, q, PATCH);
}

template <int PATCH>
inline wp::int32 add_ring_to_patch(wp::array_t<wp::int32> twin, wp::array_t<wp::int32> patch, wp::int32 b,
                                   wp::int32 count, wp::int32 start, wp::int32 quads) {
    int h = start, found = count;
    for (int n = 0; n < quads && found <= PATCH; ++n) {
        found = patches::added(ROW(int, patch, b), found, h >> 2, PATCH);
        h = ITEMS(const int, twin)[(h & ~3) | ((h + 3) & 3)];
    }
    return found;
}

inline void measure_quads(wp::array_t<wp::int32> corners, wp::array_t<wp::vec_t<3, wp::float32>> position,
                          wp::array_t<wp::vec_t<3, wp::float32>> normal, wp::array_t<wp::int32> patch,
                          wp::int32 b, wp::int32 count, wp::array_t<wp::float32> measured) {
    POINTER(const int) quads = ROW(const int, patch, b);
    POINTER(const int) corner = ITEMS(const int, corners);
    POINTER(const wp::vec3) normals = ITEMS(const wp::vec3, normal);
    POINTER(float) out = ROW(float, measured, b);
    const int row = measured.shape[2];
    for (int first = 0; first < count; first += lanes::LANES) {
        quads::Corners at = {};
        const int some = patches::gather(quads, count, first, corner, ITEMS(const wp::vec3, position), at);
        float up[3][lanes::LANES] = {};
        for (int lane = 0; lane < some; ++lane) {
            const int h = 4 * quads[first + lane];
            const wp::vec3 one = normals[corner[h]] + normals[corner[h + 1]];
            const wp::vec3 other = normals[corner[h + 2]] + normals[corner[h + 3]];
            for (int x = 0; x < 3; ++x) up[x][lane] = one[x] + other[x];
        }
        const vectors::Vector a = quads::corner(at, 0), second = quads::corner(at, 1);
        const vectors::Vector c = quads::corner(at, 2), d = quads::corner(at, 3);
        lanes::store(RUN(out + first, lanes::LANES), quads::shape(a, second, c, d));
        lanes::store(RUN(out + row + first, lanes::LANES), quads::warp_cosine(a, second, c, d));
        lanes::store(RUN(out + 2 * row + first, lanes::LANES),
                     vectors::dot(quads::area(at), vectors::load(up[0], up[1], up[2])));
    }
}

inline wp::int32 count_folded_sides(wp::array_t<wp::int32> corners, wp::array_t<wp::int32> twin,
                                    wp::array_t<wp::vec_t<3, wp::float32>> position,
                                    wp::array_t<wp::int32> vertex_region, wp::array_t<wp::int32> patch,
                                    wp::int32 b, wp::int32 count) {
    POINTER(const int) quads = ROW(const int, patch, b);
    POINTER(const int) corner = ITEMS(const int, corners);
    POINTER(const wp::vec3) places = ITEMS(const wp::vec3, position);
    int found = 0;
    for (int first = 0; first < count; first += lanes::LANES) {
        quads::Corners at = {};
        const int some = patches::gather(quads, count, first, corner, places, at);
        const vectors::Vector area = quads::area(at);
        lanes::integers folds = {};
        for (int side = 0; side < 4; ++side) {
            for (int lane = 0; lane < some; ++lane) {
                const int h = 4 * quads[first + lane];
                const int v = corner[h + side], w = corner[h + ((side + 1) & 3)];
                if (ITEMS(const int, vertex_region)[v] != b && ITEMS(const int, vertex_region)[w] != b) {
                    return -1;
                }
                quads::put_quad(at, lane, ITEMS(const int, twin)[h + side] >> 2, corner, places);
            }
            const lanes::numbers turn = vectors::dot(area, quads::area(at));
            folds += lanes::chosen(turn < 0.0f, lanes::integers{} + 1, lanes::integers{});
        }
        int folds_at[lanes::LANES];
        lanes::store(folds_at, folds);
        for (int lane = 0; lane < some; ++lane) found += folds_at[lane];
    }
    return found;
}
