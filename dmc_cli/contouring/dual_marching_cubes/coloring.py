"""Colour vertices with 8 colours, quads with 24 reduced to 5 (Grosso & Zint 2021, section 3.1.4).

A cell's colour is the parity of its indices, (i & 1) | (j & 1) << 1 | (k & 1) << 2; a vertex has its
cell's. A quad's colour is 3 * (colour of the cell at the lower node of its edge) + axis: 24 in all,
different across every twin. With a closed border the indices are those of the padded grid.

Reduction: classes 5 to 23 in turn take the first of 0 to 4 that no neighbour has; then the quads of colour
4 retry (not in the paper). Quads of one class are never neighbours. The classes 6 r to 6 r + 5 are those of
the rows with (j & 1) | (k & 1) << 1 = r, and neighbours among them lie in one row; so a row does its six
classes by itself.

Removing quads makes neighbours of quads that were none. `repair_colors` gives new colours, again 0 to 4,
where two neighbours have the same: in rounds, in which a quad waits for neighbours with a lower key.
"""

from typing import Any

import warp as wp

from dmc_cli.bits.selection import concatenated, keep_flagged, turn_key
from dmc_cli.bits.words import LANES, VECTOR_FLAGS
from dmc_cli.contouring.dual_marching_cubes.color_words import color_row, reduce_row, retry_quads
from dmc_cli.contouring.dual_marching_cubes.halfedges.quad_ranks import QuadWord
from dmc_cli.field.grid import Grid
from dmc_cli.field.prefetch import fetch_onward
from dmc_cli.mesh.surface import Surface
from dmc_cli.runtime.device import FLAGS_A_CHUNK, ITEMS_A_CHUNK, Device

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


def color_quads(surface: Surface, words: Any) -> Any:
    """Return the colour of each quad from the grid, 0 to 23, uint8 (Q,).

    Args:
        surface: The surface as it was extracted.
        words: The quads' ranks, as `rank_quads` returns them.
    """
    device = surface.device
    colors = device.empty(surface.quads.shape[0], wp.uint8)
    device.launch(
        color_quads_kernel, surface.grid.rows, [surface.grid.struct(), words, surface.quad_starts], [colors]
    )
    return colors


def reduce_colors(surface: Surface, words: Any, twin: Any, colors: Any) -> Any:
    """Return colours 0 to 4, different across every twin, uint8 (Q,).

    Args:
        surface: The surface as it was extracted.
        words: The quads' ranks.
        twin: Twin of each halfedge, int32 (4Q,).
        colors: As `color_quads` returns them.
    """
    device = surface.device
    reduced = device.empty(colors.shape[0], wp.uint8)
    wp.copy(reduced, colors)
    for group in range(4):
        inputs = [surface.grid.struct(), words, surface.quad_starts, twin, group]
        device.launch(reduce_rows_kernel, surface.grid.rows, inputs, [reduced])
    device.launch(retry_kernel, -(-colors.shape[0] // 64), [twin], [reduced])
    return reduced


def color_vertices(surface: Surface) -> Any:
    """Return the colour of each vertex's cell, 0 to 7, uint8 (V,)."""
    device, count = surface.device, surface.vertices.shape[0]
    colors = device.empty(count, wp.uint8)
    device.launch(color_vertices_kernel, count, [surface.grid.struct(), surface.vertex_cell], [colors])
    return colors


def repair_colors(device: Device, twin: Any, colors: Any, *seams: Any, gone: Any | None = None) -> None:
    """Give other colours, 0 to 4, to quads with the colour of a neighbour, until there are none.

    Args:
        device: Where to work.
        twin: Twin of each halfedge, int32 (4Q,).
        colors: Colours 0 to 4, uint8 (Q,); changed in place.
        seams: Lists of the halfedges that got new twins, int32, -1 for none: nowhere else can colours clash.
        gone: Quads that are no more, uint8 (Q,), 1 for those; None if all are there.
    """
    gone = device.zeros(colors.shape[0], wp.uint8) if gone is None else gone
    listed = concatenated(device, seams)
    flags = device.empty(listed.shape[0], wp.int64)
    device.launch(find_clashes_kernel, listed.shape[0], [twin, colors, gone, listed], [flags], FLAGS_A_CHUNK)
    clashing = keep_flagged(device, listed, flags)
    quads = device.empty(2 * clashing.shape[0], wp.int32)
    device.launch(list_ends_kernel, clashing.shape[0], [twin, clashing], [quads], FLAGS_A_CHUNK)
    while quads.shape[0]:
        size = quads.shape[0]
        chosen, waits = device.empty(size, wp.int32), device.empty(size, wp.int64)
        device.launch(choose_colors_kernel, size, [twin, colors, quads], [chosen, waits], ITEMS_A_CHUNK)
        device.launch(set_colors_kernel, size, [quads, chosen], [colors], FLAGS_A_CHUNK)
        quads = keep_flagged(device, quads, waits)


@wp.func
def group_of_row(grid: Grid, row: wp.int32) -> wp.int32:
    """Return (j & 1) | (k & 1) << 1 of a row."""
    return ((row % grid.ny) & 1) | (((row / grid.ny) & 1) << 1)


@wp.func
def has_quads(grid: Grid, starts: wp.array(dtype=wp.int64), row: wp.int32) -> wp.bool:
    """Return whether the blocks of words that a row is in have quads."""
    n = row * grid.words
    return starts[n / LANES] != starts[(n + grid.words - 1) / LANES + 1]


@wp.kernel
def color_quads_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    words: wp.array2d(dtype=QuadWord),
    starts: wp.array(dtype=wp.int64),
    # Out:
    colors_out: wp.array(dtype=wp.uint8),
):
    """Colour the quads by the parity of their edge's lower node and its axis. One thread a row."""
    row = first + wp.tid()
    if has_quads(grid, starts, row):
        color_row(words, row, group_of_row(grid, row), colors_out)


@wp.func
def first_free(twin: wp.array(dtype=wp.int32), colors: wp.array(dtype=wp.uint8), q: wp.int32) -> wp.int32:
    """Return the lowest colour that no neighbour of a quad has; it is below 5."""
    taken = int(0)
    for c in range(4):
        t = twin[4 * q + c]
        if t >= 0:
            taken |= 1 << wp.int32(colors[t >> 2])
    free = ~taken
    lowest = free & -free
    return wp.int32(wp.bit_count(wp.uint32(lowest - 1)))


@wp.kernel
def reduce_rows_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    words: wp.array2d(dtype=QuadWord),
    starts: wp.array(dtype=wp.int64),
    twin: wp.array(dtype=wp.int32),
    group: wp.int32,
    # In/out:
    colors_inout: wp.array(dtype=wp.uint8),
):
    """Reduce the six classes of the rows of one group, each in its turn. One thread a row.

    A row of nodes; quads of its group in other rows are no neighbours.
    """
    row = first + wp.tid()
    if group_of_row(grid, row) == group and has_quads(grid, starts, row):
        reduce_row(words, twin, row, group, colors_inout)


@wp.kernel
def retry_kernel(
    # In:
    first: wp.int32,
    twin: wp.array(dtype=wp.int32),
    # In/out:
    colors_inout: wp.array(dtype=wp.uint8),
):
    """Let the quads of the last colour retry the others. One thread 64 quads; they are no neighbours."""
    start = 64 * (first + wp.tid())
    retry_quads(twin, start, wp.min(64, colors_inout.shape[0] - start), colors_inout)


@wp.kernel
def find_clashes_kernel(
    # In:
    first: wp.int32,
    twin: wp.array(dtype=wp.int32),
    colors: wp.array(dtype=wp.uint8),
    gone: wp.array(dtype=wp.uint8),
    seams: wp.array(dtype=wp.int32),
    # Out:
    flags_out: wp.array(dtype=wp.int64),
):
    """Flag the new twins whose quads have one colour. One thread a halfedge of the list."""
    n = first + wp.tid()
    h = seams[n]
    clash = bool(False)
    if h >= 0:
        if gone[h >> 2] == wp.uint8(0) and twin[h] >= 0:
            clash = colors[h >> 2] == colors[twin[h] >> 2]
    flags_out[n] = wp.int64(wp.where(clash, 1, 0))


@wp.kernel
def list_ends_kernel(
    # In:
    first: wp.int32,
    twin: wp.array(dtype=wp.int32),
    seams: wp.array(dtype=wp.int32),
    # Out:
    quads_out: wp.array(dtype=wp.int32),
):
    """List the quads on both sides of halfedges. One thread a halfedge of the list."""
    n = first + wp.tid()
    quads_out[2 * n] = seams[n] >> 2
    quads_out[2 * n + 1] = twin[seams[n]] >> 2


@wp.func
def clashes(twin: wp.array(dtype=wp.int32), colors: wp.array(dtype=wp.uint8), q: wp.int32) -> wp.bool:
    """Return whether a quad has the colour of a neighbour."""
    found = bool(False)
    for c in range(4):
        t = twin[4 * q + c]
        if t >= 0:
            found = found or colors[t >> 2] == colors[q]
    return found


@wp.kernel
def choose_colors_kernel(
    # In:
    first: wp.int32,
    twin: wp.array(dtype=wp.int32),
    colors: wp.array(dtype=wp.uint8),
    quads: wp.array(dtype=wp.int32),
    # Out:
    chosen_out: wp.array(dtype=wp.int32),
    waits_out: wp.array(dtype=wp.int64),
):
    """Choose a colour for each quad in a clash, unless a neighbour with a lower key is in one, too.

    One thread a quad of the list, which may hold a quad more than once.
    """
    n = first + wp.tid()
    fetch_onward(quads, twin, n)
    q = quads[n]
    chosen = int(-1)
    waits = bool(False)
    if clashes(twin, colors, q):
        for c in range(4):
            t = twin[4 * q + c]
            if t >= 0 and turn_key(t >> 2) < turn_key(q):
                waits = waits or clashes(twin, colors, t >> 2)
        if not waits:
            chosen = first_free(twin, colors, q)
    chosen_out[n] = chosen
    waits_out[n] = wp.int64(wp.where(waits, 1, 0))


@wp.kernel
def set_colors_kernel(
    # In:
    first: wp.int32,
    quads: wp.array(dtype=wp.int32),
    chosen: wp.array(dtype=wp.int32),
    # In/out:
    colors_inout: wp.array(dtype=wp.uint8),
):
    """Set the colours that were chosen. One thread a quad of the list."""
    n = first + wp.tid()
    if chosen[n] >= 0:
        colors_inout[quads[n]] = wp.uint8(chosen[n])


@wp.kernel
def color_vertices_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    cells: wp.array(dtype=wp.int64),
    # Out:
    colors_out: wp.array(dtype=wp.uint8),
):
    """Colour the vertices by the parity of their cell's indices. One thread a vertex."""
    v = first + wp.tid()
    row = wp.int32(cells[v] / wp.int64(grid.nx))
    i = wp.int32(cells[v] - wp.int64(row) * wp.int64(grid.nx))
    colors_out[v] = wp.uint8((i & 1) | (group_of_row(grid, row) << 1))
