// Vectors of space, sixteen side by side, on CUDA one.
#pragma once
#include "builtin.h"
#include "dmc_cli/field/lanes.h"

namespace vectors {

typedef lanes::numbers numbers;

struct Vector {
    numbers x, y, z;
};

static CUDA_CALLABLE Vector scaled(numbers a, Vector v) { return {a * v.x, a * v.y, a * v.z}; }
static CUDA_CALLABLE Vector sum(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static CUDA_CALLABLE Vector less(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static CUDA_CALLABLE numbers dot(Vector a, Vector b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
static CUDA_CALLABLE numbers length(Vector a) { return lanes::root(dot(a, a)); }
static CUDA_CALLABLE Vector cross(Vector a, Vector b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static CUDA_CALLABLE Vector load(const float* x, const float* y, const float* z) {
    return {lanes::load(x), lanes::load(y), lanes::load(z)};
}

}  // namespace vectors
