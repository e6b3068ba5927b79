// F at nodes of the grid by stored values, virtual nodes and missing values seen to: see surface_steps.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/contouring/macet/step_lanes.h"
#include "dmc_cli/runtime/pointers.h"

namespace grid_values {

// What `Field` and `Grid` tell of the values: see field.py
struct Source {
    double isovalue, sign, farthest, outside, at_least, nodata, padding_low, padding_high;
    bool has_nodata;
    int border;
    int nodes[3];
    long long row, layer;  // how far the nodes of the volume lie behind one another along y and z
};

// Return F of stored values
static CUDA_CALLABLE steps::numbers distances(const Source& source, const double* stored) {
    const lanes::doubles f = source.sign * (lanes::load(stored) - source.isovalue), none = 0.0;
    const lanes::doubles most = none + source.farthest, least = none - source.farthest;
    return lanes::narrowed(f > most ? most : f < least ? least : f);
}

static CUDA_CALLABLE double distance(const Source& source, double stored) {
    const double f = source.sign * (stored - source.isovalue);
    return f > source.farthest ? source.farthest : f < -source.farthest ? -source.farthest : f;
}

// Return the layer of the volume, along an axis, that is nearest to a layer of the grid
static CUDA_CALLABLE int nearest(const Source& source, int layer, int axis) {
    const int last = source.nodes[axis] - 2 * source.border - 1, at = layer - source.border;
    return at < 0 ? 0 : at > last ? last : at;
}

// Return whether a cell of the grid has virtual nodes
static CUDA_CALLABLE bool is_outer(const Source& source, int i, int j, int k) {
    if (source.border == 0) return false;
    return i == 0 || j == 0 || k == 0 || i == source.nodes[0] - 2 || j == source.nodes[1] - 2 ||
           k == source.nodes[2] - 2;
}

// Return the node of the volume at the lowest corner of a cell without virtual nodes
static CUDA_CALLABLE long long lowest_node(const Source& source, int i, int j, int k) {
    const int b = source.border;
    return (k - b) * source.layer + (j - b) * source.row + (i - b);
}

// Return the node of the volume that is nearest to a corner of a cell
static CUDA_CALLABLE long long nearest_node(const Source& source, int i, int j, int k, int corner) {
    return nearest(source, i + (corner & 1), 0) + nearest(source, j + (corner >> 1 & 1), 1) * source.row +
           nearest(source, k + (corner >> 2), 2) * source.layer;
}

// Return F at a corner of a cell whose nearest node has a stored value
static CUDA_CALLABLE double value_at(const Source& source, double stored, int i, int j, int k, int corner) {
    const int b = source.border, x = i + (corner & 1), y = j + (corner >> 1 & 1), z = k + (corner >> 2);
    const bool is_virtual = x < b || y < b || z < b || x >= source.nodes[0] - b || y >= source.nodes[1] - b ||
                            z >= source.nodes[2] - b;
    const bool is_data =
        stored - stored == 0.0 && (stored < source.padding_low || stored > source.padding_high);
    double f = distance(source, stored);
    if (b && source.has_nodata && !is_data) f = source.nodata;
    if (!is_virtual) return f;
    f = f < 0.0 ? -f : f;
    return source.outside * (f > source.at_least ? f : source.at_least);
}

// Return whether cells need care, and which: those with virtual nodes or, in such a grid, missing values, and
// those whose values single precision may not hold
static CUDA_CALLABLE bool find_care(const Source& source, const int* i, const int* j, const int* k,
                                    const steps::Corners& cells, int* needs_care) {
    const steps::numbers largest = steps::largest(cells);
    lanes::store(needs_care, ((largest > 1.0e-15f) & (largest < 1.0e15f)) == 0);
    bool any = false;
    for (int lane = 0; lane < steps::LANES; ++lane) {
        if (source.border && (source.has_nodata || is_outer(source, i[lane], j[lane], k[lane])))
            needs_care[lane] = 1;
        any |= needs_care[lane] != 0;
    }
    return any;
}

}  // namespace grid_values
