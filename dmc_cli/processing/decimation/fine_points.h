// Look for the nearest of a region's listed points: see fine_points.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/field/lane_vectors.h"
#include "dmc_cli/processing/quad_lanes.h"
#include "dmc_cli/runtime/pointers.h"

namespace fine {

// Of a place from which no point is known
static CUDA_CALLABLE float nowhere() { return 1.0e30f; }

// Heights of places above the surface, as the points know it, the rows of which have x, y, z and the normal
static CUDA_CALLABLE lanes::numbers heights(POINTER(const float) rows, int row, int count, float reach,
                                            vectors::Vector at) {
    const lanes::numbers none = 0.0f;
    lanes::numbers square = none + nowhere(), up = none;
    for (int n = 0; n < count; ++n) {
        const vectors::Vector way = {at.x - rows[n], at.y - rows[row + n], at.z - rows[2 * row + n]};
        const lanes::numbers found = vectors::dot(way, way);
        const lanes::numbers above =
            (way.x * rows[3 * row + n] + way.y * rows[4 * row + n]) + way.z * rows[5 * row + n];
        up = lanes::chosen(found < square, above, up);
        square = lanes::least(found, square);
    }
    const lanes::numbers height = lanes::size(up);
    const lanes::numbers beside = lanes::root(lanes::most(square - height * height, none));
    return height + lanes::most(beside - reach, none);
}

}  // namespace fine

inline void copy_points(wp::array_t<wp::vec_t<3, wp::float32>> place,
                        wp::array_t<wp::vec_t<3, wp::float32>> normal, wp::array_t<wp::int32> listed,
                        wp::int32 b, wp::int32 count, wp::array_t<wp::float32> copies) {
    const int row = copies.shape[2];
    POINTER(const int) points = ROW(const int, listed, b);
    POINTER(float) rows = ROW(float, copies, b);
    for (int n = 0; n < count; ++n) {
        POINTER(const float) from = ITEMS(const float, place) + 3 * (size_t)points[n];
        POINTER(const float) up = ITEMS(const float, normal) + 3 * (size_t)points[n];
        for (int x = 0; x < 3; ++x) {
            rows[x * row + n] = from[x];
            rows[(3 + x) * row + n] = up[x];
        }
    }
    for (int n = count; n % lanes::LANES; ++n) {
        for (int x = 0; x < 3; ++x) rows[x * row + n] = 1.0e18f;  // farther than any
    }
}

inline wp::int32 nearest_copy(wp::array_t<wp::float32> copies, wp::int32 b, wp::int32 count,
                              wp::vec_t<3, wp::float32> x) {
    const int row = copies.shape[2];
    POINTER(const float) rows = ROW(const float, copies, b);
    const lanes::numbers none = 0.0f;
    const lanes::integers no_point = 0;
    lanes::numbers least = none + fine::nowhere();
    lanes::integers best = no_point - 1;
    for (int n = 0; n < count; n += lanes::LANES) {
        const vectors::Vector at = {lanes::load(RUN(rows + n, lanes::LANES)),
                                    lanes::load(RUN(rows + row + n, lanes::LANES)),
                                    lanes::load(RUN(rows + 2 * row + n, lanes::LANES))};
        const vectors::Vector way = {at.x - x[0], at.y - x[1], at.z - x[2]};
        const lanes::numbers square = vectors::dot(way, way);
        best = lanes::chosen(square < least, no_point + n, best);
        least = lanes::least(square, least);
    }
    float squares[lanes::LANES];
    int firsts[lanes::LANES];
    lanes::store(squares, least);
    lanes::store(firsts, best);
    int found = -1;
    float nearest = fine::nowhere();
    for (int lane = 0; lane < lanes::LANES; ++lane) {
        const int n = firsts[lane] + lane;
        if (firsts[lane] < 0 || squares[lane] > nearest) continue;
        if (squares[lane] < nearest || n < found) {
            nearest = squares[lane];
            found = n;
        }
    }
    return found;
}

// Samples of quads are gathered until there is one a lane, and judged together
template <int MOST_STEPS>
inline wp::bool are_samples_low(wp::array_t<wp::int32> corners,
                                wp::array_t<wp::vec_t<3, wp::float32>> position, wp::array_t<wp::int32> patch,
                                wp::int32 patched, wp::array_t<wp::float32> copies, wp::int32 b,
                                wp::int32 count, wp::float32 spacing, wp::float32 reach,
                                wp::float32 highest) {
    POINTER(const int) quads = ROW(const int, patch, b);
    POINTER(const float) rows = ROW(const float, copies, b);
    float sample[3][lanes::LANES] = {};
    int gathered = 0;
    bool low = true;
    for (int n = 0; n < patched && low; ++n) {
        wp::vec3 at[4];
        for (int c = 0; c < 4; ++c) {
            at[c] = ITEMS(const wp::vec3, position)[ITEMS(const int, corners)[4 * quads[n] + c]];
        }
        float longest = 0.0f;
        for (int c = 0; c < 4; ++c) longest = wp::max(longest, wp::length(at[c] - at[(c + 1) & 3]));
        const int steps = (int)wp::clamp(wp::ceil(longest / spacing), 2.0f, (float)MOST_STEPS);
        const bool is_last = n == patched - 1;
        for (int j = 0; j <= steps; ++j) {
            for (int i = 0; i <= steps; ++i) {
                if ((i == 0 || i == steps) && (j == 0 || j == steps)) continue;
                const float s = (float)i / (float)steps, t = (float)j / (float)steps;
                const wp::vec3 x = wp::lerp(wp::lerp(at[0], at[1], s), wp::lerp(at[3], at[2], s), t);
                for (int axis = 0; axis < 3; ++axis) sample[axis][gathered] = x[axis];
                ++gathered;
                if (gathered < lanes::LANES && !(is_last && j == steps && i == steps - 1)) continue;
                const vectors::Vector all = vectors::load(sample[0], sample[1], sample[2]);
                float height[lanes::LANES];
                lanes::store(height, fine::heights(rows, copies.shape[2], count, reach, all));
                for (int lane = 0; lane < gathered; ++lane) low &= height[lane] <= highest;
                gathered = 0;
            }
        }
    }
    return low;
}

// The sum over the samples of a quad round a vertex is taken before that over the quads
template <float HEIGHT_WEIGHT, float HIGH_WEIGHT, float BAD_WEIGHT>
inline wp::float32 energy_of_ring(wp::array_t<wp::int32> corners, wp::array_t<wp::int32> twin,
                                  wp::array_t<wp::vec_t<3, wp::float32>> position,
                                  wp::array_t<wp::float32> copies, wp::int32 b, wp::int32 count,
                                  wp::int32 start, wp::int32 valence, wp::float32 edge, wp::float32 reach) {
    constexpr int QUADS = lanes::LANES < 4 ? 1 : lanes::LANES / 4, SAMPLES = 4;
    POINTER(const wp::vec3) places = ITEMS(const wp::vec3, position);
    POINTER(const float) rows = ROW(const float, copies, b);
    const lanes::numbers none = 0.0f, one = 1.0f;
    float total = 0.0f;
    int h = start;
    for (int done = 0; done < valence; done += QUADS) {
        const int some = valence - done < QUADS ? valence - done : QUADS;
        quads::Corners ring = {};
        float sample[3][QUADS * SAMPLES] = {}, off[lanes::LANES], cost[QUADS * SAMPLES];
        for (int q = 0; q < some; ++q) {
            for (int c = 0; c < 4; ++c) {
                quads::put(ring, q, c, places[ITEMS(const int, corners)[(h & ~3) | ((h + c) & 3)]]);
            }
            for (int x = 0; x < 3; ++x) {
                const float here = ring.at[0][x][q], beside = ring.at[1][x][q];
                const float across = ring.at[2][x][q], other = ring.at[3][x][q];
                sample[x][SAMPLES * q] = 0.5f * (here + beside);
                sample[x][SAMPLES * q + 1] = 0.5f * (here + across);
                sample[x][SAMPLES * q + 2] = 0.5f * (beside + other);
                sample[x][SAMPLES * q + 3] = (0.5625f * here + 0.1875f * (beside + other)) + 0.0625f * across;
            }
            h = ITEMS(const int, twin)[(h & ~3) | ((h + 3) & 3)];
        }
        const lanes::numbers miss = one - quads::shape(quads::corner(ring, 0), quads::corner(ring, 1),
                                                       quads::corner(ring, 2), quads::corner(ring, 3));
        lanes::store(off, miss * (1.0f + BAD_WEIGHT * miss));
        for (int s = 0; s < QUADS * SAMPLES; s += lanes::LANES) {
            const vectors::Vector at = vectors::load(sample[0] + s, sample[1] + s, sample[2] + s);
            const lanes::numbers height =
                lanes::least(fine::heights(rows, copies.shape[2], count, reach, at) / edge, one);
            lanes::store(cost + s, height * height * (1.0f + HIGH_WEIGHT * height * height));
        }
        for (int q = 0; q < some; ++q) {
            float heights = cost[SAMPLES * q];
            for (int s = 1; s < SAMPLES; ++s) heights += cost[SAMPLES * q + s];
            total += off[q] + HEIGHT_WEIGHT * heights;
        }
    }
    return total;
}
