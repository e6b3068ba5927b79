// Take edges a batch at a time, and write down where their vertices go: see surface_steps.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/contouring/macet/step_lanes.h"
#include "dmc_cli/runtime/pointers.h"

namespace edge_batch {

enum { LANES = steps::LANES };

// The cells that exist
struct Cells {
    POINTER(const unsigned int) bits;
    bool is_marked;  // else all do
    int words, ahead;
    int nodes[3];
};

static CUDA_CALLABLE bool exists(const Cells& cells, int i, int j, int k) {
    const int* nodes = cells.nodes;
    if (i < 0 || j < 0 || k < 0 || i >= nodes[0] - 1 || j >= nodes[1] - 1 || k >= nodes[2] - 1) return false;
    if (!cells.is_marked) return true;
    return (cells.bits[cells.ahead + (j + k * nodes[1]) * cells.words + i / 32] >> i % 32 & 1) != 0;
}

// The arrays of `Steps`, as numbers
struct Vertices {
    POINTER(long long) cell;
    POINTER(float) local;
    POINTER(float) step;
    POINTER(float) position;
    POINTER(const float) crossing;
};

// Edges by their lower nodes and axes, and whether a vertex stays on its edge beside a cell that does not
// exist; the vertices follow each other from the first one on
struct Batch {
    int i[LANES], j[LANES], k[LANES], axis[LANES], is_held[LANES];
    long long vertex;
    int used;
};

// Edges along an axis from the nodes of row (j, k); the cells of their vertices lie in rows after `before`
// cells, where none is missing
struct Row {
    int j, k, axis;
    long long before;
};

static CUDA_CALLABLE long long cells_before(const Cells& cells, int j, int k) {
    return ((long long)k * cells.nodes[1] + j) * cells.nodes[0];
}

static CUDA_CALLABLE Row row_of(const Cells& cells, int j, int k, int axis) {
    const int back_y = axis != 1 && j == cells.nodes[1] - 1, back_z = axis != 2 && k == cells.nodes[2] - 1;
    return {j, k, axis, cells_before(cells, j - back_y, k - back_z)};
}

// Return whether a cell at an edge does not exist
static CUDA_CALLABLE bool is_beside_missing(const Cells& cells, int i, int j, int k, int axis) {
    bool is_missing = false;
    for (int n = 0; n < 4; ++n) {
        int beside[3] = {i, j, k};
        beside[(axis + 1) % 3] -= n & 1;
        beside[(axis + 2) % 3] -= n >> 1;
        is_missing |= !exists(cells, beside[0], beside[1], beside[2]);
    }
    return is_missing;
}

// Add the edge of a vertex
static CUDA_CALLABLE void add(Batch& batch, const Vertices& vertices, const Cells& cells, const Row& row,
                              long long v) {
    POINTER(const float) local = vertices.local + 3 * v;
    long long before = row.before;
    if (cells.is_marked)
        before = cells_before(cells, row.j - (row.axis == 1 ? 0 : (int)local[1]),
                              row.k - (row.axis == 2 ? 0 : (int)local[2]));
    const int lane = batch.used++, i = (int)(vertices.cell[v] - before) + (row.axis == 0 ? 0 : (int)local[0]);
    batch.vertex = v - lane;
    batch.i[lane] = i;
    batch.j[lane] = row.j;
    batch.k[lane] = row.k;
    batch.axis[lane] = row.axis;
    batch.is_held[lane] = cells.is_marked && is_beside_missing(cells, i, row.j, row.k, row.axis);
}

// Have lanes without an edge do what the first one does
static CUDA_CALLABLE void fill(Batch& batch) {
    for (int lane = batch.used; lane < LANES; ++lane) {
        batch.i[lane] = batch.i[0];
        batch.j[lane] = batch.j[0];
        batch.k[lane] = batch.k[0];
        batch.axis[lane] = batch.axis[0];
        batch.is_held[lane] = batch.is_held[0];
    }
}

// Return the vertex of a lane
static CUDA_CALLABLE long long vertex_of(const Batch& batch, int lane) {
    return batch.vertex + (lane < batch.used ? lane : 0);
}

// Return the steps that lead to the edges' crossings
static CUDA_CALLABLE steps::Vector steps_to_crossings(const Batch& batch, const Vertices& vertices,
                                                      const steps::Edges& edges) {
    float along[LANES];
    for (int lane = 0; lane < LANES; ++lane) along[lane] = vertices.crossing[vertex_of(batch, lane)] - 0.5f;
    const steps::numbers one = 1.0f;
    return vectors::scaled(one + one, vectors::scaled(lanes::load(along), edges.half));
}

// Return the vectors of a batch in an array of `width` numbers each
static CUDA_CALLABLE steps::Vector gathered(const Batch& batch, POINTER(const float) array, int width) {
    float numbers[3][LANES];
    for (int lane = 0; lane < LANES; ++lane)
        for (int n = 0; n < 3; ++n) numbers[n][lane] = array[width * vertex_of(batch, lane) + n];
    return {lanes::load(numbers[0]), lanes::load(numbers[1]), lanes::load(numbers[2])};
}

// Return the ways from vertices to the means of their neighbours, by the sums of these
static CUDA_CALLABLE steps::Vector ways_to_means(const Batch& batch, const Vertices& vertices,
                                                 POINTER(const float) sums) {
    float count[LANES];
    for (int lane = 0; lane < LANES; ++lane) count[lane] = sums[4 * vertex_of(batch, lane) + 3];
    const steps::numbers one = 1.0f;
    const steps::Vector means = vectors::scaled(one / lanes::load(count), gathered(batch, sums, 4));
    return vectors::less(means, gathered(batch, vertices.position, 3));
}

static CUDA_CALLABLE void scatter(const Batch& batch, const steps::Vector& vectors, POINTER(float) array) {
    float numbers[3][LANES];
    lanes::store(numbers[0], vectors.x);
    lanes::store(numbers[1], vectors.y);
    lanes::store(numbers[2], vectors.z);
    POINTER(float) own = array + 3 * batch.vertex;
    for (int lane = 0; lane < batch.used; ++lane)
        for (int n = 0; n < 3; ++n) own[3 * lane + n] = numbers[n][lane];
}

// Leave only lanes whose place is in a cell that exists
static CUDA_CALLABLE steps::integers in_cells(steps::integers found, const steps::Place& place,
                                              const Cells& cells) {
    if (!cells.is_marked) return found;
    int i[LANES], j[LANES], k[LANES], is_found[LANES];
    lanes::store(i, place.i);
    lanes::store(j, place.j);
    lanes::store(k, place.k);
    lanes::store(is_found, found);
    for (int lane = 0; lane < LANES; ++lane)
        is_found[lane] = is_found[lane] && exists(cells, i[lane], j[lane], k[lane]) ? 1 : 0;
    return lanes::load(is_found) != 0;
}

// Return one world coordinate in double precision, rounded once, as `world_coordinate` does
static CUDA_CALLABLE float coordinate(const wp::vec_t<4, wp::float64>& row, double x, double y, double z) {
    return (float)(row[0] * x + row[1] * y + row[2] * z + row[3]);
}

// Write down where vertices end; those that are held stay in the cell that they have
static CUDA_CALLABLE void store_places(const Batch& batch, const Vertices& vertices, const Cells& cells,
                                       const steps::Place& place, const steps::Edges& edges,
                                       const steps::Vector& step, const wp::vec_t<4, wp::float64>& to_x,
                                       const wp::vec_t<4, wp::float64>& to_y,
                                       const wp::vec_t<4, wp::float64>& to_z) {
    int i[LANES], j[LANES], k[LANES];
    float u[LANES], v[LANES], w[LANES], along[LANES], x[LANES], y[LANES], z[LANES];
    const steps::numbers one = 1.0f, half = 0.5f;
    const steps::integers held = lanes::load(batch.is_held);
    const steps::Vector axis = vectors::scaled(one + one, edges.half);
    const steps::numbers on_axis = half + vectors::dot(step, axis);
    const steps::Vector on_edge = vectors::scaled(on_axis, axis);
    lanes::store(i, held ? edges.i : place.i);
    lanes::store(j, held ? edges.j : place.j);
    lanes::store(k, held ? edges.k : place.k);
    lanes::store(u, held ? on_edge.x : place.local.x);
    lanes::store(v, held ? on_edge.y : place.local.y);
    lanes::store(w, held ? on_edge.z : place.local.z);
    lanes::store(along, on_axis);
    for (int lane = 0; lane < LANES; ++lane) {
        const double p = (double)i[lane] + (double)u[lane], q = (double)j[lane] + (double)v[lane];
        const double r = (double)k[lane] + (double)w[lane];
        x[lane] = coordinate(to_x, p, q, r);
        y[lane] = coordinate(to_y, p, q, r);
        z[lane] = coordinate(to_z, p, q, r);
    }
    POINTER(float) position = vertices.position + 3 * batch.vertex;
    POINTER(float) local = vertices.local + 3 * batch.vertex;
    POINTER(long long) cell = vertices.cell + batch.vertex;
    for (int lane = 0; lane < batch.used; ++lane) {
        position[3 * lane] = x[lane];
        position[3 * lane + 1] = y[lane];
        position[3 * lane + 2] = z[lane];
        if (batch.is_held[lane]) {
            local[3 * lane + batch.axis[lane]] = along[lane];
            continue;
        }
        local[3 * lane] = u[lane];
        local[3 * lane + 1] = v[lane];
        local[3 * lane + 2] = w[lane];
        cell[lane] = i[lane] + ((long long)k[lane] * cells.nodes[1] + j[lane]) * cells.nodes[0];
    }
}

}  // namespace edge_batch
