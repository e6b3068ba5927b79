"""Flip faces so that the mesh is manifold (`--topology manifold`).

Where an ambiguous face has both its segments in one polygon in both of its cells, the dual mesh would have
an edge with four quads. Flipping the decision of that face splits a polygon in each cell. One sweep over six
classes of faces (x even, x odd, y even, y odd, z even, z odd; index of the face along its axis, in the whole
grid) suffices: a flip never merges polygons and makes no new bad face, and no two faces of a class share a
cell. Each flip closes a tunnel or cuts a bridge.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.bits import bit_index, flagged
from dmc_cli.contouring.dual_marching_cubes.polygon_vertices import number_vertices, store_vertices
from dmc_cli.contouring.dual_marching_cubes.special_cells import (
    SpecialCells,
    find_special,
    is_active,
)
from dmc_cli.contouring.stages.cell_words import CellBits, cell_case
from dmc_cli.contouring.stages.tracing import FACE_EDGES, is_ambiguous, owner_of, trace_cell
from dmc_cli.field import Grid, row_place
from dmc_cli.runtime import ITEMS_A_CHUNK, Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


FLIPPED = wp.constant(8)
"""The first of the bits x, y, z of a special cell that say which of its high faces were flipped, beside those
that say which are suspect."""


CLASSES = 6
"""Classes of faces: x even, x odd, y even, y odd, z even, z odd."""

FEW = 256
"""Cells with suspect faces that one CPU thread goes through, class by class, while more would get ready."""


def flip_faces(inputs: Sequence[Any], traced: Sequence[Any], suspects: Any, device: Device) -> int:
    """Flip the faces that make non-manifold edges; return their number.

    Args:
        inputs: The kernel's first ones.
        traced: What tracing found of each special cell, which changes for the cells of a flipped face.
        suspects: The `suspect_faces` of each special cell, uint8; which were flipped is noted there.
        device: Where to work.
    """
    host = suspects.numpy()
    count = int(np.count_nonzero(host))
    if count == 0:
        return 0
    cells, span, classes = len(host), device.span, 1
    if device.is_cpu and count < FEW:
        span, classes = cells, CLASSES
    outputs = [*traced, suspects]
    for first_class in range(0, CLASSES, classes):
        rest = [first_class, classes, span]
        device.launch(flip_faces_kernel, -(-cells // span), [*inputs, *rest], outputs, ITEMS_A_CHUNK)
    noted = suspects.numpy()
    return sum(int(np.count_nonzero(noted & (int(FLIPPED) << axis))) for axis in range(3))


@wp.func
def is_one_polygon(owners: wp.uint64, face: wp.int32) -> wp.bool:
    """Return whether all segments of an ambiguous face are in one polygon."""
    owner = owner_of(owners, FACE_EDGES[4 * face])
    same = bool(True)
    for side in range(1, 4):
        if owner_of(owners, FACE_EDGES[4 * face + side]) != owner:
            same = False
    return same


@wp.func
def suspect_faces(case: wp.int32, owners: wp.uint64) -> wp.uint32:
    """Return a bit for x, y, z: whether a cell's high face there is ambiguous, its segments in one polygon.

    Others need no flip, then and later: a polygon that a flip splits is never whole again.
    """
    suspects = wp.uint32(0)
    for axis in range(3):
        if is_ambiguous(case, 2 * axis + 1) and is_one_polygon(owners, 2 * axis + 1):
            suspects |= wp.uint32(1) << wp.uint32(axis)
    return suspects


@wp.func
def retrace(
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    has_nodata: wp.int32,
    s: wp.int32,
    face: wp.int32,
    joined_inout: wp.array(dtype=wp.uint32),
    polygons_inout: wp.array(dtype=wp.uint64),
    vertices_inout: wp.array(dtype=wp.uint64),
    vertex_count_inout: wp.array(dtype=wp.int64),
    tallies_inout: wp.array2d(dtype=wp.uint8),
) -> None:
    """Trace and number special cell s again, the decision of one of its faces flipped."""
    row = special.row[s]
    i = special.i[s]
    case = cell_case(grid, bits.inside, row, i)
    joined = joined_inout[s] ^ (wp.uint32(1) << wp.uint32(face))
    owners = trace_cell(case, joined)
    joined_inout[s] = joined
    polygons_inout[s] = owners
    found = number_vertices(grid, bits, row, i, case, joined, owners, True, has_nodata)
    store_vertices(found, s, vertices_inout, vertex_count_inout, tallies_inout)


@wp.func
def bad_neighbour(
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    s: wp.int32,
    axis: wp.int32,
    parity: wp.int32,
    polygons: wp.array(dtype=wp.uint64),
) -> wp.int32:
    """Return the special cell behind the high face on `axis` of s if it is of the class and bad, else -1."""
    i = special.i[s]
    place = row_place(grid, special.row[s])
    j = place[0]
    k = place[1]
    plane = wp.where(axis == 0, i, wp.where(axis == 1, j, k)) + 1
    ni = i + wp.where(axis == 0, 1, 0)
    nj = j + wp.where(axis == 1, 1, 0)
    nk = k + wp.where(axis == 2, 1, 0)
    face = 2 * axis + 1
    found = int(-1)
    if plane % 2 == parity and is_active(grid, bits, ni, nj, nk) and is_one_polygon(polygons[s], face):
        other = find_special(bits, nj + nk * grid.ny, ni)
        if is_one_polygon(polygons[other], face - 1):
            found = other
    return found


@wp.kernel
def flip_faces_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    has_nodata: wp.int32,
    first_class: wp.int32,
    classes: wp.int32,
    span: wp.int32,
    # In/out:
    joined_inout: wp.array(dtype=wp.uint32),
    polygons_inout: wp.array(dtype=wp.uint64),
    vertices_inout: wp.array(dtype=wp.uint64),
    vertex_count_inout: wp.array(dtype=wp.int64),
    tallies_inout: wp.array2d(dtype=wp.uint8),
    suspects_inout: wp.array(dtype=wp.uint8),
) -> None:
    """Flip the bad faces of some classes, one after the other. One thread `span` special cells.

    Two faces of a class never share a cell, so no thread writes what another one reads; one thread alone may
    go through several classes.
    """
    begin = span * (first + wp.tid())
    for face_class in range(first_class, first_class + classes):
        axis = face_class / 2
        for start in range(begin, wp.min(begin + span, suspects_inout.shape[0]), 32):
            remaining = flagged(suspects_inout, start, wp.min(span, 32), 1 << axis)
            while remaining != wp.uint32(0):  # hardly ever
                s = start + bit_index(remaining)
                remaining &= remaining - wp.uint32(1)
                other = bad_neighbour(grid, bits, special, s, axis, face_class % 2, polygons_inout)
                if other >= 0:
                    suspects_inout[s] = suspects_inout[s] | wp.uint8(FLIPPED << axis)
                    for side in range(2):
                        retrace(
                            grid,
                            bits,
                            special,
                            has_nodata,
                            wp.where(side == 0, other, s),
                            2 * axis + side,
                            joined_inout,
                            polygons_inout,
                            vertices_inout,
                            vertex_count_inout,
                            tallies_inout,
                        )
