"""Find the MC polygons of special cells: decide ambiguous faces, trace, flip, number the vertices."""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.contouring.dual_marching_cubes.cells import Cells
from dmc_cli.contouring.dual_marching_cubes.manifold_repair import flip_faces, suspect_faces
from dmc_cli.contouring.dual_marching_cubes.polygon_vertices import number_vertices, store_vertices
from dmc_cli.contouring.dual_marching_cubes.special_cells import (
    AMBIGUOUS_FACES,
    TALLIES,
    SpecialCells,
    is_active,
)
from dmc_cli.contouring.stages.cell_words import CellBits, cell_case
from dmc_cli.contouring.stages.face_decisions import are_inside_joined
from dmc_cli.contouring.stages.tracing import (
    is_ambiguous,
    is_split,
    single_owner,
    trace_cell,
)
from dmc_cli.field import Field, Grid, GridShape, cell_values, row_place
from dmc_cli.runtime import ITEMS_A_CHUNK, Device, mesh_size

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@dataclass(frozen=True)
class Polygons:
    """MC polygons of the special cells, with the vertices that stand for them.

    Attributes:
        special: The kernels' `SpecialCells`.
        special_count: Number of special cells.
        vertex_count: Number of vertices of all cells.
    """

    special: Any
    special_count: int
    vertex_count: int


@dataclass(frozen=True)
class Tallies:
    """What was counted on the way.

    Attributes:
        cells: uint8 (`TALLIES`, special_count), what `special_cells` names, of each special cell.
        flipped_faces: Faces whose decision was flipped.
        suspects: uint8 (special_count,), the `suspect_faces` of each special cell, and which were flipped.
    """

    cells: Any
    flipped_faces: int
    suspects: Any


def trace_polygons(
    cells: Cells, field: Any, grid: GridShape, manifold: bool, device: Device
) -> tuple[Polygons, Tallies]:
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
    vertex_counts, suspects = device.empty(count, wp.int64), device.empty(count, wp.uint8)
    tallies = device.empty((TALLIES, count), wp.uint8)
    traced = [special.joined, special.polygons, special.vertices, vertex_counts, tallies]
    inputs = [grid.struct(), cells.bits, field, special, manifold]
    device.launch(trace_polygons_kernel, count, inputs, [*traced, suspects], ITEMS_A_CHUNK)
    flipped_faces = 0
    if manifold:
        inputs = [grid.struct(), cells.bits, special, field.has_nodata]
        flipped_faces = flip_faces(inputs, traced, suspects, device)
    special.first_vertex, vertex_count = device.starts(vertex_counts)
    vertex_count = mesh_size(cells.ordinary_count + vertex_count)
    return Polygons(special, count, vertex_count), Tallies(tallies, flipped_faces, suspects)


@wp.kernel
def trace_polygons_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    field: Field,
    special: SpecialCells,
    splits_fans: wp.bool,
    # Out:
    joined_out: wp.array(dtype=wp.uint32),
    polygons_out: wp.array(dtype=wp.uint64),
    vertices_out: wp.array(dtype=wp.uint64),
    vertex_count_out: wp.array(dtype=wp.int64),
    tallies_out: wp.array2d(dtype=wp.uint8),
    suspects_out: wp.array(dtype=wp.uint8),
) -> None:
    """Decide the ambiguous faces, count those no lower cell shares, trace, and number the vertices.

    One thread a special cell.
    """
    s = first + wp.tid()
    row = special.row[s]
    i = special.i[s]
    place = row_place(grid, row)
    j = place[0]
    k = place[1]
    case = cell_case(grid, bits.inside, row, i)
    owners = wp.uint64(0)
    joined = wp.uint32(0)
    suspects = wp.uint32(0)
    count = int(0)
    if is_split(case):
        f = cell_values(field, grid, i, j, k)
        for face in range(6):
            if is_ambiguous(case, face):
                if are_inside_joined(f, case, face):
                    joined |= wp.uint32(1) << wp.uint32(face)
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
        owners = trace_cell(case, joined)
        suspects = suspect_faces(case, owners)
    else:
        owners = single_owner(case)
    joined_out[s] = joined
    polygons_out[s] = owners
    suspects_out[s] = wp.uint8(suspects)
    tallies_out[AMBIGUOUS_FACES, s] = wp.uint8(count)
    found = number_vertices(grid, bits, row, i, case, joined, owners, splits_fans, field.has_nodata)
    store_vertices(found, s, vertices_out, vertex_count_out, tallies_out)
