"""Colour quads with 24 colours, reduced to 5 (Grosso & Zint 2021, section 3.1.4).

A quad's colour is 3 * (colour of the cell at the lower node of its edge) + axis: 24 in all, different across
every twin. A cell's colour is the parity of its indices (`vertex_colors.py`).

Reduction: classes 5 to 23 in turn take the first of 0 to 4 that no neighbour has; then the quads of colour
4 retry (not in the paper). Quads of one class are never neighbours. The classes 6 r to 6 r + 5 are those of
the rows with (j & 1) | (k & 1) << 1 = r, and neighbours among them lie in one row; so a row does its six
classes by itself.
"""

from dataclasses import replace
from typing import Any

import warp as wp

from dmc_cli.bits import LANES, VECTOR_FLAGS
from dmc_cli.contouring.stages.color_words import color_row, reduce_row, retry_quads
from dmc_cli.contouring.stages.numbering import numbering_of
from dmc_cli.contouring.stages.quad_ranks import QuadWord
from dmc_cli.contouring.surface import Surface
from dmc_cli.field import Grid, row_place
from dmc_cli.mesh import COLOR, COLOR24

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


def color(surface: Surface) -> Surface:
    """Return a connected surface with colours of its quads, uint8 (Q,).

    They are face values: `COLOR24` from the grid, 0 to 23, and `COLOR`, 0 to 4; both differ across twins.
    """
    colors = color_by_grid(surface)
    values = {COLOR24: colors, COLOR: reduce_colors(surface, colors)}
    return replace(surface, mesh=surface.mesh.with_face_values(values))


def color_by_grid(surface: Surface) -> Any:
    """Return the colour of each quad from the grid, 0 to 23, uint8 (Q,)."""
    numbering, grid = numbering_of(surface, is_connected=True), surface.placement.frame.grid
    device = surface.mesh.device
    colors = device.empty(surface.mesh.face_count, wp.uint8)
    inputs = [grid.struct(), numbering.quad_words, numbering.quad_starts]
    device.launch(color_quads_kernel, grid.rows, inputs, [colors])
    return colors


def reduce_colors(surface: Surface, colors: Any) -> Any:
    """Return colours 0 to 4, different across every twin, uint8 (Q,).

    Args:
        surface: A connected surface.
        colors: As `color_by_grid` returns them.
    """
    numbering, grid, mesh = surface.numbering, surface.placement.frame.grid, surface.mesh
    device, twin = mesh.device, mesh.require_halfedges().twin
    reduced = device.empty(colors.shape[0], wp.uint8)
    wp.copy(reduced, colors)
    for group in range(4):
        inputs = [grid.struct(), numbering.quad_words, numbering.quad_starts, twin, group]
        device.launch(reduce_rows_kernel, grid.rows, inputs, [reduced])
    device.launch(retry_kernel, -(-colors.shape[0] // 64), [twin], [reduced])
    return reduced


@wp.func
def group_of_row(grid: Grid, row: wp.int32) -> wp.int32:
    """Return (j & 1) | (k & 1) << 1 of a row."""
    place = row_place(grid, row)
    return (place[0] & 1) | ((place[1] & 1) << 1)


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
) -> None:
    """Colour the quads by the parity of their edge's lower node and its axis. One thread a row."""
    row = first + wp.tid()
    if has_quads(grid, starts, row):
        color_row(words, row, group_of_row(grid, row), colors_out)


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
) -> None:
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
) -> None:
    """Let the quads of the last colour retry the others. One thread 64 quads; they are no neighbours."""
    start = 64 * (first + wp.tid())
    retry_quads(twin, start, wp.min(64, colors_inout.shape[0] - start), colors_inout)
