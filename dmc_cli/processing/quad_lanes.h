// Compare sixteen quads with squares side by side, on CUDA one: see quad_square.py, which does it one by one.
#pragma once
#include "builtin.h"
#include "dmc_cli/field/lane_vectors.h"
#include "dmc_cli/runtime/pointers.h"

namespace quads {

typedef lanes::numbers numbers;
typedef vectors::Vector Vector;

// The corners of quads, each coordinate of each corner side by side
struct Corners {
    float at[4][3][lanes::LANES];
};

static CUDA_CALLABLE void put(Corners& corners, int lane, int corner, wp::vec_t<3, wp::float32> place) {
    for (int x = 0; x < 3; ++x) corners.at[corner][x][lane] = place[x];
}
static CUDA_CALLABLE void put_quad(Corners& all, int lane, int q, POINTER(const int) corners,
                                   POINTER(const wp::vec3) position) {
    for (int c = 0; c < 4; ++c) put(all, lane, c, position[corners[4 * q + c]]);
}
static CUDA_CALLABLE Vector corner(const Corners& corners, int number) {
    return vectors::load(corners.at[number][0], corners.at[number][1], corners.at[number][2]);
}

static CUDA_CALLABLE numbers corner_shape(Vector before, Vector after, Vector normal) {
    const Vector turn = vectors::cross(before, after);
    const numbers none = 0.0f, squares = vectors::dot(before, before) + vectors::dot(after, after);
    const numbers size = vectors::length(turn);
    const numbers signed_size = lanes::chosen(vectors::dot(turn, normal) < none, -size, size);
    return lanes::chosen(squares > none, 2.0f * signed_size / squares, none);
}

static CUDA_CALLABLE numbers shape(Vector a, Vector b, Vector c, Vector d) {
    const Vector ab = vectors::less(b, a), bc = vectors::less(c, b);
    const Vector cd = vectors::less(d, c), da = vectors::less(a, d);
    const Vector normal = vectors::cross(vectors::less(ab, cd), vectors::less(bc, da));
    return lanes::least(lanes::least(corner_shape(da, ab, normal), corner_shape(ab, bc, normal)),
                        lanes::least(corner_shape(bc, cd, normal), corner_shape(cd, da, normal)));
}

static CUDA_CALLABLE numbers corner_cosine(Vector n, Vector m) {
    const numbers none = 0.0f, one = 1.0f, size = vectors::length(n) * vectors::length(m);
    return lanes::chosen(size > none, vectors::dot(n, m) / size, one);
}

static CUDA_CALLABLE numbers warp_cosine(Vector a, Vector b, Vector c, Vector d) {
    const Vector ab = vectors::less(b, a), bc = vectors::less(c, b);
    const Vector cd = vectors::less(d, c), da = vectors::less(a, d);
    return lanes::least(corner_cosine(vectors::cross(da, ab), vectors::cross(bc, cd)),
                        corner_cosine(vectors::cross(ab, bc), vectors::cross(cd, da)));
}

static CUDA_CALLABLE Vector area(const Corners& corners) {
    return vectors::cross(vectors::less(corner(corners, 2), corner(corners, 0)),
                          vectors::less(corner(corners, 3), corner(corners, 1)));
}

}  // namespace quads
