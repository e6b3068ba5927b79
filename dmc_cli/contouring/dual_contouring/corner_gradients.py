"""Take the gradients of F at the corners of cells by central differences, in single precision.

A cell away from the volume's ends and from nodes without data takes them from its stored values, sixteen
cells at a time on CPU; any other one as normals do, one-sided where a neighbour is missing. The sign of F is
left out: a plane has two sides.
"""

import warp as wp

from dmc_cli.bits import LANES
from dmc_cli.contouring.normals import is_interior
from dmc_cli.field import (
    Field,
    Grid,
    IntLanes,
    PairLanes,
    RowLanes,
    corner_differences,
    node_of_volume,
    pairs_at,
    rows_at,
    stored_value,
)
from dmc_cli.runtime import native

CornerGradients = wp.types.vector(length=24, dtype=wp.float32)
"""Derivatives along x, y and z at the eight corners of a cell."""


CellLanes = wp.types.vector(length=32 * LANES, dtype=wp.float32)
"""F and its derivatives along x, y and z at the corners of sixteen cells: of each, corner after corner."""


@wp.func_native(native(__file__, "corner_lanes"))
def corner_lanes(
    row00: RowLanes,
    row10: RowLanes,
    row01: RowLanes,
    row11: RowLanes,
    before0: PairLanes,
    after0: PairLanes,
    before1: PairLanes,
    after1: PairLanes,
    below0: PairLanes,
    below1: PairLanes,
    above0: PairLanes,
    above1: PairLanes,
    sign: wp.float64,
    isovalue: wp.float64,
) -> CellLanes:
    """Return what is at the corners of sixteen cells.

    The rows are those of the corners, the pairs those beyond them along y (before, after) and z (below,
    above). In C++, since clang makes no vectors of these loops over Warp's.
    """
    ...


@wp.func
def half_step(before: wp.float64, after: wp.float64) -> wp.float32:
    """Return the central difference between two values."""
    return wp.float32(wp.float64(0.5) * (after - before))


@wp.func
def gather_cells(field: Field, grid: Grid, node: wp.int64, offsets: IntLanes) -> CellLanes:
    """Return what is at the corners of the cells at `node` + `offsets`, which have neighbours all round."""
    y = wp.int64(grid.nx - 2 * grid.border)
    z = y * wp.int64(grid.ny - 2 * grid.border)
    at = node - wp.int64(1)
    return corner_lanes(
        rows_at(field.values, field.kind, at, offsets),
        rows_at(field.values, field.kind, at + y, offsets),
        rows_at(field.values, field.kind, at + z, offsets),
        rows_at(field.values, field.kind, at + y + z, offsets),
        pairs_at(field.values, field.kind, node - y, offsets),
        pairs_at(field.values, field.kind, node + y + y, offsets),
        pairs_at(field.values, field.kind, node - y + z, offsets),
        pairs_at(field.values, field.kind, node + y + y + z, offsets),
        pairs_at(field.values, field.kind, node - z, offsets),
        pairs_at(field.values, field.kind, node - z + y, offsets),
        pairs_at(field.values, field.kind, node + z + z, offsets),
        pairs_at(field.values, field.kind, node + z + z + y, offsets),
        field.sign,
        field.isovalue,
    )


@wp.func
def interior_gradients(field: Field, grid: Grid, node: wp.vec3i) -> CornerGradients:
    """Return the derivatives at the corners of a cell that has neighbours all round."""
    b = grid.border
    row = wp.int64(grid.nx - 2 * b)
    layer = row * wp.int64(grid.ny - 2 * b)
    lowest = node_of_volume(grid, node[0] - b, node[1] - b, node[2] - b)
    found = CornerGradients()
    for c in range(8):
        at = lowest + wp.int64(c & 1) + wp.int64((c >> 1) & 1) * row + wp.int64(c >> 2) * layer
        step = wp.int64(1)
        for axis in range(3):
            found[3 * c + axis] = half_step(stored_value(field, at - step), stored_value(field, at + step))
            step = wp.where(axis == 0, row, layer)
    return found


@wp.func
def scaled_gradients(field: Field, grid: Grid, node: wp.vec3i) -> CornerGradients:
    """Return the derivatives at the corners of any cell in units of the largest of them."""
    differences = corner_differences(field, grid, node[0], node[1], node[2])
    unit = wp.max(wp.abs(differences))
    found = CornerGradients()
    if unit > wp.float64(0.0):
        for n in range(24):
            found[n] = wp.float32(differences[n] / unit)
    return found


@wp.func
def cell_gradients(field: Field, grid: Grid, node: wp.vec3i) -> CornerGradients:
    """Return the derivatives at the corners of any cell."""
    found = CornerGradients()
    if is_interior(field.has_nodata, grid, node[0], node[1], node[2]):
        found = interior_gradients(field, grid, node)
    else:
        found = scaled_gradients(field, grid, node)
    return found
