# Typed by Warp's own compiler.
# mypy: ignore-errors
"""Vertex normals: central differences at the nodes, interpolated trilinearly in the cell.

Central differences have a smaller truncation error than the interpolant's own gradient and give smoother
shading (Grosso & Zint 2021, section 3.1.2). At the grid's border, and beside a node without data, the
difference is one-sided with the divisor that belongs to it. A normal goes to the output space by the
inverse transpose of the affine and has unit length; where the gradient vanishes it is (0, 0, 1).
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.settings import SurfaceSettings
from dmc_cli.surface.field import Field, is_data, node_of_volume, node_value, stored_value
from dmc_cli.surface.grid import Grid
from dmc_cli.surface.slices import node_distance
from dmc_cli.surface.surface import Surface

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


def _stencil() -> list[tuple[int, int, int]]:
    """Return the nodes whose differences count in a cell: on its four edges along x, then what y and z add."""
    square = [(a, b) for b in (0, 1) for a in (0, 1)]
    along_x = [(x, y, z) for y, z in square for x in (-1, 0, 1, 2)]
    along_y = [(x, y, z) for y in (-1, 2) for x, z in square]
    along_z = [(x, y, z) for z in (-1, 2) for x, y in square]
    return along_x + along_y + along_z


STENCIL = len(_stencil())
"""Nodes of the stencil: 32."""

StencilValues = wp.types.vector(length=STENCIL, dtype=wp.float64)
StencilSteps = wp.types.vector(length=STENCIL, dtype=wp.int32)

STENCIL_X, STENCIL_Y, STENCIL_Z = (
    wp.constant(StencilSteps(*[step[axis] for step in _stencil()])) for axis in range(3)
)


def compute_normals(surface: Surface, settings: SurfaceSettings) -> Any:
    """Return the unit normals of a surface's vertices in the output space, float32 vec3 (V,).

    They point towards lower values, or with `orientation` gradient or `inside` below towards higher ones.
    """
    device = surface.device
    normals = device.empty(surface.vertices.shape[0], wp.vec3)
    towards_higher = settings.orientation == "gradient" or settings.inside == "below"
    to_output = np.linalg.inv(surface.affine[:3, :3]).T * (1.0 if towards_higher else -1.0)
    inputs = [
        surface.grid.struct(),
        surface.field,
        wp.mat33(*to_output.ravel()),
        surface.depths,
        surface.vertex_cell,
        surface.vertex_local,
    ]
    device.launch(compute_normals_kernel, surface.vertices.shape[0], inputs, [normals])
    return normals


@wp.func
def mixed(a: wp.float64, b: wp.float64, c: wp.float64, d: wp.float64, s: wp.float64, t: wp.float64) -> wp.float64:
    """Interpolate between the corners low low, high low, low high, high high of a square, at (s, t)."""
    low = a + s * (b - a)
    high = c + s * (d - c)
    return low + t * (high - low)


@wp.func
def difference(
    before: wp.float64, at_0: wp.float64, at_1: wp.float64, after: wp.float64, t: wp.float64
) -> wp.float32:
    """Interpolate between the central differences at positions 0 and 1, t of the way."""
    low = at_1 - before
    high = after - at_0
    return wp.float32(wp.float64(0.5) * (low + t * (high - low)))


@wp.func
def interior_gradient(f: StencilValues, p: wp.vec3) -> wp.vec3:
    """Return the gradient of the stored values in a cell whose neighbours all exist, from its stencil."""
    u = wp.float64(p[0])
    v = wp.float64(p[1])
    w = wp.float64(p[2])
    return wp.vec3(
        difference(
            mixed(f[0], f[4], f[8], f[12], v, w),
            mixed(f[1], f[5], f[9], f[13], v, w),
            mixed(f[2], f[6], f[10], f[14], v, w),
            mixed(f[3], f[7], f[11], f[15], v, w),
            u,
        ),
        difference(
            mixed(f[16], f[17], f[18], f[19], u, w),
            mixed(f[1], f[2], f[9], f[10], u, w),
            mixed(f[5], f[6], f[13], f[14], u, w),
            mixed(f[20], f[21], f[22], f[23], u, w),
            v,
        ),
        difference(
            mixed(f[24], f[25], f[26], f[27], u, v),
            mixed(f[1], f[2], f[5], f[6], u, v),
            mixed(f[9], f[10], f[13], f[14], u, v),
            mixed(f[28], f[29], f[30], f[31], u, v),
            w,
        ),
    )


@wp.func
def stencil_step(n: wp.int32, row: wp.int64, layer: wp.int64) -> wp.int64:
    """Return how far node n of the stencil is from the cell's lowest, rows and layers of nodes so far apart."""
    return wp.int64(STENCIL_X[n]) + wp.int64(STENCIL_Y[n]) * row + wp.int64(STENCIL_Z[n]) * layer


@wp.func
def has_value(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.bool:
    """Return whether a node is on the grid and, at an open border, has data."""
    found = i >= 0 and j >= 0 and k >= 0 and i < grid.nx and j < grid.ny and k < grid.nz
    if found and field.has_absent == 1 and grid.border == 0:
        found = is_data(field, stored_value(field, node_of_volume(grid, i, j, k)))
    return found


@wp.func
def node_difference(
    field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, di: wp.int32, dj: wp.int32, dk: wp.int32
) -> wp.float32:
    """Return the derivative of F at a node along (di, dj, dk): central, one-sided, or 0."""
    here = node_value(field, grid, i, j, k)
    low = here
    high = here
    distance = wp.float64(0.0)
    if has_value(field, grid, i - di, j - dj, k - dk):
        low = node_value(field, grid, i - di, j - dj, k - dk)
        distance += wp.float64(1.0)
    if has_value(field, grid, i + di, j + dj, k + dk):
        high = node_value(field, grid, i + di, j + dj, k + dk)
        distance += wp.float64(1.0)
    return wp.float32((high - low) / wp.max(distance, wp.float64(1.0)))


@wp.func
def careful_gradient(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, p: wp.vec3) -> wp.vec3:
    """Return the gradient of F in a cell whose neighbours may be missing."""
    gradient = wp.vec3(0.0, 0.0, 0.0)
    for c in range(8):
        ci = c & 1
        cj = (c >> 1) & 1
        ck = c >> 2
        weight = wp.where(ci == 1, p[0], 1.0 - p[0])
        weight *= wp.where(cj == 1, p[1], 1.0 - p[1])
        weight *= wp.where(ck == 1, p[2], 1.0 - p[2])
        gradient += weight * wp.vec3(
            node_difference(field, grid, i + ci, j + cj, k + ck, 1, 0, 0),
            node_difference(field, grid, i + ci, j + cj, k + ck, 0, 1, 0),
            node_difference(field, grid, i + ci, j + cj, k + ck, 0, 0, 1),
        )
    return gradient


@wp.func
def is_interior(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.bool:
    """Return whether the stencil of cell (i, j, k) lies in the volume and counts as it is stored."""
    b = grid.border
    found = i >= b + 1 and j >= b + 1 and k >= b + 1
    found = found and i < grid.nx - b - 2 and j < grid.ny - b - 2 and k < grid.nz - b - 2
    return found and field.has_absent == 0


@wp.func
def field_gradient(field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, p: wp.vec3) -> wp.vec3:
    """Return the gradient of F at local coordinates p of cell (i, j, k), a cell being the unit of length."""
    b = grid.border
    gradient = wp.vec3(0.0, 0.0, 0.0)
    if is_interior(field, grid, i, j, k):
        row = wp.int64(grid.nx - 2 * b)
        layer = row * wp.int64(grid.ny - 2 * b)
        node = node_of_volume(grid, i - b, j - b, k - b)
        f = StencilValues()
        for n in range(STENCIL):
            f[n] = stored_value(field, node + stencil_step(n, row, layer))
        gradient = wp.float32(field.sign) * interior_gradient(f, p)
    else:
        gradient = careful_gradient(field, grid, i, j, k, p)
    return gradient


@wp.kernel
def compute_normals_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    to_output: wp.mat33,
    depths: wp.array(dtype=wp.float64),
    cells: wp.array(dtype=wp.int64),
    locals: wp.array(dtype=wp.vec3),
    # Out:
    normals_out: wp.array(dtype=wp.vec3),
):
    """Compute the normals. One thread a vertex."""
    v = first + wp.tid()
    row = wp.int32(cells[v] / wp.int64(grid.nx))
    i = wp.int32(cells[v] - wp.int64(row) * wp.int64(grid.nx))
    k = row // grid.ny
    gradient = field_gradient(field, grid, i, row % grid.ny, k, locals[v])
    if depths.shape[0] > 0:
        low = wp.float32(node_distance(depths, k))
        gradient[2] = gradient[2] / (low + locals[v][2] * (wp.float32(node_distance(depths, k + 1)) - low))
    normal = to_output * gradient
    length = wp.length(normal)
    normals_out[v] = wp.where(length > 0.0, normal / length, wp.vec3(0.0, 0.0, 1.0))
