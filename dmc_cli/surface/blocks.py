"""Vertices on CPU: sixteen at a time, so that the compiler can use vector instructions.

The arithmetic is that of `placement`; only the loops are turned inside out. Corner values are gathered into
lanes, and one loop without a branch places all lanes, each as the one polygon of its cell. Vertices that it
cannot place, and those that are one of several polygons, get local coordinates below 0, for `exact_vertices`
to place one by one.
"""

import warp as wp

from dmc_cli.surface.field import Field, needs_care
from dmc_cli.surface.grid import Grid, world_coordinate
from dmc_cli.surface.placement import crossed_edges, solve_on_steepest_axis
from dmc_cli.surface.stored import DoubleLanes, IntLanes, values_at
from dmc_cli.surface.trilinear import CornerValues, below_zero, fits_single
from dmc_cli.surface.words import LANES, VECTOR_FLAGS

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

ONE_OF_SEVERAL = wp.constant(wp.vec3(-2.0, -2.0, -2.0))
"""Local coordinates, at first, of a vertex that does not stand for all crossed edges of its cell."""

FloatLanes = wp.types.vector(length=LANES, dtype=wp.float32)
CornerLanes = wp.types.vector(length=8 * LANES, dtype=wp.float32)
"""F at the corners of a block's cells: corner after corner."""

FARTHEST = wp.constant(wp.float64(2**30))
"""Nodes between the first cell of a block and the others at most; what is farther is placed one by one."""


@wp.func
def gather_corners(field: Field, node: wp.int64, offsets: IntLanes, nx: wp.int32, ny: wp.int32) -> CornerLanes:
    """Return F at the corners of the cells at `node` + `offsets` of a volume of nx x ny nodes a layer."""
    row = wp.int64(nx)
    layer = row * wp.int64(ny)
    sign = field.sign
    isovalue = field.isovalue
    corners = CornerLanes()
    for c in range(8):
        at = node + wp.int64(c & 1) + wp.int64((c >> 1) & 1) * row + wp.int64(c >> 2) * layer
        stored = values_at(field.values, field.kind, at, offsets)
        for lane in range(LANES):
            corners[c * LANES + lane] = below_zero(sign * (stored[lane] - isovalue))
    return corners


@wp.struct
class PlacedLanes:
    """Local coordinates of a block's vertices; u is -1 where the steepest axis gave none."""

    u: FloatLanes
    v: FloatLanes
    w: FloatLanes


@wp.func
def place_lanes(values: CornerLanes) -> PlacedLanes:
    """Place all lanes as the only polygon of their cell."""
    u = FloatLanes()
    v = FloatLanes()
    w = FloatLanes()
    for lane in range(LANES):
        f = CornerValues(
            values[lane],
            values[LANES + lane],
            values[2 * LANES + lane],
            values[3 * LANES + lane],
            values[4 * LANES + lane],
            values[5 * LANES + lane],
            values[6 * LANES + lane],
            values[7 * LANES + lane],
        )
        q = solve_on_steepest_axis(f, crossed_edges(f))
        u[lane] = wp.where(fits_single(f), q[0], -1.0)
        v[lane] = q[1]
        w[lane] = q[2]
    placed = PlacedLanes()
    placed.u = u
    placed.v = v
    placed.w = w
    return placed


@wp.func
def world_lanes(
    m: wp.vec4d, i: IntLanes, j: IntLanes, k: IntLanes, u: FloatLanes, v: FloatLanes, w: FloatLanes
) -> FloatLanes:
    """Return one world coordinate of points of cells; m is that row of the affine map."""
    world = FloatLanes()
    a = m[0]
    b = m[1]
    c = m[2]
    d = m[3]
    for lane in range(LANES):
        x = wp.float64(i[lane]) + wp.float64(u[lane])
        y = wp.float64(j[lane]) + wp.float64(v[lane])
        z = wp.float64(k[lane]) + wp.float64(w[lane])
        world[lane] = world_coordinate(a, b, c, d, x, y, z)
    return world


@wp.func_native(
    """
    const long long* first = (const long long*)cells.data + start;
    wp::vec_t<16, double> numbers;
    if (size == 16) {
        for (int lane = 0; lane < 16; ++lane) numbers[lane] = (double)first[lane];
    } else {
        for (int lane = 0; lane < 16; ++lane) numbers[lane] = (double)first[lane < size ? lane : size - 1];
    }
    return numbers;
    """
)
def load_cells(cells: wp.array(dtype=wp.int64), start: wp.int32, size: wp.int32) -> DoubleLanes:
    """Return the numbers of `size` cells from `start` on, the last one again for the lanes that are left."""
    ...


@wp.func_native(
    """
    float* points = (float*)out.data + 3 * (size_t)start;
    if (size == 16) {
        for (int lane = 0; lane < 16; ++lane) {
            points[3 * lane] = x[lane];
            points[3 * lane + 1] = y[lane];
            points[3 * lane + 2] = z[lane];
        }
    } else {
        for (int lane = 0; lane < size; ++lane) {
            points[3 * lane] = x[lane];
            points[3 * lane + 1] = y[lane];
            points[3 * lane + 2] = z[lane];
        }
    }
    """
)
def store_points(
    x: FloatLanes, y: FloatLanes, z: FloatLanes, start: wp.int32, size: wp.int32, out: wp.array(dtype=wp.vec3)
):
    """Store the first `size` of sixteen points from `start` on."""
    ...


@wp.func
def whole_part(a: wp.float64, inverse: wp.float64) -> wp.int32:
    """Return a divided by an integer, given as its inverse; exact for a below 2^50."""
    return wp.int32((a + wp.float64(0.5)) * inverse)


@wp.kernel
def place_block_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    ordinary_count: wp.int32,
    cells: wp.array(dtype=wp.int64),
    # In/out:
    local_inout: wp.array(dtype=wp.vec3),
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    left_out: wp.array(dtype=wp.uint8),
):
    """Place a block of vertices, as far as each is all of its cell's surface. One thread a block."""
    block = first + wp.tid()
    start = block * LANES
    size = wp.min(LANES, cells.shape[0] - start)
    ci = IntLanes()
    cj = IntLanes()
    ck = IntLanes()
    nodes = DoubleLanes()
    b = grid.border
    nx = grid.nx - 2 * b
    ny = grid.ny - 2 * b
    nz = grid.nz - 2 * b
    a_row = wp.float64(grid.nx)
    inverse_row = wp.float64(1.0) / a_row
    inverse_layer = wp.float64(1.0) / wp.float64(grid.ny)
    numbers = load_cells(cells, start, size)
    for lane in range(LANES):
        row = whole_part(numbers[lane], inverse_row)
        k = whole_part(wp.float64(row), inverse_layer)
        i = wp.int32(numbers[lane] - wp.float64(row) * a_row)
        j = row - k * grid.ny
        ci[lane] = i
        cj[lane] = j
        ck[lane] = k
        # any cell of the volume does for one that needs care: it is done again
        volume_row = wp.float64(wp.clamp(k - b, 0, nz - 2)) * wp.float64(ny) + wp.float64(wp.clamp(j - b, 0, ny - 2))
        nodes[lane] = volume_row * wp.float64(nx) + wp.float64(wp.clamp(i - b, 0, nx - 2))
    node = nodes[0]
    offsets = IntLanes()
    far = IntLanes()
    for lane in range(LANES):
        distance = nodes[lane] - node
        is_far = wp.abs(distance) > FARTHEST
        far[lane] = wp.where(is_far, 1, 0)
        offsets[lane] = wp.int32(wp.where(is_far, wp.float64(0.0), distance))
    values = gather_corners(field, wp.int64(node), offsets, nx, ny)
    placed = place_lanes(values)
    us = placed.u
    vs = placed.v
    ws = placed.w
    has_absent = field.has_absent
    left = int(0)
    for lane in range(LANES):
        care = needs_care(has_absent, grid, ci[lane], cj[lane], ck[lane])
        is_left = wp.where(us[lane] < 0.0, 1, far[lane]) | wp.where(care, 1, 0)
        us[lane] = wp.where(is_left == 1, -1.0, us[lane])
        left |= is_left
    if start + size > ordinary_count:
        for lane in range(size):
            if start + lane >= ordinary_count:
                if local_inout[start + lane][0] < -1.0:
                    us[lane] = -1.0
                    left = 1
    xs = world_lanes(wp.vec4d(matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[0, 3]), ci, cj, ck, us, vs, ws)
    ys = world_lanes(wp.vec4d(matrix[1, 0], matrix[1, 1], matrix[1, 2], matrix[1, 3]), ci, cj, ck, us, vs, ws)
    zs = world_lanes(wp.vec4d(matrix[2, 0], matrix[2, 1], matrix[2, 2], matrix[2, 3]), ci, cj, ck, us, vs, ws)
    store_points(us, vs, ws, start, size, local_inout)
    store_points(xs, ys, zs, start, size, position_out)
    left_out[block] = wp.uint8(left)
