"""Give each fan of faces a vertex of its own where cells are missing.

Four cells meet at a grid edge. Where only two of them exist, opposite each other across the edge, their faces
form two fans that share the edge's vertex and no side: the mesh would be no manifold there. The fan in the
lower layer, or row, gets a copy of the vertex. In a row of cells only one has that edge, so that the faces to
change are those in the cell's row that name the vertex.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.bits import bit_index, has_bit, next_node, previous_node
from dmc_cli.contouring.stages.cell_edges import edge_vertices_of
from dmc_cli.contouring.stages.edge_ranks import EdgeBits, EdgeRanks
from dmc_cli.field import Grid, GridShape, before_line
from dmc_cli.mesh import flat_corners
from dmc_cli.runtime import Device, mesh_size

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@dataclass(frozen=True)
class SecondFans:
    """Vertices with two fans.

    Attributes:
        vertex: The vertex that both fans name, int32.
        row: The row of nodes of the cell whose fan gets a copy, int32.
        count: How many there are.
    """

    vertex: Any
    row: Any
    count: int


def find_second_fans(ranks: EdgeRanks, grid: GridShape, device: Device) -> SecondFans:
    """Find the vertices on crossed edges that two fans name; there are none where no cell is missing.

    Raises:
        DeviceError: More of them than 32-bit mesh indices can number.
    """
    none = device.empty(0, wp.int32)
    if not ranks.bits.is_marked:
        return SecondFans(none, none, 0)
    counts = device.empty((1, grid.rows), wp.int64)
    nowhere = device.empty(0, wp.int64)
    inputs = [grid.struct(), ranks.bits]
    device.launch(find_second_fans_kernel, grid.rows, [*inputs, nowhere, 0], [counts, none, none])
    ((starts, total),) = device.starts_of_rows(counts)
    count = mesh_size(total)
    found = SecondFans(device.empty(count, wp.int32), device.empty(count, wp.int32), count)
    if count:
        outputs = [counts, found.vertex, found.row]
        device.launch(find_second_fans_kernel, grid.rows, [*inputs, starts, 1], outputs)
    return found


@dataclass(frozen=True)
class RowFaces:
    """Where the faces of each row of cells are.

    Attributes:
        starts: Items before each row, int64.
        of_items: Faces before each item, int64; empty where the items are the faces.
        first: The first face of all.
    """

    starts: Any
    of_items: Any
    first: int = 0


def separate_fans(
    fans: SecondFans, points: tuple[Any, Any, Any], faces: Any, rows: list[RowFaces], device: Device
) -> None:
    """Copy the vertices, and have the faces of their second fans name the copies.

    Args:
        fans: The vertices with two fans.
        points: Position, cell and local coordinates of all vertices; the copies are the last ones.
        faces: The faces, int32 vec4.
        rows: Where the faces of each row are, in each of their lists.
        device: Where to work.
    """
    if fans.count == 0:
        return
    first = points[0].shape[0] - fans.count
    device.launch(copy_vertices_kernel, fans.count, [fans.vertex, first], list(points))
    corners = flat_corners(faces)
    for found in rows:
        inputs = [fans.vertex, fans.row, first, found.starts, found.of_items, found.first]
        device.launch(name_copies_kernel, fans.count, inputs, [corners])


@wp.func
def load_cells(bits: EdgeBits, n: wp.int32, back: wp.int32) -> wp.uint32:
    """Return whether the cells of a word exist, or those one node back."""
    cells = bits.exists[n][0]
    if back == 1:
        cells = previous_node(cells, bits.exists[n - 1][0])
    return cells


@wp.func
def crossed_along(bits: EdgeBits, grid: Grid, n: wp.int32, axis: wp.int32) -> wp.uint32:
    """Return whether the edges along an axis from the nodes of a word are crossed; ends of rows not told."""
    here = bits.inside[n][0]
    other = next_node(here, bits.inside[n][1])
    if axis == 1:
        other = bits.inside[n + grid.words][0]
    elif axis == 2:
        other = bits.inside[n + grid.layer][0]
    return here ^ other


Pair = wp.types.vector(length=2, dtype=wp.uint32)


@wp.func
def two_fans(bits: EdgeBits, grid: Grid, n: wp.int32, axis: wp.int32) -> Pair:
    """Return whether of the four cells at edges from the nodes of a word only two exist, opposite each other.

    First: the one at the node and the one back along both other axes; then: those back along one of them.
    """
    # how far back in the lines; along x it is a bit
    step_b = wp.where(axis == 0, grid.words, wp.where(axis == 1, grid.layer, 0))
    step_c = wp.where(axis == 0, grid.layer, wp.where(axis == 1, 0, grid.words))
    back_b = wp.where(axis == 2, 1, 0)
    back_c = wp.where(axis == 1, 1, 0)
    at = load_cells(bits, n, 0)
    at_b = load_cells(bits, n - step_b, back_b)
    at_c = load_cells(bits, n - step_c, back_c)
    at_both = load_cells(bits, n - step_b - step_c, back_b + back_c)
    return Pair(at & at_both & ~at_b & ~at_c, at_b & at_c & ~at & ~at_both)


@wp.func
def cell_back(grid: Grid, axis: wp.int32, is_far: wp.bool) -> wp.vec2i:
    """Return how many rows and nodes back from an edge the cell lies whose fan gets a copy."""
    back = wp.where(is_far, wp.vec2i(grid.ny + 1, 0), wp.vec2i(grid.ny, 0))
    if axis == 1:
        back = wp.where(is_far, wp.vec2i(grid.ny, 1), wp.vec2i(0, 1))
    elif axis == 2:
        back = wp.where(is_far, wp.vec2i(1, 1), wp.vec2i(1, 0))
    return back


@wp.func
def edge_of_cell(axis: wp.int32, is_far: wp.bool) -> wp.int32:
    """Return the edge along an axis of the cell back along the second other axis, and the first if `is_far`.

    The other axes are those after `axis`, in turn.
    """
    edge = wp.where(is_far, 6, 4)
    if axis == 1:
        edge = wp.where(is_far, 5, 1)
    elif axis == 2:
        edge = wp.where(is_far, 10, 11)
    return edge


@wp.kernel
def find_second_fans_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: EdgeBits,
    starts: wp.array(dtype=wp.int64),
    lists: wp.int32,
    # Out:
    counts_out: wp.array2d(dtype=wp.int64),
    vertex_out: wp.array(dtype=wp.int32),
    row_out: wp.array(dtype=wp.int32),
) -> None:
    """Count the vertices of a row that have two fans, or list them. One thread per row of nodes."""
    row = first + wp.tid()
    counts_out[0, row] = wp.int64(0)
    if bits.starts[row] == bits.starts[row + 1]:
        return
    count = int(0)
    slot = int(0)
    if lists == 1:
        slot = wp.int32(starts[row])
    for w in range(grid.words):
        n = before_line(grid) + row * grid.words + w
        for axis in range(3):
            remaining = crossed_along(bits, grid, n, axis)
            far = wp.uint32(0)
            if remaining != wp.uint32(0):
                fans = two_fans(bits, grid, n, axis)
                far = fans[0]
                remaining &= far | fans[1]
                count += wp.int32(wp.bit_count(remaining))
            while lists == 1 and remaining != wp.uint32(0):
                b = bit_index(remaining)
                remaining &= remaining - wp.uint32(1)
                is_far = has_bit(far, b)
                cell = cell_back(grid, axis, is_far)
                vertices = edge_vertices_of(grid, bits, row - cell[0], 32 * w + b - cell[1])
                vertex_out[slot] = vertices[edge_of_cell(axis, is_far)]
                row_out[slot] = row - cell[0]
                slot += 1
    counts_out[0, row] = wp.int64(count)


@wp.kernel
def copy_vertices_kernel(
    # In:
    first: wp.int32,
    vertices: wp.array(dtype=wp.int32),
    first_copy: wp.int32,
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    cell_out: wp.array(dtype=wp.int64),
    local_out: wp.array(dtype=wp.vec3),
) -> None:
    """Copy a vertex. One thread per copy."""
    n = first + wp.tid()
    v = vertices[n]
    position_out[first_copy + n] = position_out[v]
    cell_out[first_copy + n] = cell_out[v]
    local_out[first_copy + n] = local_out[v]


@wp.func
def first_face(
    starts: wp.array(dtype=wp.int64), of_items: wp.array(dtype=wp.int64), row: wp.int32
) -> wp.int32:
    """Return the faces before a row, as `RowFaces` tells them."""
    count = starts[row]
    if of_items.shape[0] > 0:
        count = of_items[count]
    return wp.int32(count)


@wp.kernel
def name_copies_kernel(
    # In:
    first: wp.int32,
    vertices: wp.array(dtype=wp.int32),
    rows: wp.array(dtype=wp.int32),
    first_copy: wp.int32,
    starts: wp.array(dtype=wp.int64),
    of_items: wp.array(dtype=wp.int64),
    first_of_all: wp.int32,
    # Out:
    corners_out: wp.array(dtype=wp.int32),
) -> None:
    """Have the faces of a row that name a vertex name its copy. One thread per copy."""
    n = first + wp.tid()
    v = vertices[n]
    for f in range(first_face(starts, of_items, rows[n]), first_face(starts, of_items, rows[n] + 1)):
        corner = wp.int64(4) * wp.int64(first_of_all + f)
        for c in range(3):
            if corners_out[corner + wp.int64(c)] == v:
                corners_out[corner + wp.int64(c)] = first_copy + n
