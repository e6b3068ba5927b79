"""MC polygons of the special cells: decide their ambiguous faces, trace, flip, number the vertices.

An ambiguous face is decided by the asymptotic decider in its product form: the inside corners are joined if
the product of their distances to the isovalue is at least that of the outside corners' (in double precision;
equivalent to the sign of the face's saddle value, but without its quotient). The decision does not depend on
the order of the corners, so both cells of the face agree.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.device import ITEMS_A_SLAB, Device
from dmc_cli.surface.cells import CellBits, Cells
from dmc_cli.surface.fans import number_vertices_kernel
from dmc_cli.surface.field import Field, node_value
from dmc_cli.surface.flips import flip_faces
from dmc_cli.surface.grid import Grid, GridShape
from dmc_cli.surface.special_cells import (
    AMBIGUOUS,
    AMBIGUOUS_FACES,
    TALLIES,
    SpecialCells,
    cell_case,
    is_active,
)
from dmc_cli.surface.tracing import FACE_CORNERS, is_ambiguous, is_split, label_all, trace_cell

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@dataclass(frozen=True)
class Polygons:
    """MC polygons of the special cells, and what was counted on the way.

    Attributes:
        special: The kernels' `SpecialCells`.
        special_count: Number of special cells.
        vertex_count: Number of vertices of all cells.
        polygon_count: Number of polygons of all cells, those without a vertex included.
        unused_count: Polygons without a quad, hence without a vertex.
        multi_polygon_cells: Cells with more than one polygon.
        ambiguous_faces: Faces with diagonal corners inside, each counted once.
        flipped_faces: Faces whose decision was flipped.
    """

    special: Any
    special_count: int
    vertex_count: int
    polygon_count: int
    unused_count: int
    multi_polygon_cells: int
    ambiguous_faces: int
    flipped_faces: int


def trace_polygons(cells: Cells, field: Any, grid: GridShape, manifold: bool, device: Device) -> Polygons:
    """Trace the polygons of the special cells and number all vertices: ordinary cells' first.

    Args:
        cells: Active cells.
        field: The `Field` whose zero set is the surface.
        grid: The grid over the volume.
        manifold: Flip faces until the mesh is manifold, and give each fan its own vertex.
        device: Where to work.
    """
    count = cells.special_count
    special = SpecialCells()
    special.row, special.i = cells.special_row, cells.special_i
    special.joined = device.empty(count, wp.uint32)
    special.polygons, special.vertices = device.empty(count, wp.uint64), device.empty(count, wp.uint64)
    struct = grid.struct()
    tallies = device.empty((TALLIES, count), wp.uint8)
    inputs = [struct, cells.bits, field, special]
    outputs = [special.joined, special.polygons, tallies]
    device.launch(trace_polygons_kernel, count, inputs, outputs, ITEMS_A_SLAB)
    flipped_faces = flip_faces(cells, special, count, struct, device) if manifold else 0
    vertices = device.empty(count, wp.int64)
    device.launch(
        number_vertices_kernel,
        count,
        [struct, cells.bits, special, manifold, field.has_absent],
        [special.vertices, vertices, tallies],
        ITEMS_A_SLAB,
    )
    special.first_vertex, vertex_count = device.starts(vertices)
    polygons, unused, multi, ambiguous = device.totals(tallies)
    return Polygons(
        special=special,
        special_count=count,
        vertex_count=cells.ordinary_count + vertex_count,
        polygon_count=cells.ordinary_count + polygons,
        unused_count=unused,
        multi_polygon_cells=multi,
        ambiguous_faces=ambiguous,
        flipped_faces=flipped_faces,
    )


@wp.func
def face_value(
    field: Field, grid: Grid, i: wp.int32, j: wp.int32, k: wp.int32, face: wp.int32, n: wp.int32
) -> wp.float64:
    """Return F at corner n of a face of cell (i, j, k)."""
    corner = FACE_CORNERS[4 * face + n]
    return node_value(field, grid, i + (corner & 1), j + ((corner >> 1) & 1), k + (corner >> 2))


@wp.kernel
def trace_polygons_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    field: Field,
    special: SpecialCells,
    # Out:
    joined_out: wp.array(dtype=wp.uint32),
    polygons_out: wp.array(dtype=wp.uint64),
    tallies_out: wp.array2d(dtype=wp.uint8),
):
    """Decide the ambiguous faces, count those no lower cell shares, and trace. One thread a special cell."""
    s = first + wp.tid()
    row = special.row[s]
    i = special.i[s]
    j = row % grid.ny
    k = row // grid.ny
    case = cell_case(grid, bits.inside, row, i)
    joined = wp.uint32(0)
    count = int(0)
    if is_split(case):
        for face in range(6):
            if is_ambiguous(case, face):
                f03 = face_value(field, grid, i, j, k, face, 0) * face_value(field, grid, i, j, k, face, 3)
                f12 = face_value(field, grid, i, j, k, face, 1) * face_value(field, grid, i, j, k, face, 2)
                first_inside = ((case >> FACE_CORNERS[4 * face]) & 1) == 1
                if (first_inside and f03 >= f12) or (not first_inside and f12 >= f03):
                    joined |= wp.uint32(1) << wp.uint32(face)
                joined |= AMBIGUOUS << wp.uint32(face)
                axis = face / 2
                low = is_active(
                    grid,
                    bits,
                    i - wp.where(axis == 0, 1, 0),
                    j - wp.where(axis == 1, 1, 0),
                    k - wp.where(axis == 2, 1, 0),
                )
                if face % 2 == 1 or not low:
                    count += 1
        polygons_out[s] = trace_cell(case, joined)
    else:
        polygons_out[s] = label_all(case)
    joined_out[s] = joined
    tallies_out[AMBIGUOUS_FACES, s] = wp.uint8(count)
