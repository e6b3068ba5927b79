"""Place the vertices of all cells: one per MC polygon, by default exactly on the trilinear isosurface.

A vertex is its cell and its local coordinates in it; the world's millimetres follow from both by the affine
in double precision and are rounded to float32 once. Vertices of ordinary cells come first, in grid order
(a cell's number is its rank), then those of special cells, in grid order.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.bits import LANES, VECTOR_FLAGS, Words
from dmc_cli.contouring.dual_marching_cubes.cells import Cells
from dmc_cli.contouring.dual_marching_cubes.placement.exact import LOST
from dmc_cli.contouring.dual_marching_cubes.placement.exact_scalar import place_remaining_vertices_kernel
from dmc_cli.contouring.dual_marching_cubes.placement.exact_simd import place_block_kernel
from dmc_cli.contouring.dual_marching_cubes.polygons import Polygons
from dmc_cli.contouring.dual_marching_cubes.special_cells import SpecialCells, polygon_of_vertex
from dmc_cli.contouring.stages.tracing import has_several
from dmc_cli.field import (
    ALL_EDGES,
    BITS_A_CHUNK,
    BLOCKS_A_CHUNK,
    Grid,
    GridShape,
    before_line,
    block_count,
    store_cells,
)
from dmc_cli.mesh import refuse_lost
from dmc_cli.runtime import FLAGS_A_CHUNK, Device

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


@dataclass(frozen=True)
class Vertices:
    """Vertices in the order of their numbers.

    Attributes:
        position: float32 vec3, millimetres in the output space.
        cell: int64, linear number of the cell's lowest node in the grid, x fastest.
        local: float32 vec3 in [0, 1].
        fallbacks: uint8, one per vertex or, if exact on CPU, a block of them; its sum counts, if exact, the
            vertices that no axis or lattice line could place in their polygon's box; else those left at the
            mean of their polygon's crossings because the method failed. `LOST` where one is not in its cell.
    """

    position: Any
    cell: Any
    local: Any
    fallbacks: Any


def place_vertices(
    cells: Cells,
    polygons: Polygons,
    field: Any,
    grid: GridShape,
    matrix: Any,
    device: Device,
    placement: str | None = "exact",
) -> Vertices:
    """Place every vertex; all are placed for the next launch.

    Args:
        cells: Active cells, with the ordinary ones' numbers.
        polygons: The special cells' polygons, with their vertices' numbers.
        field: The `Field` whose zero set is the surface.
        grid: The grid over the volume.
        matrix: The kernels' map of the grid's node index to the output space.
        device: Where to work.
        placement: Where in its polygon a vertex goes.
    """
    count = polygons.vertex_count
    context = [grid.struct(), field, matrix]
    cell = device.empty(count, wp.int64)
    inputs = [context[0], cells.bits.ordinary_line, cells.ordinary_starts]
    device.begin(list_ordinary_cells_kernel, block_count(grid), inputs, [cell], BITS_A_CHUNK)
    size = LANES if placement == "exact" and device.is_cpu else 1
    vertices = Vertices(
        position=device.empty(count, wp.vec3),
        cell=cell,
        local=device.empty(count, wp.vec3),
        fallbacks=device.empty(-(-count // size), wp.uint8),
    )
    if placement == "exact":
        _place_exactly(vertices, cells, polygons, context, size, device)
        return vertices
    from dmc_cli.contouring.dual_marching_cubes.placement.paper import METHODS, place_paper_vertices_kernel

    inputs = [*context, METHODS[placement], cells.ordinary_count, polygons.special, polygons.special_count]
    outputs = [vertices.cell, vertices.position, vertices.local, vertices.fallbacks]
    device.launch(place_paper_vertices_kernel, count, inputs, outputs)
    return vertices


def _place_exactly(
    vertices: Vertices, cells: Cells, polygons: Polygons, context: list[Any], size: int, device: Device
) -> None:
    """Place all vertices on the surface; a block has `size` of them."""
    ordinary, special = cells.ordinary_count, polygons.special_count
    inputs = [context[0], polygons.special, ordinary]
    outputs = [vertices.cell, vertices.local]
    device.begin(list_special_vertices_kernel, special, inputs, outputs, FLAGS_A_CHUNK)
    remaining = vertices.fallbacks  # at first whether some in a block have no place yet
    if device.is_cpu:
        inputs = [*context, ordinary, vertices.cell]
        outputs = [vertices.local, vertices.position, remaining]
        device.begin(place_block_kernel, remaining.shape[0], inputs, outputs, BLOCKS_A_CHUNK)
    else:
        remaining.fill_(1)
        vertices.local.fill_(wp.vec3(-1.0, -1.0, -1.0))
    threads = -(-remaining.shape[0] // device.span)
    inputs = [*context, size, ordinary, polygons.special, special, vertices.cell, device.span]
    outputs = [vertices.local, vertices.position, remaining]
    device.begin(place_remaining_vertices_kernel, threads, inputs, outputs, 1)


def count_fallbacks(vertices: Vertices, device: Device) -> int:
    """Return how many vertices took a fallback.

    Raises:
        MeshInvariantError: A vertex is not in its cell.
    """
    count = device.total(vertices.fallbacks)
    if count >= int(LOST) and (vertices.fallbacks.numpy() == int(LOST)).any():
        refuse_lost(vertices.local.numpy())
    return count


@wp.kernel
def list_ordinary_cells_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    ordinary: wp.array(dtype=Words),
    starts: wp.array(dtype=wp.int64),
    # Out:
    cell_out: wp.array(dtype=wp.int64),
) -> None:
    """List the ordinary cells: their numbers are their vertices'. One thread a block of words."""
    block = first + wp.tid()
    v = wp.int32(starts[block])
    if v != wp.int32(starts[block + 1]):
        n = block * LANES
        store_cells(ordinary[before_line(grid) + n], n, grid.words, grid.nx, v, cell_out)


@wp.kernel
def list_special_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    special: SpecialCells,
    ordinary_count: wp.int32,
    # Out:
    cell_out: wp.array(dtype=wp.int64),
    local_out: wp.array(dtype=wp.vec3),
) -> None:
    """List the vertices' cells, and where their local coordinates will be their edges, a bit each.

    One thread a special cell. The fans of one polygon are placed together, from the whole polygon's edges.
    """
    s = first + wp.tid()
    start = wp.int64(ordinary_count) + special.first_vertex[s]
    several = has_several(special.polygons[s])
    for n in range(wp.int32(special.first_vertex[s + 1] - special.first_vertex[s])):
        edges = wp.uint32(ALL_EDGES)
        if several:
            edges = polygon_of_vertex(special, wp.int64(s), n)
        cell_out[start + wp.int64(n)] = wp.int64(special.row[s]) * wp.int64(grid.nx) + wp.int64(special.i[s])
        local_out[start + wp.int64(n)] = wp.vec3(wp.float32(edges), 0.0, 0.0)
