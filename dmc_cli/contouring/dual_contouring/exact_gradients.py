"""Place the vertices of cells by exact normals at their crossings (`--gradients exact`): Hermite data.

The volume knows the gradient of the field that its values are samples of: a synthetic one, or a function that
a program has given. It is a function on the host, so vertices are placed some at a time: a kernel finds their
crossings, the host asks for the gradients there (`hermite_data.py`), another kernel places. The host's part
takes most of the time, so all is done in double precision, one vertex at a time.
"""

from typing import Any

import warp as wp

from dmc_cli.contouring.dual_contouring.double_planes import (
    crossing_on,
    in_full,
    point_on,
    with_plane,
)
from dmc_cli.contouring.dual_contouring.hermite_data import hermite_data
from dmc_cli.contouring.dual_contouring.symmetric_matrix import ONE, ZERO, Planes64, least_point_64
from dmc_cli.contouring.dual_grid import CellContext, CellVertices
from dmc_cli.errors import SettingsError
from dmc_cli.field import (
    Field,
    Grid,
    cell_node,
    cell_values,
    node_position,
    world_position,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

CELLS_AT_ONCE = 1 << 12
"""Cells whose crossings are on the host together: with all that comes of them, some ten megabytes."""

QEF, PAPER, PARTICLE = range(3)

RULES = {"qef": QEF, "paper": PAPER, "particle": PARTICLE}
"""The placements by their names in the settings."""

QEF_CUT = wp.constant(wp.float64(0.01))
"""Eigenvalues up to this share of the largest are dropped, as `placement.py` does."""


def place_by_gradients(cell: Any, context: CellContext) -> CellVertices:
    """Place a vertex in each cell by the exact normals at its crossings.

    Raises:
        SettingsError: The volume tells no gradient.
        CallError: Its gradient returns no gradients.
    """
    device, count, chosen = context.device, cell.shape[0], context.settings
    _require_gradient(context)
    position, local = device.empty(count, wp.vec3), device.empty(count, wp.vec3)
    outside = device.empty(count, wp.uint8)
    rule = RULES[chosen.placement or "qef"]
    numbers = [rule, chosen.steps or 0, chosen.step_size or 0.0]
    device.finish()
    for start in range(0, count, CELLS_AT_ONCE):
        size = min(CELLS_AT_ONCE, count - start)
        crossings = device.empty((size, 12), wp.float64)
        inputs = [context.grid.struct(), context.field, cell, start]
        device.launch(find_crossings_kernel, size, inputs, [crossings])
        found = hermite_data(cell.numpy()[start : start + size], crossings.numpy(), context)
        exact = wp.array(found.crossings, dtype=wp.float64, device=device.name)
        normals = wp.array(found.normals, dtype=wp.vec3d, device=device.name)
        inputs = [context.grid.struct(), context.matrix, *numbers, cell, start, exact, normals]
        device.launch(place_exactly_kernel, size, inputs, [local, position, outside])
    return CellVertices(position, local, device.total(outside))


def _require_gradient(context: CellContext) -> None:
    """Raise SettingsError unless the volume tells its gradient."""
    volume = context.volume.volume
    if volume.gradient is None:
        raise SettingsError(
            f"gradients is 'exact', but {volume.path or 'the volume'} holds values alone; expected a"
            " synthetic field other than noise, or a Volume with a gradient; leave it out"
        )


@wp.kernel
def find_crossings_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    cells: wp.array(dtype=wp.int64),
    start: wp.int32,
    # Out:
    crossings_out: wp.array2d(dtype=wp.float64),
) -> None:
    """Find where the edges of cells from `start` on are crossed. One thread per cell."""
    n = first + wp.tid()
    node = cell_node(grid, cells[start + n])
    f = cell_values(field, grid, node[0], node[1], node[2])
    for edge in range(12):
        crossings_out[n, edge] = crossing_on(f, edge)


@wp.func
def drawn_in(p: wp.vec3d) -> wp.vec3d:
    """Return a point drawn into the cell."""
    return wp.vec3d(wp.clamp(p[0], ZERO, ONE), wp.clamp(p[1], ZERO, ONE), wp.clamp(p[2], ZERO, ONE))


@wp.func
def forced_64(sums: Planes64, offset: wp.vec3d) -> wp.vec3d:
    """Return the force of the planes on a particle at an offset from where they are summed."""
    return wp.vec3d(
        sums[6] - (sums[0] * offset[0] + sums[3] * offset[1] + sums[4] * offset[2]),
        sums[7] - (sums[3] * offset[0] + sums[1] * offset[1] + sums[5] * offset[2]),
        sums[8] - (sums[4] * offset[0] + sums[5] * offset[1] + sums[2] * offset[2]),
    )


@wp.func
def placed_by(
    rule: wp.int32, sums: Planes64, mean: wp.vec3d, steps: wp.int32, step_size: wp.float64
) -> wp.vec4d:
    """Return where a placement puts a vertex, and 1 if that is not where its rule alone leads."""
    result = wp.vec4d(mean[0], mean[1], mean[2], ZERO)
    if rule == PAPER:
        result = in_full(sums, mean)
    elif rule == QEF:
        q = mean + least_point_64(sums, QEF_CUT)
        p = drawn_in(q)
        result = wp.vec4d(p[0], p[1], p[2], wp.where(wp.max(wp.abs(p - q)) > ZERO, ONE, ZERO))
    else:
        p = mean
        for _step in range(steps):
            p = drawn_in(p + step_size * forced_64(sums, p - mean))
        result = wp.vec4d(p[0], p[1], p[2], ZERO)
    return result


@wp.kernel
def place_exactly_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    matrix: wp.mat44d,
    rule: wp.int32,
    steps: wp.int32,
    step_size: wp.float64,
    cells: wp.array(dtype=wp.int64),
    start: wp.int32,
    crossings: wp.array2d(dtype=wp.float64),
    normals: wp.array2d(dtype=wp.vec3d),
    # Out:
    local_out: wp.array(dtype=wp.vec3),
    position_out: wp.array(dtype=wp.vec3),
    outside_out: wp.array(dtype=wp.uint8),
) -> None:
    """Place the vertices of cells from `start` on by the normals at their crossings. One thread per cell."""
    n = first + wp.tid()
    v = start + n
    node = cell_node(grid, cells[v])
    mean = wp.vec3d()
    count = wp.float64(0.0)
    for edge in range(12):
        if crossings[n, edge] >= ZERO:
            mean += point_on(edge, crossings[n, edge])
            count += ONE
    mean /= count
    sums = Planes64()
    for edge in range(12):
        t = crossings[n, edge]
        if t >= ZERO:
            sums = with_plane(sums, normals[n, edge], point_on(edge, t) - mean)
    p = placed_by(rule, sums, mean, steps, step_size)
    local = wp.vec3(wp.float32(p[0]), wp.float32(p[1]), wp.float32(p[2]))
    local_out[v] = local
    position_out[v] = world_position(matrix, node_position(node, local))
    outside_out[v] = wp.uint8(p[3])
