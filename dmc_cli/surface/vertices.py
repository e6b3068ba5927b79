"""Vertex representatives: one a MC polygon, exactly on the trilinear isosurface.

A vertex is its cell and its local coordinates in it; the world's millimetres follow from both by the affine
in double precision and are rounded to float32 once. Vertices of ordinary cells come first, in grid order
(a cell's number is its rank), then those of special cells, in grid order.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.device import Device
from dmc_cli.surface.blocks import LANES, place_block_kernel
from dmc_cli.surface.cells import CellBits, Cells
from dmc_cli.surface.field import Field, cell_values
from dmc_cli.surface.grid import Grid, GridShape, bit_index, grid_affine, world_position
from dmc_cli.surface.placement import crossed_edges, edge_set, place_vertex
from dmc_cli.surface.polygons import Polygons, SpecialCells, polygon_of_vertex
from dmc_cli.surface.trilinear import single_precision

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@dataclass(frozen=True)
class Vertices:
    """Vertices in the order of their numbers.

    Attributes:
        position: float32 vec3, millimetres in the output space.
        cell: int64, linear number of the cell's lowest node in the grid, x fastest.
        local: float32 vec3 in [0, 1].
        grid_affine: Shape (4, 4): the grid's node index to the output space.
        fallback_count: Vertices that no axis or lattice line could place in their polygon's box.
    """

    position: Any
    cell: Any
    local: Any
    grid_affine: np.ndarray[Any, Any]
    fallback_count: int


def place_vertices(
    cells: Cells,
    polygons: Polygons,
    field: Any,
    grid: GridShape,
    affine: np.ndarray[Any, Any],
    device: Device,
) -> Vertices:
    """Place every vertex.

    Args:
        cells: Active cells, with the ordinary ones' numbers.
        polygons: The special cells' polygons, with their vertices' numbers.
        field: The `Field` whose zero set is the surface.
        grid: The grid over the volume.
        affine: Shape (4, 4): the volume's node index to the output space.
        device: Where to work.
    """
    count = polygons.vertex_count
    position = device.empty(count, wp.vec3)
    cell = device.empty(count, wp.int64)
    local = device.empty(count, wp.vec3)
    struct = grid.struct()
    to_output = grid_affine(affine, grid)
    matrix = wp.mat44d(*to_output.ravel())
    outputs = [position, cell, local]
    ordinary = cells.ordinary_count
    device.launch(list_ordinary_cells_kernel, grid.rows, [struct, cells.bits], [cell])
    block = LANES if device.is_cpu else 1
    kernel = place_block_kernel if device.is_cpu else place_ordinary_vertices_kernel
    fallbacks = device.empty(-(-ordinary // block), wp.int64)
    inputs = [struct, field, matrix, ordinary, cell]
    device.launch(kernel, fallbacks.shape[0], inputs, [position, local, fallbacks])
    special_fallbacks = device.empty(polygons.special_count, wp.int64)
    inputs = [struct, field, matrix, polygons.special, cells.ordinary_count]
    device.launch(
        place_special_vertices_kernel, polygons.special_count, inputs, [*outputs, special_fallbacks]
    )
    return Vertices(
        position, cell, local, to_output, device.total(fallbacks) + device.total(special_fallbacks)
    )


@wp.kernel
def list_ordinary_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    # Out:
    cell_out: wp.array(dtype=wp.int64),
):
    """List the ordinary cells: their numbers are their vertices'. One thread a row."""
    row = first + wp.tid()
    start = wp.int64(row) * wp.int64(grid.nx)
    for w in range(grid.words):
        left = bits.ordinary[row, w]
        if left != wp.uint32(0):
            v = bits.rank[row, w]
            while left != wp.uint32(0):
                cell_out[v] = start + wp.int64(32 * w + bit_index(left))
                left &= left - wp.uint32(1)
                v += 1


@wp.kernel
def place_ordinary_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    count: wp.int32,
    cells: wp.array(dtype=wp.int64),
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    local_out: wp.array(dtype=wp.vec3),
    fallbacks_out: wp.array(dtype=wp.int64),
):
    """Place the vertices of the ordinary cells. One thread a vertex; for a GPU."""
    v = first + wp.tid()
    row = wp.int32(cells[v] / wp.int64(grid.nx))
    i = wp.int32(cells[v] - wp.int64(row) * wp.int64(grid.nx))
    j = row % grid.ny
    k = row // grid.ny
    f = single_precision(cell_values(field, grid, i, j, k))
    p = place_vertex(f, crossed_edges(f))
    local = wp.vec3(p[0], p[1], p[2])
    local_out[v] = local
    position_out[v] = world_position(matrix, i, j, k, local)
    fallbacks_out[v] = wp.int64(p[3])


@wp.kernel
def place_special_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    matrix: wp.mat44d,
    special: SpecialCells,
    ordinary_count: wp.int32,
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    cell_out: wp.array(dtype=wp.int64),
    local_out: wp.array(dtype=wp.vec3),
    fallbacks_out: wp.array(dtype=wp.int64),
):
    """Place the vertices of the special cells. One thread a special cell.

    The fans of one polygon share its position: each is placed from the whole polygon's edges.
    """
    s = first + wp.tid()
    row = special.row[s]
    i = special.i[s]
    j = row % grid.ny
    k = row // grid.ny
    f = single_precision(cell_values(field, grid, i, j, k))
    fallbacks = wp.int32(0)
    count = wp.int32(special.first_vertex[s + 1] - special.first_vertex[s])
    for n in range(count):
        p = place_vertex(f, edge_set(polygon_of_vertex(special, wp.int64(s), n)))
        local = wp.vec3(p[0], p[1], p[2])
        v = ordinary_count + wp.int32(special.first_vertex[s]) + n
        local_out[v] = local
        position_out[v] = world_position(matrix, i, j, k, local)
        cell_out[v] = wp.int64(row) * wp.int64(grid.nx) + wp.int64(i)
        fallbacks += wp.int32(p[3])
    fallbacks_out[s] = wp.int64(fallbacks)
