"""Place the vertices of cells as Grosso & Zint 2021 did for their comparison (`--placement paper`).

Their text gives no recipe; this one gives the numbers that they print. The normal equations are solved in
full, without dropping small eigenvalues; a solution outside the cell, which is every second one, gives way to
the mean of the crossings. It is a poor placement, for their tables alone. Eigenvalues of nearly flat cells
are a millionth of the largest and less, and where the solution lies decides, so this needs double precision.
"""

from typing import Any

import warp as wp

from dmc_cli.contouring.dual_contouring.double_planes import (
    EDGE_HIGH,
    EDGE_LOW,
    crossing_on,
    in_full,
    mean_of_crossings,
    point_on,
    with_plane,
)
from dmc_cli.contouring.dual_contouring.symmetric_matrix import ZERO, Planes64
from dmc_cli.contouring.dual_grid import CellContext, CellVertices
from dmc_cli.field import (
    Field,
    Grid,
    cell_node,
    cell_values,
    corner_differences,
    node_position,
    world_position,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


def place_as_paper(cell: Any, context: CellContext) -> CellVertices:
    """Place a vertex in each cell; a fallback is one at the mean of the crossings."""
    device, count = context.device, cell.shape[0]
    position, local = device.empty(count, wp.vec3), device.empty(count, wp.vec3)
    fallback = device.empty(count, wp.uint8)
    inputs = [context.grid.struct(), context.field, context.matrix, cell]
    device.launch(place_paper_cells_kernel, count, inputs, [local, position, fallback])
    return CellVertices(position, local, device.total(fallback))


@wp.kernel
def place_paper_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    cells: wp.array(dtype=wp.int64),
    # Out:
    local_out: wp.array(dtype=wp.vec3),
    position_out: wp.array(dtype=wp.vec3),
    fallback_out: wp.array(dtype=wp.uint8),
) -> None:
    """Place vertices by the full solution. One thread per vertex."""
    v = first + wp.tid()
    node = cell_node(grid, cells[v])
    f = cell_values(field, grid, node[0], node[1], node[2])
    g = corner_differences(field, grid, node[0], node[1], node[2])
    unit = wp.max(wp.abs(g))
    if unit > ZERO:
        g = g / unit  # squares of very large or small differences are no numbers
    mean = mean_of_crossings(f)
    sums = Planes64()
    for edge in range(12):
        t = crossing_on(f, edge)
        if t >= ZERO:
            a = 3 * EDGE_LOW[edge]
            b = 3 * EDGE_HIGH[edge]
            normal = wp.normalize(
                wp.vec3d(
                    g[a] + t * (g[b] - g[a]),
                    g[a + 1] + t * (g[b + 1] - g[a + 1]),
                    g[a + 2] + t * (g[b + 2] - g[a + 2]),
                )
            )
            sums = with_plane(sums, normal, point_on(edge, t) - mean)
    p = in_full(sums, mean)
    local = wp.vec3(wp.float32(p[0]), wp.float32(p[1]), wp.float32(p[2]))
    local_out[v] = local
    position_out[v] = world_position(matrix, node_position(node, local))
    fallback_out[v] = wp.uint8(p[3])
