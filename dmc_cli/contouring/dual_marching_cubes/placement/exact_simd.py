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
    CornerLanes,
    CornerValues,
    Field,
    FloatLanes,
    Grid,
    IntLanes,
    crossed_edges,
    edges_among,
    find_block_cells,
    fits_single,
    gather_corners,
    needs_care,
    store_points,
    world_lanes,
)

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


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
