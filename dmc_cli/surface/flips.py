"""Face flips that make the mesh manifold (`--topology manifold`).

Where an ambiguous face has both its segments in one polygon in both of its cells, the dual mesh would have
an edge with four quads. Flipping the decision of that face splits a polygon in each cell. One sweep over six
classes of faces (x even, x odd, y even, y odd, z even, z odd; index of the face along its axis, in the whole
grid) suffices: a flip never merges polygons and makes no new bad face, and no two faces of a class share a
cell. Each flip closes a tunnel or cuts a bridge.
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.device import ITEMS_A_SLAB, Device
from dmc_cli.surface.cells import CellBits, Cells
from dmc_cli.surface.grid import Grid, bit_index
from dmc_cli.surface.marks import marked
from dmc_cli.surface.special_cells import SpecialCells, cell_case, find_special, is_active
from dmc_cli.surface.tracing import FACE_EDGES, is_ambiguous, label_of, trace_cell

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


FLIPPED = wp.constant(8)
"""The first of the bits x, y, z of a special cell that say which of its high faces were flipped, beside those
that say which are suspect."""


def flip_faces(cells: Cells, special: Any, suspects: Any, struct: Any, device: Device) -> int:
    """Flip the faces that make non-manifold edges; return their number.

    `suspects` are the `suspect_faces` of each special cell, uint8; which were flipped is noted there.
    """
    device.finish()
    if device.total(suspects) == 0:
        return 0
    threads = -(-suspects.shape[0] // device.span)
    for axis in range(3):
        for parity in range(2):
            inputs = [struct, cells.bits, special, axis, parity, device.span]
            outputs = [special.joined, special.polygons, suspects]
            device.launch(flip_faces_kernel, threads, inputs, outputs, ITEMS_A_SLAB)
    noted = suspects.numpy()
    return sum(int(np.count_nonzero(noted & (int(FLIPPED) << axis))) for axis in range(3))


@wp.func
def is_one_polygon(labels: wp.uint64, face: wp.int32) -> wp.bool:
    """Return whether all segments of an ambiguous face are in one polygon."""
    label = label_of(labels, FACE_EDGES[4 * face])
    same = bool(True)
    for side in range(1, 4):
        if label_of(labels, FACE_EDGES[4 * face + side]) != label:
            same = False
    return same


@wp.func
def suspect_faces(case: wp.int32, labels: wp.uint64) -> wp.uint32:
    """Return a bit for x, y, z: whether a cell's high face there is ambiguous, its segments in one polygon.

    Others need no flip, then and later: a polygon that a flip splits is never whole again.
    """
    suspects = wp.uint32(0)
    for axis in range(3):
        if is_ambiguous(case, 2 * axis + 1) and is_one_polygon(labels, 2 * axis + 1):
            suspects |= wp.uint32(1) << wp.uint32(axis)
    return suspects


@wp.func
def flip_if_bad(
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    s: wp.int32,
    axis: wp.int32,
    parity: wp.int32,
    joined_inout: wp.array(dtype=wp.uint32),
    polygons_inout: wp.array(dtype=wp.uint64),
    suspects_inout: wp.array(dtype=wp.uint8),
):
    """Flip the high face on `axis` of special cell s, which is suspect, if it is of the class and bad."""
    row = special.row[s]
    i = special.i[s]
    j = row % grid.ny
    k = row // grid.ny
    plane = wp.where(axis == 0, i, wp.where(axis == 1, j, k)) + 1
    if plane % 2 != parity:
        return
    face = 2 * axis + 1
    ni = i + wp.where(axis == 0, 1, 0)
    nj = j + wp.where(axis == 1, 1, 0)
    nk = k + wp.where(axis == 2, 1, 0)
    if is_active(grid, bits, ni, nj, nk) and is_one_polygon(polygons_inout[s], face):
        other_row = nj + nk * grid.ny
        other = find_special(bits, other_row, ni)
        if is_one_polygon(polygons_inout[other], face - 1):
            joined = joined_inout[s] ^ (wp.uint32(1) << wp.uint32(face))
            other_joined = joined_inout[other] ^ (wp.uint32(1) << wp.uint32(face - 1))
            joined_inout[s] = joined
            joined_inout[other] = other_joined
            polygons_inout[s] = trace_cell(cell_case(grid, bits.inside, row, i), joined)
            polygons_inout[other] = trace_cell(cell_case(grid, bits.inside, other_row, ni), other_joined)
            suspects_inout[s] = suspects_inout[s] | wp.uint8(FLIPPED << axis)


@wp.kernel
def flip_faces_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: CellBits,
    special: SpecialCells,
    axis: wp.int32,
    parity: wp.int32,
    span: wp.int32,
    # In/out:
    joined_inout: wp.array(dtype=wp.uint32),
    polygons_inout: wp.array(dtype=wp.uint64),
    suspects_inout: wp.array(dtype=wp.uint8),
):
    """Flip the bad faces of one class. One thread `span` special cells, for their high faces on `axis`.

    Two faces of a class never share a cell, so no thread writes what another one reads.
    """
    start = span * (first + wp.tid())
    left = marked(suspects_inout, start, span, 1 << axis)
    while left != wp.uint32(0):  # hardly ever
        s = start + bit_index(left)
        flip_if_bad(grid, bits, special, s, axis, parity, joined_inout, polygons_inout, suspects_inout)
        left &= left - wp.uint32(1)
