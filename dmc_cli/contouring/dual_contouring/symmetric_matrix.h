// Find the eigenvectors of symmetric 3x3 matrices side by side, and the least point of sums of squares: see
// symmetric_matrix.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/field/lanes.h"

namespace symmetric_matrix {

typedef lanes::numbers numbers;
typedef lanes::integers integers;

// A matrix xx yy zz xy xz yz, and the columns of a rotation
struct Eigen {
    numbers entry[6];
    numbers column[3][3];
};

// Rotate in the plane of axes p and q, by the smaller angle that makes the entry beside them zero; `pq`, `rp`
// and `rq` are the places of entries, r being the third axis
static CUDA_CALLABLE void rotate(Eigen& e, int pq, int rp, int rq, int p, int q) {
    const numbers one = 1.0f, none = 0.0f;
    const integers is_turned = lanes::size(e.entry[pq]) > 1.0e-12f;  // less counts for nothing
    const numbers difference = is_turned ? e.entry[q] - e.entry[p] : one;
    const numbers twice = is_turned ? e.entry[pq] + e.entry[pq] : none;
    const numbers square = twice * twice;
    const numbers length = lanes::size(difference) + lanes::root(difference * difference + square);
    const numbers turned = difference < 0.0f ? -twice : twice;
    const numbers share = one / lanes::root(length * length + square);
    const numbers tangent = turned / length, cosine = length * share, sine = turned * share;
    e.entry[p] = e.entry[p] - tangent * e.entry[pq];
    e.entry[q] = e.entry[q] + tangent * e.entry[pq];
    e.entry[pq] = none;
    const numbers first = e.entry[rp], second = e.entry[rq];
    e.entry[rp] = cosine * first - sine * second;
    e.entry[rq] = cosine * second + sine * first;
    for (int n = 0; n < 3; ++n) {
        const numbers v = e.column[p][n], w = e.column[q][n];
        e.column[p][n] = cosine * v - sine * w;
        e.column[q][n] = cosine * w + sine * v;
    }
}

// Rotate in the plane of each two axes
static CUDA_CALLABLE void sweep(Eigen& e) {
    rotate(e, 3, 4, 5, 0, 1);
    rotate(e, 4, 3, 5, 0, 2);
    rotate(e, 5, 3, 4, 1, 2);
}

// Write how far along x, y and z the least point of planes is, whose normals and distances are summed:
// matrix xx yy zz xy xz yz, and `along` x y z. Eigenvalues up to `cut` times the largest are dropped
static CUDA_CALLABLE void find_least_point(const numbers* matrix, const numbers* along, float cut,
                                           numbers* point) {
    const numbers one = 1.0f, none = 0.0f;
    Eigen e;
    for (int n = 0; n < 6; ++n) e.entry[n] = matrix[n];
    for (int n = 0; n < 9; ++n) e.column[n / 3][n % 3] = n % 4 == 0 ? one : none;
    for (int n = 0; n < 3; ++n) sweep(e);
    const numbers least = cut * lanes::most(e.entry[0], lanes::most(e.entry[1], e.entry[2]));
    numbers share[3];
    for (int n = 0; n < 3; ++n) {
        const numbers* v = e.column[n];
        const numbers sum = v[0] * along[0] + v[1] * along[1] + v[2] * along[2];
        share[n] = e.entry[n] > least ? sum / e.entry[n] : none;
    }
    for (int n = 0; n < 3; ++n)
        point[n] = share[0] * e.column[0][n] + share[1] * e.column[1][n] + share[2] * e.column[2][n];
}

}  // namespace symmetric_matrix
