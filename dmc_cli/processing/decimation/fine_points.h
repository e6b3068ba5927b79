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

// A kind of sample of a quad: the midpoint of a side or diagonal, or one near the first corner
static CUDA_CALLABLE lanes::numbers sample(int kind, lanes::numbers here, lanes::numbers beside,
                                           lanes::numbers across, lanes::numbers other) {
    if (kind == 0) return 0.5f * (here + beside);
    if (kind == 1) return 0.5f * (here + across);
    if (kind == 2) return 0.5f * (beside + other);
    return (0.5625f * here + 0.1875f * (beside + other)) + 0.0625f * across;
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

// Quads are compared for all places at once, a lane for a place and a quad, their samples kind by kind; sums
// are taken over the samples of a quad, then over the quads
template <int PLACES, float LEAST_GAIN, float HEIGHT_WEIGHT, float HIGH_WEIGHT, float BAD_WEIGHT>
inline wp::int32 best_place(wp::array_t<wp::int32> corners, wp::array_t<wp::int32> twin,
                            wp::array_t<wp::vec_t<3, wp::float32>> position,
                            wp::array_t<wp::vec_t<3, wp::float32>> places, wp::array_t<wp::float32> copies,
                            wp::int32 b, wp::int32 count, wp::int32 start, wp::int32 valence,
                            wp::float32 edge, wp::float32 reach) {
    constexpr int QUADS = 8, SAMPLES = 4, PAIRS = PLACES * QUADS + lanes::LANES;
    POINTER(const wp::vec3) here = ROW(const wp::vec3, places, b);
    POINTER(const float) rows = ROW(const float, copies, b);
    const lanes::numbers one = 1.0f;
    float energy[PLACES] = {};
    int h = start;
    for (int done = 0; done < valence; done += QUADS) {
        const int some = valence - done < QUADS ? valence - done : QUADS, pairs = PLACES * some;
        float at[4][3][PAIRS] = {}, sample[3][SAMPLES * PAIRS] = {}, cost[SAMPLES * PAIRS], all[PAIRS];
        for (int q = 0; q < some; ++q) {
            for (int c = 1; c < 4; ++c) {
                const wp::vec3 x =
                    ITEMS(const wp::vec3, position)[ITEMS(const int, corners)[(h & ~3) | ((h + c) & 3)]];
                for (int n = q; n < pairs; n += some) {
                    for (int axis = 0; axis < 3; ++axis) at[c][axis][n] = x[axis];
                }
            }
            for (int n = 0; n < PLACES; ++n) {
                for (int axis = 0; axis < 3; ++axis) at[0][axis][n * some + q] = here[n][axis];
            }
            h = ITEMS(const int, twin)[(h & ~3) | ((h + 3) & 3)];
        }
        // What is written beyond the pairs, the next kind overwrites
        for (int kind = 0; kind < SAMPLES; ++kind) {
            for (int n = 0; n < pairs; n += lanes::LANES) {
                for (int axis = 0; axis < 3; ++axis) {
                    lanes::store(
                        sample[axis] + kind * pairs + n,
                        fine::sample(kind, lanes::load(at[0][axis] + n), lanes::load(at[1][axis] + n),
                                     lanes::load(at[2][axis] + n), lanes::load(at[3][axis] + n)));
                }
            }
        }
        for (int s = 0; s < SAMPLES * pairs; s += lanes::LANES) {
            const vectors::Vector x = vectors::load(sample[0] + s, sample[1] + s, sample[2] + s);
            const lanes::numbers height =
                lanes::least(fine::heights(rows, copies.shape[2], count, reach, x) / edge, one);
            lanes::store(cost + s, height * height * (1.0f + HIGH_WEIGHT * height * height));
        }
        for (int n = 0; n < pairs; n += lanes::LANES) {
            vectors::Vector corner[4];
            for (int c = 0; c < 4; ++c) {
                corner[c] = vectors::load(at[c][0] + n, at[c][1] + n, at[c][2] + n);
            }
            const lanes::numbers miss = one - quads::shape(corner[0], corner[1], corner[2], corner[3]);
            lanes::numbers high = lanes::load(cost + n);
            for (int kind = 1; kind < SAMPLES; ++kind) high = high + lanes::load(cost + kind * pairs + n);
            lanes::store(all + n, miss * (1.0f + BAD_WEIGHT * miss) + HEIGHT_WEIGHT * high);
        }
        for (int n = 0; n < pairs; ++n) energy[n / some] += all[n];
    }
    int best = 0;
    float least = energy[0] - LEAST_GAIN;
    for (int n = 1; n < PLACES; ++n) {
        if (energy[n] < least) {
            least = energy[n];
            best = n;
        }
    }
    return best;
}
