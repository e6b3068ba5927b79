"""Take each label's closed shell from the conforming net: the same quads, with vertices of its own.

The vertices of a label's shell are the loops of its mask, each at the place of the cluster that it lies in,
so that shells share the places of their vertices to the bit, while each of them is a 2-manifold. Shells look
outwards: quads of the smaller label are turned round.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.bits import bit_index
from dmc_cli.contouring.label_surfaces.cell_loops import corner_codes, is_first, loops_of, owner_count
from dmc_cli.contouring.label_surfaces.crossings import CrossingWords, active_index
from dmc_cli.contouring.label_surfaces.net import EDGE_AT, LabelNet, cell_round
from dmc_cli.contouring.stages.tracing import edges_owned, owner_of
from dmc_cli.field import Grid, cell_node, row_place
from dmc_cli.runtime import ITEMS_A_CHUNK

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@dataclass(frozen=True)
class Shells:
    """The shells of all labels but the background, side by side.

    Attributes:
        vertices: The vertex of the net that each vertex lies at, int32 (V,).
        vertex_codes: Its label's code, int32 (V,).
        faces: Vertices of each quad, int32 vec4 (Q,), anticlockwise seen from outside.
        face_codes: Its label's code, int32 (Q,).
    """

    vertices: Any
    vertex_codes: Any
    faces: Any
    face_codes: Any


def extract_shells(net: LabelNet) -> Shells:
    """Return the shells of a net's labels.

    Raises:
        DeviceError: There are more quads or vertices than 32 bits can number.
    """
    device, grid = net.device, net.grid.struct()
    cells = int(net.cells.shape[0])
    inputs = [grid, net.codes, net.cells, net.flips]
    counts = device.empty(cells, wp.int64)
    device.launch(count_loops_kernel, cells, inputs, [counts], ITEMS_A_CHUNK)
    starts, count = device.starts(counts)
    vertices, vertex_codes = device.empty(count, wp.int32), device.empty(count, wp.int32)
    inputs += [net.owners, net.vertex_start, starts]
    device.launch(emit_loops_kernel, cells, inputs, [vertices, vertex_codes], ITEMS_A_CHUNK)
    words = net.grid.layer * net.grid.nz
    counts = device.empty(words, wp.int64)
    device.launch(count_sides_kernel, words, [net.words, net.sides], [counts])
    quad_starts, quads = device.starts(counts)
    faces, face_codes = device.empty(quads, wp.vec4i), device.empty(quads, wp.int32)
    inputs = [grid, net.words, net.codes, net.cells, net.flips, net.sides, net.frames, starts, quad_starts]
    device.launch(emit_sides_kernel, words, inputs, [faces, face_codes])
    return Shells(vertices, vertex_codes, faces, face_codes)


@wp.kernel
def count_loops_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    codes: wp.array3d(dtype=wp.uint16),
    cells: wp.array(dtype=wp.int64),
    flips: wp.array(dtype=wp.uint16),
    # Out:
    counts_out: wp.array(dtype=wp.int64),
) -> None:
    """Count the loops of all labels in a cell. One thread per active cell."""
    n = first + wp.tid()
    c = corner_codes(codes, cell_node(grid, cells[n]))
    count = int(0)
    for corner in range(8):
        if c[corner] != 0 and is_first(c, corner):
            count += owner_count(loops_of(c, c[corner], wp.uint32(flips[n])))
    counts_out[n] = wp.int64(count)


@wp.kernel
def emit_loops_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    codes: wp.array3d(dtype=wp.uint16),
    cells: wp.array(dtype=wp.int64),
    flips: wp.array(dtype=wp.uint16),
    owners: wp.array(dtype=wp.uint64),
    vertex_start: wp.array(dtype=wp.int64),
    starts: wp.array(dtype=wp.int64),
    # Out:
    vertices_out: wp.array(dtype=wp.int32),
    codes_out: wp.array(dtype=wp.int32),
) -> None:
    """Find the vertex of the net that each loop of a cell lies at. One thread per active cell."""
    n = first + wp.tid()
    c = corner_codes(codes, cell_node(grid, cells[n]))
    slot = wp.int32(starts[n])
    for corner in range(8):
        if c[corner] != 0 and is_first(c, corner):
            loops = loops_of(c, c[corner], wp.uint32(flips[n]))
            for loop in range(owner_count(loops)):
                edge = bit_index(edges_owned(loops, loop))
                vertices_out[slot] = wp.int32(vertex_start[n]) + owner_of(owners[n], edge)
                codes_out[slot] = c[corner]
                slot += 1


@wp.kernel
def count_sides_kernel(
    # In:
    first: wp.int32,
    words: CrossingWords,
    sides: wp.array(dtype=wp.vec2i),
    # Out:
    counts_out: wp.array(dtype=wp.int64),
) -> None:
    """Count the sides of a word's quads that have a label other than the background. One thread per word."""
    n = first + wp.tid()
    count = int(0)
    for q in range(wp.int32(words.quad_start[n]), wp.int32(words.quad_start[n + 1])):
        count += wp.where(sides[q][1] != 0, 2, 1)
    counts_out[n] = wp.int64(count)


@wp.func
def loop_vertex(
    grid: Grid,
    words: CrossingWords,
    codes: wp.array3d(dtype=wp.uint16),
    flips: wp.array(dtype=wp.uint16),
    starts: wp.array(dtype=wp.int64),
    cell: wp.vec3i,
    edge: wp.int32,
    code: wp.int32,
) -> wp.int32:
    """Return the vertex of a label's shell that an edge of a cell belongs to."""
    n = active_index(words, grid, cell)
    c = corner_codes(codes, cell)
    vertex = wp.int32(starts[n])
    if wp.int32(starts[n + 1]) - vertex == 1:
        return vertex
    for corner in range(8):
        if c[corner] == code:
            return vertex + owner_of(loops_of(c, code, wp.uint32(flips[n])), edge)
        if c[corner] != 0 and is_first(c, corner):
            vertex += owner_count(loops_of(c, c[corner], wp.uint32(flips[n])))
    return -1


@wp.kernel
def emit_sides_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    words: CrossingWords,
    codes: wp.array3d(dtype=wp.uint16),
    cells: wp.array(dtype=wp.int64),
    flips: wp.array(dtype=wp.uint16),
    sides: wp.array(dtype=wp.vec2i),
    frames: wp.array(dtype=wp.uint8),
    starts: wp.array(dtype=wp.int64),
    quad_starts: wp.array(dtype=wp.int64),
    # Out:
    faces_out: wp.array(dtype=wp.vec4i),
    codes_out: wp.array(dtype=wp.int32),
) -> None:
    """Connect the shells' vertices round each crossed edge, a quad a label. One thread per word of nodes."""
    n = first + wp.tid()
    slot = wp.int32(quad_starts[n])
    if slot == wp.int32(quad_starts[n + 1]):
        return
    row = n / grid.words
    place = row_place(grid, row)
    start = 32 * (n - row * grid.words)
    left = wp.vec3ui(words.x[n], words.y[n], words.z[n])
    for q in range(wp.int32(words.quad_start[n]), wp.int32(words.quad_start[n + 1])):
        frame = wp.int32(frames[q])
        axis = frame & 3
        node = wp.vec3i(start + bit_index(left[axis]), place[0], place[1])
        left[axis] = left[axis] & (left[axis] - wp.uint32(1))
        for side in range(2):
            code = sides[q][side]
            if code != 0:
                v = wp.vec4i()
                for corner in range(4):
                    at = (corner ^ (corner >> 1)) ^ 3  # places 3, 2, 0, 1
                    v[corner] = loop_vertex(
                        grid,
                        words,
                        codes,
                        flips,
                        starts,
                        cell_round(node, axis, at),
                        EDGE_AT[4 * axis + at],
                        code,
                    )
                if (frame >= 4) == (side == 0):
                    v = wp.vec4i(v[0], v[3], v[2], v[1])
                faces_out[slot] = v
                codes_out[slot] = code
                slot += 1
