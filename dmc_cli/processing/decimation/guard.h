// Measure how far points are from quads: see guard.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/processing/quad_lanes.h"
#include "dmc_cli/runtime/pointers.h"

namespace far {

typedef lanes::numbers numbers;
typedef vectors::Vector Vector;

// Squares of distances of points from segments
static CUDA_CALLABLE numbers from_segment(Vector p, Vector a, Vector b) {
    const Vector along = vectors::less(b, a), off = vectors::less(p, a);
    const numbers none = 0.0f, one = 1.0f, size = vectors::dot(along, along);
    const numbers share = lanes::least(lanes::most(vectors::dot(off, along) / size, none), one);
    const Vector rest = vectors::less(off, vectors::scaled(lanes::chosen(size > none, share, none), along));
    return vectors::dot(rest, rest);
}

// Squares of distances of points from triangles
static CUDA_CALLABLE numbers from_triangle(Vector p, Vector a, Vector b, Vector c) {
    const Vector ab = vectors::less(b, a), bc = vectors::less(c, b), ca = vectors::less(a, c);
    const Vector off = vectors::less(p, a), normal = vectors::cross(ab, vectors::less(c, a));
    const numbers none = 0.0f, size = vectors::dot(normal, normal), height = vectors::dot(off, normal);
    const lanes::integers is_inside =
        (size > none) & (vectors::dot(vectors::cross(ab, off), normal) >= none) &
        (vectors::dot(vectors::cross(bc, vectors::less(p, b)), normal) >= none) &
        (vectors::dot(vectors::cross(ca, vectors::less(p, c)), normal) >= none);
    const numbers beside =
        lanes::least(lanes::least(from_segment(p, a, b), from_segment(p, b, c)), from_segment(p, c, a));
    return lanes::chosen(is_inside, height * height / size, beside);
}

// Distances of points from quads, each as two triangles by the diagonal that makes it larger
static CUDA_CALLABLE numbers from_quad(Vector p, const quads::Corners& corners) {
    const Vector a = quads::corner(corners, 0), b = quads::corner(corners, 1);
    const Vector c = quads::corner(corners, 2), d = quads::corner(corners, 3);
    const numbers one = lanes::least(from_triangle(p, a, b, c), from_triangle(p, a, c, d));
    const numbers other = lanes::least(from_triangle(p, a, b, d), from_triangle(p, b, c, d));
    return lanes::root(lanes::most(one, other));
}

// The nearest of up to sixteen quads, on CUDA one, if it is nearer than `least`, which it changes: the first
// of those as near, or the last where it takes one as far as `least`, too
static CUDA_CALLABLE int nearest(const int* some, int count, wp::vec3 p, POINTER(const int) corners,
                                 POINTER(const wp::vec3) position, bool takes_equal, float& least) {
    quads::Corners at = {};
    for (int lane = 0; lane < count; ++lane) quads::put_quad(at, lane, some[lane], corners, position);
    const numbers none = 0.0f;
    const Vector all = {none + p[0], none + p[1], none + p[2]};
    float distance[lanes::LANES];
    lanes::store(distance, from_quad(all, at));
    int found = -1;
    for (int lane = 0; lane < count; ++lane) {
        if (distance[lane] < least || (takes_equal && distance[lane] == least)) {
            least = distance[lane];
            found = some[lane];
        }
    }
    return found;
}

}  // namespace far

inline wp::float32 distance_from_triangles(wp::array_t<wp::int32> corners,
                                           wp::array_t<wp::vec_t<3, wp::float32>> position, wp::int32 q,
                                           wp::vec_t<3, wp::float32> p) {
    float least = 3.0e38f;
    far::nearest(&q, 1, p, ITEMS(const int, corners), ITEMS(const wp::vec3, position), false, least);
    return least;
}

inline wp::int32 nearest_round(wp::array_t<wp::int32> corners, wp::array_t<wp::int32> twin,
                               wp::array_t<wp::vec_t<3, wp::float32>> position, wp::int32 q,
                               wp::vec_t<3, wp::float32> p) {
    constexpr int QUADS = 9;  // itself, four across its sides and one beside each of these
    int round[QUADS] = {q}, count = 1;
    for (int c = 0; c < 4; ++c) {
        int t = ITEMS(const int, twin)[4 * q + c];
        for (int step = 0; step < 2 && t >= 0; ++step) {
            round[count++] = t >> 2;
            t = ITEMS(const int, twin)[(t & ~3) | ((t + 3) & 3)];
        }
    }
    float least = 3.0e38f;
    int best = q;
    for (int first = 0; first < count; first += lanes::LANES) {
        const int some = count - first < lanes::LANES ? count - first : lanes::LANES;
        const int found = far::nearest(round + first, some, p, ITEMS(const int, corners),
                                       ITEMS(const wp::vec3, position), false, least);
        best = found < 0 ? best : found;
    }
    return best;
}

inline wp::bool assign_listed(wp::array_t<wp::int32> corners, wp::array_t<wp::vec_t<3, wp::float32>> position,
                              wp::array_t<wp::uint8> face_gone, wp::array_t<wp::int32> patch,
                              wp::int32 patched, wp::array_t<wp::vec_t<3, wp::float32>> place,
                              wp::array_t<wp::int32> nearest_quad, wp::array_t<wp::int32> listed, wp::int32 b,
                              wp::int32 count, wp::float32 farthest, wp::array_t<wp::int32> new_nearest) {
    POINTER(const int) corner = ITEMS(const int, corners);
    POINTER(const wp::vec3) places = ITEMS(const wp::vec3, position);
    POINTER(const wp::vec3) points = ITEMS(const wp::vec3, place);
    POINTER(const int) quads = ROW(const int, patch, b);
    POINTER(const int) list = ROW(const int, listed, b);
    POINTER(int) out = ROW(int, new_nearest, b);
    for (int first = 0; first < count; first += lanes::LANES) {
        const int some = count - first < lanes::LANES ? count - first : lanes::LANES;
        quads::Corners at = {};
        float point[3][lanes::LANES] = {}, distance[lanes::LANES];
        for (int lane = 0; lane < some; ++lane) {
            const int g = list[first + lane];
            quads::put_quad(at, lane, ITEMS(const int, nearest_quad)[g], corner, places);
            for (int x = 0; x < 3; ++x) point[x][lane] = points[g][x];
        }
        lanes::store(distance, far::from_quad(vectors::load(point[0], point[1], point[2]), at));
        for (int lane = 0; lane < some; ++lane) {
            const int g = list[first + lane], old = ITEMS(const int, nearest_quad)[g];
            int best = ITEMS(const wp::uint8, face_gone)[old] || !(distance[lane] <= farthest) ? -1 : old;
            if (best < 0) {
                float least = farthest;
                for (int n = 0; n < patched; n += lanes::LANES) {
                    int block[lanes::LANES];
                    const int size = patched - n < lanes::LANES ? patched - n : lanes::LANES;
                    for (int m = 0; m < size; ++m) block[m] = quads[n + m];
                    const int found = far::nearest(block, size, points[g], corner, places, true, least);
                    best = found < 0 ? best : found;
                }
                if (best < 0) return false;
            }
            out[first + lane] = best;
        }
    }
    return true;
}
