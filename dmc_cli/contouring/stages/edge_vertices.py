"""Place a vertex on each crossed edge, where the values are linear along it (Lorensen & Cline 1987).

A vertex is a cell and local coordinates in it, as everywhere: the cell at the edge's lower node or, at the
far ends of the grid, the last one before it. The crossing is computed in double precision and rounded once.
Sixteen vertices of some rows are done at once; edges to virtual nodes, and all where nodes are without data,
are seen to afterwards, one by one.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.bits import LANES, VECTOR_FLAGS, Words, bit_index, has_bit
from dmc_cli.contouring.stages.edge_ranks import EdgeBits, EdgeRanks, edge_words
from dmc_cli.field import (
    FARTHEST,
    Field,
    Grid,
    GridShape,
    before_line,
    node_cell,
    node_position,
    node_value,
    row_place,
    world_position,
)
from dmc_cli.mesh import refuse_lost
from dmc_cli.runtime import Device, native

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)

ROWS_A_CHUNK = 32
"""Rows a chunk at least."""


@dataclass(frozen=True)
class EdgeVertices:
    """Vertices on crossed edges in the order of their numbers, and room for others behind them.

    Attributes:
        position: float32 vec3, millimetres in the output space.
        cell: int64, linear number of the cell's lowest node in the grid, x fastest.
        local: float32 vec3 in [0, 1].
        crossing: How far along its edge each vertex lies, float32 (V + 1,) in [0, 1].
    """

    position: Any
    cell: Any
    local: Any
    crossing: Any


def place_edge_vertices(
    ranks: EdgeRanks, field: Any, grid: GridShape, matrix: Any, device: Device, *, others: int = 0
) -> EdgeVertices:
    """Place the vertices on crossed edges; they are there for the next launch.

    Args:
        ranks: The crossed edges' numbers.
        field: The `Field` whose zero set is the surface.
        grid: The grid over the volume.
        matrix: The kernels' map of the grid's node index to the output space.
        device: Where to work.
        others: Further vertices to leave room for.

    Raises:
        MeshInvariantError: A vertex is not in its cell.
    """
    count = ranks.vertex_count + others
    vertices = EdgeVertices(
        position=device.empty(count, wp.vec3),
        cell=device.empty(count, wp.int64),
        local=device.empty(count, wp.vec3),
        crossing=device.empty(ranks.vertex_count + 1, wp.float32),
    )
    inputs = [grid.struct(), field, ranks.bits, matrix]
    outputs = [vertices.position, vertices.cell, vertices.local, vertices.crossing]
    span = device.span
    device.begin(place_rows_kernel, -(-grid.rows // span), [*inputs, grid.rows, span], outputs, 1)
    if grid.border == 1 or ranks.bits.is_marked:
        device.launch(place_with_care_kernel, grid.rows, inputs, outputs, ROWS_A_CHUNK)
        if field.has_nodata:
            refuse_lost(vertices.local.numpy()[: ranks.vertex_count])
    return vertices


@wp.func_native(native(__file__, "place_rows"))
def place_rows(
    values: wp.array2d(dtype=wp.uint8),
    kind: wp.int32,
    isovalue: wp.float64,
    sign: wp.float64,
    farthest: wp.float64,
    inside: wp.array(dtype=Words),
    exists: wp.array(dtype=Words),
    is_marked: wp.int32,
    nodes: wp.vec3i,
    border: wp.int32,
    words: wp.int32,
    ahead: wp.int32,
    start: wp.int32,
    end: wp.int32,
    starts: wp.array(dtype=wp.int64),
    to_x: wp.vec4d,
    to_y: wp.vec4d,
    to_z: wp.vec4d,
    position_out: wp.array(dtype=wp.vec3),
    cell_out: wp.array(dtype=wp.int64),
    local_out: wp.array(dtype=wp.vec3),
    crossing_out: wp.array(dtype=wp.float32),
) -> None:
    """Place the vertices on the edges from rows `start` to `end` - 1, as if no node were virtual or missing.

    `ahead` words lie before the lines; `to_x` to `to_z` are rows of the map to the output space; values
    further from the isovalue than `farthest` count as that far.
    """
    ...


@wp.func
def first_along(bits: EdgeBits, row: wp.int32) -> wp.vec3i:
    """Return the first vertices of a row on edges along x, y and z."""
    x = wp.int32(bits.starts[row])
    y = x + bits.along_x[row]
    return wp.vec3i(x, y, y + bits.along_y[row])


@wp.kernel
def place_rows_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    bits: EdgeBits,
    matrix: wp.mat44d,
    rows: wp.int32,
    span: wp.int32,
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    cell_out: wp.array(dtype=wp.int64),
    local_out: wp.array(dtype=wp.vec3),
    crossing_out: wp.array(dtype=wp.float32),
) -> None:
    """Place the vertices of some rows. One thread per `span` rows of nodes."""
    start = (first + wp.tid()) * span
    end = wp.min(start + span, rows)
    if bits.starts[start] == bits.starts[end]:
        return
    place_rows(
        field.values,
        field.kind,
        field.isovalue,
        field.sign,
        wp.float64(FARTHEST),
        bits.inside,
        bits.exists,
        bits.is_marked,
        wp.vec3i(grid.nx, grid.ny, grid.nz),
        grid.border,
        grid.words,
        before_line(grid),
        start,
        end,
        bits.starts,
        wp.vec4d(matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[0, 3]),
        wp.vec4d(matrix[1, 0], matrix[1, 1], matrix[1, 2], matrix[1, 3]),
        wp.vec4d(matrix[2, 0], matrix[2, 1], matrix[2, 2], matrix[2, 3]),
        position_out,
        cell_out,
        local_out,
        crossing_out,
    )


@wp.func
def is_virtual(grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32) -> wp.bool:
    """Return whether a node of the grid lies outside the volume."""
    b = grid.border
    at_low = i < b or j < b or k < b
    return at_low or i >= grid.nx - b or j >= grid.ny - b or k >= grid.nz - b


@wp.func
def cell_exists(grid: Grid, bits: EdgeBits, node: wp.vec3i) -> wp.bool:
    """Return whether the cell with this lowest node exists; it may be off the grid."""
    found = node[0] >= 0 and node[1] >= 0 and node[2] >= 0
    found = found and node[0] < grid.nx - 1 and node[1] < grid.ny - 1 and node[2] < grid.nz - 1
    if found and bits.is_marked == 1:
        n = before_line(grid) + (node[1] + node[2] * grid.ny) * grid.words + node[0] / 32
        found = has_bit(bits.exists[n][0], node[0] % 32)
    return found


@wp.func
def cell_at_edge(grid: Grid, bits: EdgeBits, node: wp.vec3i, axis: wp.int32) -> wp.vec3i:
    """Return the lowest node of the first cell that exists among the four at an edge from a node."""
    b = (axis + 1) % 3
    c = (axis + 2) % 3
    found = node
    for n in range(4):
        m = 3 - n
        tried = node
        tried[b] = node[b] - (m & 1)
        tried[c] = node[c] - (m >> 1)
        if cell_exists(grid, bits, tried):
            found = tried
    return found


@wp.kernel
def place_with_care_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    field: Field,
    bits: EdgeBits,
    matrix: wp.mat44d,
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    cell_out: wp.array(dtype=wp.int64),
    local_out: wp.array(dtype=wp.vec3),
    crossing_out: wp.array(dtype=wp.float32),
) -> None:
    """Place the vertices of a row that lie on edges to virtual nodes, or where nodes are without data.

    One thread per row of nodes.
    """
    row = first + wp.tid()
    if bits.starts[row] == bits.starts[row + 1]:
        return
    place = row_place(grid, row)
    vertex = first_along(bits, row)
    for block in range((grid.words + LANES - 1) / LANES):
        start = LANES * block
        at = wp.vec3i(start, place[0], place[1])
        n = before_line(grid) + row * grid.words + start
        edges = edge_words(grid, bits, n, at, grid.words - start)
        for axis in range(3):
            words = edges.x
            if axis == 1:
                words = edges.y
            elif axis == 2:
                words = edges.z
            v = vertex[axis]
            for lane in range(LANES):
                remaining = words[lane]
                while remaining != wp.uint32(0):
                    i = 32 * (start + lane) + bit_index(remaining)
                    remaining &= remaining - wp.uint32(1)
                    node = wp.vec3i(i, place[0], place[1])
                    other = node
                    other[axis] = node[axis] + 1
                    outside = is_virtual(grid, node[0], node[1], node[2]) or is_virtual(
                        grid, other[0], other[1], other[2]
                    )
                    if outside or field.has_nodata == 1 or bits.is_marked == 1:
                        f = node_value(field, grid, node[0], node[1], node[2])
                        g = node_value(field, grid, other[0], other[1], other[2])
                        t = wp.float32(f / (f - g))
                        cell = cell_at_edge(grid, bits, node, axis)
                        local = wp.vec3(
                            wp.float32(node[0] - cell[0]),
                            wp.float32(node[1] - cell[1]),
                            wp.float32(node[2] - cell[2]),
                        )
                        local[axis] = t
                        position_out[v] = world_position(matrix, node_position(cell, local))
                        cell_out[v] = node_cell(grid, cell)
                        local_out[v] = local
                        crossing_out[v] = t
                    v += 1
            vertex[axis] = v
