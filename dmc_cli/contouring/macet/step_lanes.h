// Steps from the middles of edges to the surface, sixteen side by side, on CUDA one: see surface_steps.py.
#pragma once
#include "builtin.h"

namespace steps {

#if defined(__clang__) && !defined(__CUDA_ARCH__) && !defined(DMC_AS_ON_GPU)
// Sixteen vertices side by side; comparisons give -1 or 0
enum { LANES = 16 };
typedef float numbers __attribute__((ext_vector_type(16)));
typedef int integers __attribute__((ext_vector_type(16)));
typedef double doubles __attribute__((ext_vector_type(16)));
static numbers root(numbers a) { return __builtin_elementwise_sqrt(a); }
static numbers least(numbers a, numbers b) { return __builtin_elementwise_min(a, b); }
static numbers most(numbers a, numbers b) { return __builtin_elementwise_max(a, b); }
static integers least(integers a, integers b) { return __builtin_elementwise_min(a, b); }
static integers most(integers a, integers b) { return __builtin_elementwise_max(a, b); }
static integers whole(numbers a) { return __builtin_convertvector(__builtin_elementwise_floor(a), integers); }
static numbers number(integers a) { return __builtin_convertvector(a, numbers); }
static bool any(integers a) { return __builtin_reduce_or(a) != 0; }
static numbers load(const float* a) {
    numbers all;
    __builtin_memcpy(&all, a, sizeof(all));
    return all;
}
static integers load(const int* a) {
    integers all;
    __builtin_memcpy(&all, a, sizeof(all));
    return all;
}
static doubles load(const double* a) {
    doubles all;
    __builtin_memcpy(&all, a, sizeof(all));
    return all;
}
static numbers narrowed(doubles a) { return __builtin_convertvector(a, numbers); }
static void store(float* a, numbers all) { __builtin_memcpy(a, &all, sizeof(all)); }
static void store(int* a, integers all) { __builtin_memcpy(a, &all, sizeof(all)); }
#else
enum { LANES = 1 };
typedef float numbers;
typedef int integers;
typedef double doubles;
static CUDA_CALLABLE float root(float a) { return sqrtf(a); }
static CUDA_CALLABLE float least(float a, float b) { return a < b ? a : b; }
static CUDA_CALLABLE float most(float a, float b) { return a > b ? a : b; }
static CUDA_CALLABLE int least(int a, int b) { return a < b ? a : b; }
static CUDA_CALLABLE int most(int a, int b) { return a > b ? a : b; }
static CUDA_CALLABLE int whole(float a) { return (int)floorf(a); }
static CUDA_CALLABLE float number(int a) { return (float)a; }
static CUDA_CALLABLE bool any(int a) { return a != 0; }
static CUDA_CALLABLE float load(const float* a) { return *a; }
static CUDA_CALLABLE int load(const int* a) { return *a; }
static CUDA_CALLABLE double load(const double* a) { return *a; }
static CUDA_CALLABLE float narrowed(double a) { return (float)a; }
static CUDA_CALLABLE void store(float* a, float all) { *a = all; }
static CUDA_CALLABLE void store(int* a, int all) { *a = all; }
#endif

// Newton steps at most; in cells the longest one, and one so short that what is left is its square
enum { MOST_STEPS = 8 };
static CUDA_CALLABLE float longest() { return 0.25f; }
static CUDA_CALLABLE float shortest() { return 2.0e-4f; }

struct Vector {
    numbers x, y, z;
};

static CUDA_CALLABLE Vector scaled(numbers a, Vector v) { return {a * v.x, a * v.y, a * v.z}; }
static CUDA_CALLABLE Vector sum(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static CUDA_CALLABLE Vector less(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static CUDA_CALLABLE Vector product(Vector a, Vector b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
static CUDA_CALLABLE numbers dot(Vector a, Vector b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
static CUDA_CALLABLE numbers length(Vector a) { return root(dot(a, a)); }
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
    const integers along = load(axis), held = load(is_held);
    edges.i = load(i);
    edges.j = load(j);
    edges.k = load(k);
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
    const Vector node = {number(edges.i), number(edges.j), number(edges.k)};
    const Vector last = {one * (float)(nx - 1), one * (float)(ny - 1), one * (float)(nz - 1)};
    edges.low = less(scaled(-one, node), edges.half);
    edges.high = less(less(last, node), edges.half);
    return edges;
}

// Return a step, shortened where it leads off the grid
static CUDA_CALLABLE Vector on_grid(const Edges& edges, Vector step) {
    return {most(edges.low.x, least(edges.high.x, step.x)), most(edges.low.y, least(edges.high.y, step.y)),
            most(edges.low.z, least(edges.high.z, step.z))};
}

// Return where a step leads
static CUDA_CALLABLE Place place_of(const Edges& edges, Vector step) {
    Place place;
    const integers none = 0;
    const Vector from = sum(edges.half, step);
    place.i = most(none, least(edges.last_i, edges.i + whole(from.x)));
    place.j = most(none, least(edges.last_j, edges.j + whole(from.y)));
    place.k = most(none, least(edges.last_k, edges.k + whole(from.z)));
    place.local =
        less(from, {number(place.i - edges.i), number(place.j - edges.j), number(place.k - edges.k)});
    return place;
}

// Return where a step leads, in node indices
static CUDA_CALLABLE Vector position_of(const Edges& edges, Vector step) {
    return sum({number(edges.i), number(edges.j), number(edges.k)}, sum(edges.half, step));
}

// F at the corners of cells, corner by corner
struct Corners {
    float f[8][LANES];
};

// Return the trilinear value at local coordinates
static CUDA_CALLABLE numbers value(const Corners& cells, Vector p) {
    numbers a = load(cells.f[0]), b = load(cells.f[2]), c = load(cells.f[4]), d = load(cells.f[6]);
    a = a + p.x * (load(cells.f[1]) - a);
    b = b + p.x * (load(cells.f[3]) - b);
    c = c + p.x * (load(cells.f[5]) - c);
    d = d + p.x * (load(cells.f[7]) - d);
    a = a + p.y * (b - a);
    c = c + p.y * (d - c);
    return a + p.z * (c - a);
}

static CUDA_CALLABLE numbers slope(numbers a, numbers b, numbers c, numbers d, numbers s, numbers t) {
    numbers low = a + s * (b - a), high = c + s * (d - c);
    return low + t * (high - low);
}

static CUDA_CALLABLE Vector gradient(const Corners& cells, Vector p) {
    const numbers f0 = load(cells.f[0]), f1 = load(cells.f[1]), f2 = load(cells.f[2]), f3 = load(cells.f[3]);
    const numbers f4 = load(cells.f[4]), f5 = load(cells.f[5]), f6 = load(cells.f[6]), f7 = load(cells.f[7]);
    return {slope(f1 - f0, f3 - f2, f5 - f4, f7 - f6, p.y, p.z),
            slope(f2 - f0, f3 - f1, f6 - f4, f7 - f5, p.x, p.z),
            slope(f4 - f0, f5 - f1, f6 - f2, f7 - f3, p.x, p.y)};
}

// Return Newton's step to zero; none where the gradient vanishes
static CUDA_CALLABLE Vector newton(numbers value, Vector gradient) {
    const numbers one = 1.0f, none = 0.0f, unflattened = 0x1p60f;
    const numbers scale = dot(gradient, gradient) < 0x1p-100f ? unflattened : one;
    const Vector longer = scaled(scale, gradient);
    const numbers square = dot(longer, longer);
    const integers is_steep = square > 0.0f;
    return scaled(is_steep ? scale * value / (is_steep ? square : one) : none, longer);
}

// Return the part of a way along the plane across a gradient
static CUDA_CALLABLE Vector along_plane(Vector way, Vector gradient) {
    const numbers one = 1.0f, none = 0.0f;
    const numbers x = most(gradient.x, -gradient.x), y = most(gradient.y, -gradient.y);
    const numbers size = most(x, most(y, most(gradient.z, -gradient.z)));
    const integers is_steep = size > 0.0f;
    const Vector short_one = scaled(is_steep ? one / (is_steep ? size : one) : none, gradient);
    const numbers square = dot(short_one, short_one);
    const numbers share = is_steep ? dot(way, short_one) / (is_steep ? square : one) : none;
    return less(way, scaled(share, short_one));
}

// Return the largest absolute value at the corners
static CUDA_CALLABLE numbers largest(const Corners& cells) {
    numbers found = 0.0f;
    for (int c = 0; c < 8; ++c) found = most(found, most(load(cells.f[c]), -load(cells.f[c])));
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
    const numbers one = 1.0f, size = length(search.step);
    const integers is_out = search.active & (size > reach);
    search.step = on_grid(edges, scaled(is_out ? reach / (is_out ? size : one) : one, search.step));
    const Place before = search.place;
    search.place = place_of(edges, search.step);
    return any(search.active &
               ((search.place.i != before.i) | (search.place.j != before.j) | (search.place.k != before.k)));
}

// Go half of a way, along the plane across the gradient
static CUDA_CALLABLE void slide(Search& search, const Edges& edges, const Corners& cells, Vector way) {
    const numbers half = 0.5f;
    const Vector slope = product(edges.free, gradient(cells, search.place.local));
    way = along_plane(product(edges.free, way), slope);
    const integers is_way = dot(way, way) < 1.0e30f;  // beside a missing cell there may be no gradient
    search.step = chosen(is_way, sum(search.step, scaled(half, way)), search.step);
}

// Make a Newton step
static CUDA_CALLABLE void descend(Search& search, const Edges& edges, const Corners& cells) {
    const numbers f = value(cells, search.place.local), one = 1.0f;
    const Vector way = newton(f, product(edges.free, gradient(cells, search.place.local)));
    const numbers size = length(way);
    const integers is_short = size <= shortest(), is_one = size<1.0e30f, is_out = size> longest();
    const numbers share = is_out ? longest() / (is_out ? size : one) : one;
    search.step = chosen(search.active & is_one, less(search.step, scaled(share, way)), search.step);
    search.found = search.found | (search.active & is_short & ((size > 0.0f) | (f == 0.0f)));
    search.active = search.active & (is_short == 0) & is_one;
}

// Return where vertices end; found are those near their edges only
static CUDA_CALLABLE Place end_search(Search& search, const Edges& edges, float reach) {
    search.step = on_grid(edges, search.step);
    search.found = search.found & (length(search.step) <= reach);
    return place_of(edges, search.step);
}

}  // namespace steps
