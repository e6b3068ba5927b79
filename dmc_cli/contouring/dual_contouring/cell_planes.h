// Place vertices by the planes at the crossings of their cells, side by side: see cell_planes.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/contouring/dual_contouring/symmetric_matrix.h"
#include "dmc_cli/field/lanes.h"

namespace cell_planes {

typedef lanes::numbers numbers;
typedef lanes::integers integers;

// F at the corners of cells, and its derivatives there along each axis
struct Cells {
    numbers f[8], slope[3][8];
};

// The planes at cells' crossings, summed about their mean: n n^T as xx yy zz xy xz yz, and n (n . d) for
// their distances d along x, y, z. Out: of which cells a gradient has left single precision
struct Sums {
    numbers mean[3], matrix[6], along[3];
    integers is_out;
};

// Where vertices are put, and of which ones that was outside their cells, from where they were drawn in
struct Placed {
    numbers at[3];
    integers is_outside;
};

// Of an edge along an axis, the lower corner
static CUDA_CALLABLE int low_corner(int axis, int n) {
    return axis == 0 ? 2 * n : axis == 1 ? (n & 1) + 4 * (n >> 1) : n;
}

// Return F in single precision, below zero where it is, also where it rounds to zero
static CUDA_CALLABLE numbers below_zero(lanes::doubles f) {
    const numbers rounded = lanes::narrowed(f), least = -1.0e-30f;
    return (lanes::is_negative(f) & ((rounded < least) == 0)) ? least : rounded;
}

// Return where F crosses zero between a (at 0) and b (at 1), or -1 where it does not
static CUDA_CALLABLE numbers crossing(numbers a, numbers b) {
    const numbers none = -1.0f;
    return ((a >= 0.0f) != (b >= 0.0f)) ? a / (a - b) : none;
}

// Add the crossing of an edge to those of its cells; return where it is
static CUDA_CALLABLE numbers add_crossing(const Cells& cells, int axis, int low, Sums& sums, numbers& count) {
    const numbers t = crossing(cells.f[low], cells.f[low + (1 << axis)]), one = 1.0f, none = 0.0f;
    const integers is_crossed = t >= 0.0f;
    count += is_crossed ? one : none;
    for (int n = 0; n < 3; ++n) {
        const numbers at = n == axis ? t : one * (float)(low >> n & 1);
        sums.mean[n] += is_crossed ? at : none;
    }
    return t;
}

// Return what makes products of a gradient's parts those of a unit normal's; 0 where there is none: `end` is
// the square of the gradient at the edge's lower end, and where those at both ends cancel each other, what is
// left is a rounding and no direction
static CUDA_CALLABLE numbers weight(numbers square, numbers t, numbers end) {
    const numbers one = 1.0f, none = 0.0f;
    return ((t >= 0.0f) & (square > 1.0e-12f * end)) ? one / square : none;
}

static CUDA_CALLABLE numbers dot(const numbers* a, const numbers* b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Add the plane at a crossing
static CUDA_CALLABLE void add_plane(const Cells& cells, int axis, int low, numbers t, Sums& sums) {
    const int high = low + (1 << axis);
    numbers normal[3], offset[3];
    for (int n = 0; n < 3; ++n) {
        const numbers from = cells.slope[n][low];
        normal[n] = from + t * (cells.slope[n][high] - from);
        offset[n] = (n == axis ? t : t * 0.0f + (float)(low >> n & 1)) - sums.mean[n];
    }
    const numbers square = dot(normal, normal), distance = dot(normal, offset);
    const numbers end[3] = {cells.slope[0][low], cells.slope[1][low], cells.slope[2][low]};
    const numbers share = weight(square, t, dot(end, end));
    // Between these a square is a float32 number with all its digits
    sums.is_out |= ((square <= 3.0e38f) == 0) | ((t >= 0.0f) & (square < 0x1p-126f));
    for (int n = 0; n < 3; ++n) {
        const numbers weighed = share * normal[n];
        sums.matrix[n] += weighed * normal[n];
        for (int m = n + 1; m < 3; ++m) sums.matrix[2 + n + m] += weighed * normal[m];
        sums.along[n] += weighed * distance;
    }
}

static CUDA_CALLABLE Sums sum_planes(const Cells& cells) {
    Sums sums = {};
    numbers count = 0.0f, crossings[12];
#pragma unroll
    for (int edge = 0; edge < 12; ++edge)
        crossings[edge] = add_crossing(cells, edge >> 2, low_corner(edge >> 2, edge & 3), sums, count);
    const numbers share = 1.0f / count;
    for (int n = 0; n < 3; ++n) sums.mean[n] *= share;
#pragma unroll
    for (int edge = 0; edge < 12; ++edge)
        add_plane(cells, edge >> 2, low_corner(edge >> 2, edge & 3), crossings[edge], sums);
    return sums;
}

// Return of which cells the largest value at a corner needs no scaling in single precision
static CUDA_CALLABLE integers fits_single(const Cells& cells) {
    numbers largest = 0.0f;
    for (int c = 0; c < 8; ++c) largest = lanes::most(largest, lanes::size(cells.f[c]));
    return (largest > 1.0e-15f) & (largest < 1.0e15f);
}

// Put each vertex at the point of the least error
static CUDA_CALLABLE Placed at_least_error(const Sums& sums) {
    const numbers one = 1.0f, none = 0.0f;
    const float cut = 0.01f;  // of eigenvalues, as a share of the largest: on a scan smaller ones are noise
    Placed placed = {};
    numbers step[3];
    symmetric_matrix::find_least_point(sums.matrix, sums.along, cut, step);
    for (int n = 0; n < 3; ++n) {
        const numbers p = sums.mean[n] + step[n];
        placed.is_outside |= (p < 0.0f) | (p > 1.0f);
        placed.at[n] = lanes::most(none, lanes::least(one, p));
    }
    return placed;
}

// Put each vertex where a particle gets in so many steps
static CUDA_CALLABLE Placed at_particle(const Sums& sums, int steps, float step_size) {
    const numbers one = 1.0f, none = 0.0f;
    const numbers* m = sums.matrix;
    Placed placed = {};
    for (int n = 0; n < 3; ++n) placed.at[n] = sums.mean[n];
    for (int step = 0; step < steps; ++step) {
        const numbers x = placed.at[0] - sums.mean[0], y = placed.at[1] - sums.mean[1];
        const numbers z = placed.at[2] - sums.mean[2];
        const numbers force[3] = {sums.along[0] - (m[0] * x + m[3] * y + m[4] * z),
                                  sums.along[1] - (m[3] * x + m[1] * y + m[5] * z),
                                  sums.along[2] - (m[4] * x + m[5] * y + m[2] * z)};
        for (int n = 0; n < 3; ++n)
            placed.at[n] = lanes::most(none, lanes::least(one, placed.at[n] + step_size * force[n]));
    }
    return placed;
}

// Put each vertex at a particle after so many steps, at the least error where `steps` is below 0
static CUDA_CALLABLE Placed place(const Sums& sums, int steps, float step_size) {
    return steps < 0 ? at_least_error(sums) : at_particle(sums, steps, step_size);
}

// What became of a vertex: it lay outside its cell and was drawn in, it needs more than single precision
enum { OUTSIDE = 1, LEFT = 2 };

// Place vertices; write coordinate after coordinate, sixteen of each, and what became of them
static CUDA_CALLABLE void place_lanes(const Cells& cells, int steps, float step_size, float* out) {
    const Sums sums = sum_planes(cells);
    const Placed placed = place(sums, steps, step_size);
    const integers fits = fits_single(cells) & (sums.is_out == 0);
    const integers none = 0, outside = OUTSIDE, left = LEFT;
    const integers became = (placed.is_outside ? outside : none) | (fits ? none : left);
    for (int n = 0; n < 3; ++n) lanes::store(out + 16 * n, placed.at[n]);
    lanes::store(out + 48, lanes::number(became));
}

}  // namespace cell_planes

// Place the vertices of sixteen cells: F at their corners, corner after corner, then the derivatives
inline wp::vec_t<64, wp::float32> place_gathered(wp::vec_t<512, wp::float32> corners, wp::int32 steps,
                                                 wp::float32 step_size) {
    wp::vec_t<64, float> out;
    for (int start = 0; start < 16; start += lanes::LANES) {
        cell_planes::Cells cells;
        for (int c = 0; c < 8; ++c) {
            cells.f[c] = lanes::load(&corners[0] + 16 * c + start);
            for (int n = 0; n < 3; ++n)
                cells.slope[n][c] = lanes::load(&corners[0] + 16 * (8 * (n + 1) + c) + start);
        }
        cell_planes::place_lanes(cells, steps, step_size, &out[0] + start);
    }
    return out;
}

// Place one vertex
inline wp::vec_t<4, wp::float32> place_one(wp::vec_t<8, wp::float32> f, wp::vec_t<24, wp::float32> slopes,
                                           wp::int32 steps, wp::float32 step_size) {
    cell_planes::Cells cells;
    for (int c = 0; c < 8; ++c) {
        const cell_planes::numbers none = 0.0f;
        cells.f[c] = none + f[c];
        for (int n = 0; n < 3; ++n) cells.slope[n][c] = none + slopes[3 * c + n];
    }
    const cell_planes::Sums sums = cell_planes::sum_planes(cells);
    const cell_planes::Placed placed = cell_planes::place(sums, steps, step_size);
    float at[3][lanes::LANES];
    int is_out[lanes::LANES], is_outside[lanes::LANES];
    for (int n = 0; n < 3; ++n) lanes::store(at[n], placed.at[n]);
    lanes::store(is_out, sums.is_out);
    lanes::store(is_outside, placed.is_outside);
    const int became = (is_outside[0] ? cell_planes::OUTSIDE : 0) | (is_out[0] ? cell_planes::LEFT : 0);
    return {at[0][0], at[1][0], at[2][0], (float)became};
}
