// Steps from the middles of edges to the surface, sixteen side by side, on CUDA one: see surface_steps.py.
#pragma once
#include "builtin.h"
#include "dmc_cli/field/lane_vectors.h"

namespace steps {

enum { LANES = lanes::LANES };
typedef lanes::numbers numbers;
typedef lanes::integers integers;
typedef vectors::Vector Vector;

// Newton steps at most; in cells the longest one, and one so short that what is left is its square
enum { MOST_STEPS = 8 };
static CUDA_CALLABLE float longest() { return 0.25f; }
static CUDA_CALLABLE float shortest() { return 2.0e-4f; }

static CUDA_CALLABLE Vector product(Vector a, Vector b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
static CUDA_CALLABLE Vector chosen(integers is_first, Vector a, Vector b) {
    return {is_first ? a.x : b.x, is_first ? a.y : b.y, is_first ? a.z : b.z};
}

// Edges, and steps from their middles: the lower nodes, the middles as seen from these, the axes along which
// vertices may move, and the shortest and longest steps on the grid
struct Edges {
    integers i, j, k;
    integers last_i, last_j, last_k;  // cells
    Vector half, free, low, high;
};

// A step's cell and local coordinates
struct Place {
    integers i, j, k;
    Vector local;
};

static CUDA_CALLABLE Edges edges_at(const int* i, const int* j, const int* k, const int* axis,
                                    const int* is_held, int nx, int ny, int nz) {
    Edges edges;
    const numbers one = 1.0f, none = 0.0f, half = 0.5f;
    const integers along = lanes::load(axis), held = lanes::load(is_held);
    edges.i = lanes::load(i);
    edges.j = lanes::load(j);
    edges.k = lanes::load(k);
    const integers no_cell = 0;
    edges.last_i = no_cell + (nx - 2);
    edges.last_j = no_cell + (ny - 2);
    edges.last_k = no_cell + (nz - 2);
    edges.half = {along == 0 ? half : none, along == 1 ? half : none, along == 2 ? half : none};
    const integers inner_x = (edges.i > 0) & (edges.i < nx - 1) & (held == 0);
    const integers inner_y = (edges.j > 0) & (edges.j < ny - 1) & (held == 0);
    const integers inner_z = (edges.k > 0) & (edges.k < nz - 1) & (held == 0);
    edges.free = {(along == 0) | inner_x ? one : none, (along == 1) | inner_y ? one : none,
                  (along == 2) | inner_z ? one : none};
    const Vector node = {lanes::number(edges.i), lanes::number(edges.j), lanes::number(edges.k)};
    const Vector last = {one * (float)(nx - 1), one * (float)(ny - 1), one * (float)(nz - 1)};
    edges.low = vectors::less(vectors::scaled(-one, node), edges.half);
    edges.high = vectors::less(vectors::less(last, node), edges.half);
    return edges;
}

// Return a step, shortened where it leads off the grid
static CUDA_CALLABLE Vector on_grid(const Edges& edges, Vector step) {
    return {lanes::most(edges.low.x, lanes::least(edges.high.x, step.x)),
            lanes::most(edges.low.y, lanes::least(edges.high.y, step.y)),
            lanes::most(edges.low.z, lanes::least(edges.high.z, step.z))};
}

// Return where a step leads
static CUDA_CALLABLE Place place_of(const Edges& edges, Vector step) {
    Place place;
    const integers none = 0;
    const Vector from = vectors::sum(edges.half, step);
    place.i = lanes::most(none, lanes::least(edges.last_i, edges.i + lanes::whole(from.x)));
    place.j = lanes::most(none, lanes::least(edges.last_j, edges.j + lanes::whole(from.y)));
    place.k = lanes::most(none, lanes::least(edges.last_k, edges.k + lanes::whole(from.z)));
    place.local = vectors::less(from, {lanes::number(place.i - edges.i), lanes::number(place.j - edges.j),
                                       lanes::number(place.k - edges.k)});
    return place;
}

// Return where a step leads, in node indices
static CUDA_CALLABLE Vector position_of(const Edges& edges, Vector step) {
    return vectors::sum({lanes::number(edges.i), lanes::number(edges.j), lanes::number(edges.k)},
                        vectors::sum(edges.half, step));
}

// F at the corners of cells, corner by corner
struct Corners {
    float f[8][LANES];
};

// Return the trilinear value at local coordinates
static CUDA_CALLABLE numbers value(const Corners& cells, Vector p) {
    numbers a = lanes::load(cells.f[0]), b = lanes::load(cells.f[2]), c = lanes::load(cells.f[4]),
            d = lanes::load(cells.f[6]);
    a = a + p.x * (lanes::load(cells.f[1]) - a);
    b = b + p.x * (lanes::load(cells.f[3]) - b);
    c = c + p.x * (lanes::load(cells.f[5]) - c);
    d = d + p.x * (lanes::load(cells.f[7]) - d);
    a = a + p.y * (b - a);
    c = c + p.y * (d - c);
    return a + p.z * (c - a);
}

static CUDA_CALLABLE numbers slope(numbers a, numbers b, numbers c, numbers d, numbers s, numbers t) {
    numbers low = a + s * (b - a), high = c + s * (d - c);
    return low + t * (high - low);
}

static CUDA_CALLABLE Vector gradient(const Corners& cells, Vector p) {
    const numbers f0 = lanes::load(cells.f[0]), f1 = lanes::load(cells.f[1]), f2 = lanes::load(cells.f[2]),
                  f3 = lanes::load(cells.f[3]);
    const numbers f4 = lanes::load(cells.f[4]), f5 = lanes::load(cells.f[5]), f6 = lanes::load(cells.f[6]),
                  f7 = lanes::load(cells.f[7]);
    return {slope(f1 - f0, f3 - f2, f5 - f4, f7 - f6, p.y, p.z),
            slope(f2 - f0, f3 - f1, f6 - f4, f7 - f5, p.x, p.z),
            slope(f4 - f0, f5 - f1, f6 - f2, f7 - f3, p.x, p.y)};
}

// Return Newton's step to zero; none where the gradient vanishes
static CUDA_CALLABLE Vector newton(numbers value, Vector gradient) {
    const numbers one = 1.0f, none = 0.0f, unflattened = 0x1p60f;
    const numbers scale = vectors::dot(gradient, gradient) < 0x1p-100f ? unflattened : one;
    const Vector longer = vectors::scaled(scale, gradient);
    const numbers square = vectors::dot(longer, longer);
    const integers is_steep = square > 0.0f;
    return vectors::scaled(is_steep ? scale * value / (is_steep ? square : one) : none, longer);
}

// Return the part of a way along the plane across a gradient
static CUDA_CALLABLE Vector along_plane(Vector way, Vector gradient) {
    const numbers one = 1.0f, none = 0.0f;
    const numbers x = lanes::most(gradient.x, -gradient.x), y = lanes::most(gradient.y, -gradient.y);
    const numbers size = lanes::most(x, lanes::most(y, lanes::most(gradient.z, -gradient.z)));
    const integers is_steep = size > 0.0f;
    const Vector short_one = vectors::scaled(is_steep ? one / (is_steep ? size : one) : none, gradient);
    const numbers square = vectors::dot(short_one, short_one);
    const numbers share = is_steep ? vectors::dot(way, short_one) / (is_steep ? square : one) : none;
    return vectors::less(way, vectors::scaled(share, short_one));
}

// Return the largest absolute value at the corners
static CUDA_CALLABLE numbers largest(const Corners& cells) {
    numbers found = 0.0f;
    for (int c = 0; c < 8; ++c)
        found = lanes::most(found, lanes::most(lanes::load(cells.f[c]), -lanes::load(cells.f[c])));
    return found;
}

// Write F at a cell's corners into a lane, scaled so that single precision holds it
static CUDA_CALLABLE void store_scaled(const double* corners, Corners& cells, int lane) {
    double largest = 0.0;
    for (int c = 0; c < 8; ++c) {
        const double size = corners[c] < 0.0 ? -corners[c] : corners[c];
        largest = size > largest ? size : largest;
    }
    const double lift = largest < 0x1p-1000 ? 0x1p100 : 1.0, scale = largest > 0.0 ? lift * largest : 1.0;
    for (int c = 0; c < 8; ++c) cells.f[c][lane] = (float)(lift * corners[c] / scale);
}

// The way of vertices to the surface: where they are, which have not ended, which have reached it
struct Search {
    Vector step;
    Place place;
    integers active, found;
};

static CUDA_CALLABLE Search begin_search(Vector step) {
    Search search;
    const integers none = 0;
    search.step = step;
    search.place.i = search.place.j = search.place.k = none - 1;
    search.active = none == 0;
    search.found = none;
    return search;
}

// Bound the steps, find where they lead, and return whether any leads to another cell than before
static CUDA_CALLABLE bool enter_cells(Search& search, const Edges& edges, float reach) {
    const numbers one = 1.0f, size = vectors::length(search.step);
    const integers is_out = search.active & (size > reach);
    search.step = on_grid(edges, vectors::scaled(is_out ? reach / (is_out ? size : one) : one, search.step));
    const Place before = search.place;
    search.place = place_of(edges, search.step);
    return lanes::any(search.active & ((search.place.i != before.i) | (search.place.j != before.j) |
                                       (search.place.k != before.k)));
}

// Go half of a way, along the plane across the gradient
static CUDA_CALLABLE void slide(Search& search, const Edges& edges, const Corners& cells, Vector way) {
    const numbers half = 0.5f;
    const Vector slope = product(edges.free, gradient(cells, search.place.local));
    way = along_plane(product(edges.free, way), slope);
    // beside a missing cell there may be no gradient
    const integers is_way = vectors::dot(way, way) < 1.0e30f;
    search.step = chosen(is_way, vectors::sum(search.step, vectors::scaled(half, way)), search.step);
}

// Make a Newton step
static CUDA_CALLABLE void descend(Search& search, const Edges& edges, const Corners& cells) {
    const numbers f = value(cells, search.place.local), one = 1.0f;
    const Vector way = newton(f, product(edges.free, gradient(cells, search.place.local)));
    const numbers size = vectors::length(way);
    const integers is_short = size <= shortest(), is_one = size<1.0e30f, is_out = size> longest();
    const numbers share = is_out ? longest() / (is_out ? size : one) : one;
    search.step =
        chosen(search.active & is_one, vectors::less(search.step, vectors::scaled(share, way)), search.step);
    search.found = search.found | (search.active & is_short & ((size > 0.0f) | (f == 0.0f)));
    search.active = search.active & (is_short == 0) & is_one;
}

// Return where vertices end; found are those near their edges only
static CUDA_CALLABLE Place end_search(Search& search, const Edges& edges, float reach) {
    search.step = on_grid(edges, search.step);
    search.found = search.found & (vectors::length(search.step) <= reach);
    return place_of(edges, search.step);
}

}  // namespace steps
