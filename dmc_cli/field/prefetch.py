"""Ask for memory ahead of its use: what a quad's kernel will read, for 32 quads at once.

The quads of a list lie scattered, and what is beside them farther still; one after the other, each would wait
for memory three times over. On a GPU other threads fill the time, and nothing is done.
"""

import warp as wp

from dmc_cli.field.field import Field, node_of_volume
from dmc_cli.field.grid import Grid, cell_node
from dmc_cli.field.sample_reader import prefetch_cell
from dmc_cli.runtime import native


@wp.func_native(native(__file__, "prefetch_neighbors"))
def prefetch_neighbors(
    corners: wp.array(dtype=wp.int32), twin: wp.array(dtype=wp.int32), q: wp.int32
) -> None:
    """Ask for the corners and twins of a quad's neighbours."""
    ...


@wp.func_native(native(__file__, "prefetch_onward"))
def prefetch_onward(quads: wp.array(dtype=wp.int32), twin: wp.array(dtype=wp.int32), n: wp.int32) -> None:
    """Ask for the twins of quads that follow the n-th in a list, and for those of their neighbours."""
    ...


@wp.func_native(native(__file__, "prefetch_vertices"))
def prefetch_vertices(
    corners: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    q: wp.int32,
) -> None:
    """Ask for the vertices of a quad."""
    ...


@wp.func_native(native(__file__, "prefetch_surroundings"))
def prefetch_surroundings(
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    q: wp.int32,
) -> None:
    """Ask for the positions of the neighbours' other vertices; the neighbours are there by now."""
    ...


@wp.func
def prefetch_values(grid: Grid, field: Field, cell: wp.int64) -> None:
    """Ask for the stored values of a cell."""
    row = wp.int64(grid.nx - 2 * grid.border)
    node = cell_node(grid, cell)
    at = node_of_volume(grid, node[0] - grid.border, node[1] - grid.border, node[2] - grid.border)
    prefetch_cell(field.values, field.kind, at, row, row * wp.int64(grid.ny - 2 * grid.border))


@wp.func
def prefetch_around_cuts(
    grid: Grid,
    field: Field,
    corners: wp.array(dtype=wp.int32),
    twin: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    cell: wp.array(dtype=wp.int64),
    local: wp.array(dtype=wp.vec3),
    cuts: wp.array(dtype=wp.int32),
    start: wp.int32,
    end: wp.int32,
) -> None:
    """Ask for all that removing the quads with cuts `start` to `end` - 1 takes; a cut below 0 is none."""
    for n in range(start, end):
        if cuts[n] >= 0:
            prefetch_neighbors(corners, twin, cuts[n] >> 2)
            prefetch_vertices(corners, position, cell, local, cuts[n] >> 2)
    for n in range(start, end):
        if cuts[n] >= 0:
            prefetch_surroundings(corners, twin, position, cuts[n] >> 2)
            prefetch_values(grid, field, cell[corners[cuts[n]]])  # the merged vertex will be near
