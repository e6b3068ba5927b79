"""Place vertices on CPU sixteen at a time, so that the compiler can use vector instructions.

The arithmetic is that of `placement`; only the loops are turned inside out. Corner values are gathered into
lanes, and one loop without a branch places all lanes. Vertices that it cannot place get local coordinates
below 0, for `exact_vertices` to place one by one.
"""

import warp as wp

from dmc_cli.bits import LANES, VECTOR_FLAGS
from dmc_cli.contouring.dual_marching_cubes.placement.exact import solve_on_steepest_axis
from dmc_cli.field import (
    ALL_EDGES,
    CornerValues,
    Field,
    FloatLanes,
    Grid,
    IntLanes,
    below_zero,
    crossed_edges,
    edges_among,
    find_block_cells,
    fits_single,
    needs_care,
    pairs_at,
    store_points,
    world_coordinate,
)

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

CornerLanes = wp.types.vector(length=8 * LANES, dtype=wp.float32)
"""F at the corners of a block's cells: corner after corner."""


@wp.func
def gather_corners(field: Field, grid: Grid, node: wp.int64, offsets: IntLanes) -> CornerLanes:
    """Return F at the corners of the cells at `node` + `offsets` of the volume."""
    row = wp.int64(grid.nx - 2 * grid.border)
    layer = row * wp.int64(grid.ny - 2 * grid.border)
    sign = field.sign
    isovalue = field.isovalue
    corners = CornerLanes()
    for r in range(4):
        at = node + wp.int64(r & 1) * row + wp.int64(r >> 1) * layer
        stored = pairs_at(field.values, field.kind, at, offsets)
        for lane in range(LANES):
            corners[2 * LANES * r + lane] = below_zero(sign * (stored[lane] - isovalue))
        for lane in range(LANES):
            corners[2 * LANES * r + LANES + lane] = below_zero(sign * (stored[LANES + lane] - isovalue))
    return corners


@wp.struct
class PlacedLanes:
    """Local coordinates of a block's vertices; u is -1 where the steepest axis gave none."""

    u: FloatLanes
    v: FloatLanes
    w: FloatLanes


@wp.func
def place_lanes(values: CornerLanes, edges: IntLanes) -> PlacedLanes:
    """Place all lanes, each the polygon of its cell's crossed edges among `edges`, a bit each."""
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
        q = solve_on_steepest_axis(f, edges_among(crossed_edges(f), wp.uint32(edges[lane])))
        u[lane] = wp.where(fits_single(f), q[0], -1.0)
        v[lane] = q[1]
        w[lane] = q[2]
    placed = PlacedLanes()
    placed.u = u
    placed.v = v
    placed.w = w
    return placed


@wp.func
def load_edges(
    local: wp.array(dtype=wp.vec3), start: wp.int32, size: wp.int32, ordinary_count: wp.int32
) -> IntLanes:
    """Return the edges among which the polygons of `size` vertices from `start` on are, a bit each.

    Those of special cells are where the local coordinates will be.
    """
    edges = IntLanes()
    for lane in range(LANES):
        edges[lane] = ALL_EDGES
    for lane in range(wp.max(ordinary_count - start, 0), size):
        edges[lane] = wp.int32(local[start + lane][0])
    return edges


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
    remaining_out: wp.array(dtype=wp.uint8),
) -> None:
    """Place a block of vertices where the axis of the steepest slope does. One thread per block."""
    block = first + wp.tid()
    start = block * LANES
    size = wp.min(LANES, cells.shape[0] - start)
    block_cells = find_block_cells(grid, cells, start, size)
    ci = block_cells.i
    cj = block_cells.j
    ck = block_cells.k
    far = block_cells.far
    values = gather_corners(field, grid, block_cells.node, block_cells.offsets)
    placed = place_lanes(values, load_edges(local_inout, start, size, ordinary_count))
    us = placed.u
    vs = placed.v
    ws = placed.w
    has_nodata = field.has_nodata
    remaining = int(0)
    for lane in range(LANES):
        care = needs_care(has_nodata, grid, ci[lane], cj[lane], ck[lane])
        remains = wp.where(us[lane] < 0.0, 1, far[lane]) | wp.where(care, 1, 0)
        us[lane] = wp.where(remains == 1, -1.0, us[lane])
        remaining |= remains
    xs = world_lanes(wp.vec4d(matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[0, 3]), ci, cj, ck, us, vs, ws)
    ys = world_lanes(wp.vec4d(matrix[1, 0], matrix[1, 1], matrix[1, 2], matrix[1, 3]), ci, cj, ck, us, vs, ws)
    zs = world_lanes(wp.vec4d(matrix[2, 0], matrix[2, 1], matrix[2, 2], matrix[2, 3]), ci, cj, ck, us, vs, ws)
    store_points(us, vs, ws, start, size, local_inout)
    store_points(xs, ys, zs, start, size, position_out)
    remaining_out[block] = wp.uint8(remaining)
