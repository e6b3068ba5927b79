"""Make the conforming surface net of a label map: its quads are shared by the labels on their two sides.

A vertex for each cluster of each active cell's crossed edges (`cell_loops.py`), a quad round each crossed
edge. All quads look from the larger to the smaller label.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.bits import bit_index
from dmc_cli.contouring.label_surfaces.cell_loops import (
    case_of,
    clusters_of,
    corner_codes,
    joined_faces,
    owner_count,
)
from dmc_cli.contouring.label_surfaces.crossings import (
    CrossingWords,
    active_index,
    list_active_kernel,
    mark_crossings,
)
from dmc_cli.contouring.stages.tracing import FACE_CORNERS, FACE_EDGES, is_ambiguous, owner_of, trace_cell
from dmc_cli.field import CORNERS, EDGES, Grid, GridShape, cell_node, row_place
from dmc_cli.runtime import ITEMS_A_CHUNK, Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

FLIP_CLASSES = 6
"""Classes of faces of which no two share a cell: by axis, and by the parity of their index along it."""

Vec12 = wp.types.vector(length=12, dtype=wp.int32)


def _edges_at() -> list[int]:
    """Return the edge along each axis at each place: 4 axis + u + 2 v, u and v along the next two axes."""
    found = []
    for axis in range(3):
        for place in range(4):
            at = [0, 0, 0]
            at[(axis + 1) % 3], at[(axis + 2) % 3] = place & 1, place >> 1
            low = CORNERS.index(tuple(at))
            found.append(EDGES.index((low, low | 1 << axis)))
    return found


EDGE_AT = wp.constant(Vec12(*_edges_at()))


@dataclass(frozen=True)
class LabelNet:
    """The conforming net, before its vertices are placed.

    Attributes:
        codes: Labels as numbers from 0, the background, uint16 (nz, ny, nx), a layer of it round the volume.
        grid: The grid of these nodes.
        words: The kernels' `CrossingWords`.
        cells: Active cells by their lowest nodes, int64 (C,).
        owners: The cluster of each edge of each cell, uint64 (C,).
        flips: Decisions on faces that were turned round, uint16 (C,), as `joined_faces` takes them.
        vertex_start: Vertices before each cell, int64 (C + 1,).
        vertex_count: Vertices.
        faces: Their numbers, int32 vec4 (Q,).
        sides: Codes of the labels on both sides, the larger first, int32 vec2 (Q,).
        frames: Axis of each quad's edge, plus 4 where the quad looks down the axis, uint8 (Q,).
        device: Where the arrays are.
    """

    codes: Any
    grid: GridShape
    words: Any
    cells: Any
    owners: Any
    flips: Any
    vertex_start: Any
    vertex_count: int
    faces: Any
    sides: Any
    frames: Any
    device: Device

    @property
    def quad_count(self) -> int:
        """Count the quads."""
        return int(self.faces.shape[0])


def extract_net(
    codes: Any, grid: GridShape, device: Device, reserve: Callable[[int], None] | None = None
) -> LabelNet:
    """Return the conforming net of a label map.

    Args:
        codes: Labels as numbers from 0, uint16 (nz, ny, nx), the outermost nodes all 0.
        grid: The grid of these nodes.
        device: Where to work.
        reserve: Called with the number of quads before memory for them is taken; it may raise.

    Raises:
        DeviceError: There are more quads or vertices than 32 bits can number.
    """
    crossings = mark_crossings(codes, grid, device)
    if reserve is not None:
        reserve(crossings.quad_count)
    words, count = crossings.words, crossings.cell_count
    cells = device.empty(count, wp.int64)
    device.launch(list_active_kernel, grid.layer * grid.nz, [grid.struct(), words], [cells])
    flips = device.zeros(count, wp.uint16)
    for number in range(FLIP_CLASSES):
        inputs = [grid.struct(), words, codes, cells, number]
        device.launch(flip_faces_kernel, count, inputs, [flips], ITEMS_A_CHUNK)
    owners, counts = device.empty(count, wp.uint64), device.empty(count, wp.int64)
    inputs = [grid.struct(), codes, cells, flips]
    device.launch(join_edges_kernel, count, inputs, [owners, counts], ITEMS_A_CHUNK)
    starts, vertices = device.starts(counts)
    quads = crossings.quad_count
    faces, sides = device.empty(quads, wp.vec4i), device.empty(quads, wp.vec2i)
    frames = device.empty(quads, wp.uint8)
    inputs = [grid.struct(), words, codes, owners, starts]
    device.launch(connect_edges_kernel, grid.layer * grid.nz, inputs, [faces, sides, frames])
    return LabelNet(codes, grid, words, cells, owners, flips, starts, vertices, faces, sides, frames, device)


@wp.func
def along(node: wp.vec3i, axis: wp.int32, steps: wp.int32) -> wp.vec3i:
    """Return the node some steps further along an axis."""
    moved = wp.vec3i(node[0], node[1], node[2])
    moved[axis] = node[axis] + steps
    return moved


@wp.func
def runs_twice(owners: wp.uint64, face: wp.int32) -> wp.bool:
    """Return whether both segments of an ambiguous face are in one loop."""
    owner = owner_of(owners, FACE_EDGES[4 * face])
    return owner == owner_of(owners, FACE_EDGES[4 * face + 1]) and owner == owner_of(
        owners, FACE_EDGES[4 * face + 2]
    )


@wp.kernel
def flip_faces_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    words: CrossingWords,
    codes: wp.array3d(dtype=wp.uint16),
    cells: wp.array(dtype=wp.int64),
    number: wp.int32,
    # In/out:
    flips_inout: wp.array(dtype=wp.uint16),
) -> None:
    """Turn decisions round where a shell would have an edge with four quads. One thread per active cell.

    It looks at the cell's high face along an axis, if that is of this class, for each label on a diagonal. If
    the label's segments there are in one loop in both cells, the flip splits both loops; a flip never joins
    loops of the label, and is none of another label's, so that one sweep over the classes suffices.
    """
    n = first + wp.tid()
    axis = number / 2
    node = cell_node(grid, cells[n])
    if (node[axis] & 1) != (number & 1):
        return
    high = 2 * axis + 1
    low = 2 * axis
    c = corner_codes(codes, node)
    for diagonal in range(2):
        code = c[FACE_CORNERS[4 * high + diagonal]]
        case = case_of(c, code)
        if is_ambiguous(case, high):
            flips = wp.uint32(flips_inout[n])
            if runs_twice(trace_cell(case, joined_faces(c, case, flips)), high):
                other = along(node, axis, 1)
                m = active_index(words, grid, other)
                d = corner_codes(codes, other)
                other_flips = wp.uint32(flips_inout[m])
                other_case = case_of(d, code)
                if runs_twice(trace_cell(other_case, joined_faces(d, other_case, other_flips)), low):
                    flips_inout[n] = wp.uint16(flips | (wp.uint32(1) << wp.uint32(2 * high + diagonal)))
                    flips_inout[m] = wp.uint16(other_flips | (wp.uint32(1) << wp.uint32(2 * low + diagonal)))


@wp.kernel
def join_edges_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    codes: wp.array3d(dtype=wp.uint16),
    cells: wp.array(dtype=wp.int64),
    flips: wp.array(dtype=wp.uint16),
    # Out:
    owners_out: wp.array(dtype=wp.uint64),
    counts_out: wp.array(dtype=wp.int64),
) -> None:
    """Find the clusters of a cell and count them. One thread per active cell."""
    n = first + wp.tid()
    owners = clusters_of(corner_codes(codes, cell_node(grid, cells[n])), wp.uint32(flips[n]))
    owners_out[n] = owners
    counts_out[n] = wp.int64(owner_count(owners))


@wp.func
def net_vertex(
    grid: Grid,
    words: CrossingWords,
    owners: wp.array(dtype=wp.uint64),
    starts: wp.array(dtype=wp.int64),
    cell: wp.vec3i,
    edge: wp.int32,
) -> wp.int32:
    """Return the vertex of an edge in a cell."""
    n = active_index(words, grid, cell)
    return wp.int32(starts[n]) + owner_of(owners[n], edge)


@wp.func
def cell_round(node: wp.vec3i, axis: wp.int32, place: wp.int32) -> wp.vec3i:
    """Return the cell round the edge from a node along an axis that has the edge at a place, u + 2 v."""
    return along(along(node, (axis + 1) % 3, -(place & 1)), (axis + 2) % 3, -(place >> 1))


@wp.kernel
def connect_edges_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    words: CrossingWords,
    codes: wp.array3d(dtype=wp.uint16),
    owners: wp.array(dtype=wp.uint64),
    starts: wp.array(dtype=wp.int64),
    # Out:
    faces_out: wp.array(dtype=wp.vec4i),
    sides_out: wp.array(dtype=wp.vec2i),
    frames_out: wp.array(dtype=wp.uint8),
) -> None:
    """Connect the vertices round each crossed edge. One thread per word of nodes."""
    n = first + wp.tid()
    q = wp.int32(words.quad_start[n])
    if q == wp.int32(words.quad_start[n + 1]):
        return
    row = n / grid.words
    place = row_place(grid, row)
    start = 32 * (n - row * grid.words)
    for axis in range(3):
        left = words.x[n]
        if axis == 1:
            left = words.y[n]
        elif axis == 2:
            left = words.z[n]
        while left != wp.uint32(0):
            node = wp.vec3i(start + bit_index(left), place[0], place[1])
            left &= left - wp.uint32(1)
            end = along(node, axis, 1)
            a = wp.int32(codes[node[2], node[1], node[0]])
            b = wp.int32(codes[end[2], end[1], end[0]])
            # anticlockwise round the axis: the cells that have the edge at places 3, 2, 0, 1
            v0 = net_vertex(grid, words, owners, starts, cell_round(node, axis, 3), EDGE_AT[4 * axis + 3])
            v1 = net_vertex(grid, words, owners, starts, cell_round(node, axis, 2), EDGE_AT[4 * axis + 2])
            v2 = net_vertex(grid, words, owners, starts, node, EDGE_AT[4 * axis])
            v3 = net_vertex(grid, words, owners, starts, cell_round(node, axis, 1), EDGE_AT[4 * axis + 1])
            if a > b:
                faces_out[q] = wp.vec4i(v0, v1, v2, v3)
                sides_out[q] = wp.vec2i(a, b)
                frames_out[q] = wp.uint8(axis)
            else:
                faces_out[q] = wp.vec4i(v0, v3, v2, v1)
                sides_out[q] = wp.vec2i(b, a)
                frames_out[q] = wp.uint8(axis + 4)
            q += 1
