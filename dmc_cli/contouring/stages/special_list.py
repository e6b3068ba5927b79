"""List the cells that may have several polygons or a tunnel, and count what the report tells of them.

They are special: no table of cases serves them where the surface is to be that of the trilinear interpolant.
"""

from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.bits import bit_index, low_bits, next_node
from dmc_cli.contouring.stages.cell_words import cell_case, several_polygons
from dmc_cli.contouring.stages.edge_ranks import EdgeBits, EdgeRanks
from dmc_cli.contouring.stages.edge_vertices import cell_exists
from dmc_cli.contouring.stages.tracing import is_ambiguous
from dmc_cli.field import Grid, GridShape, before_line, row_place
from dmc_cli.runtime import ITEMS_A_CHUNK, Device

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@dataclass(frozen=True)
class SpecialList:
    """The special cells in grid order.

    Attributes:
        row: Row of nodes of the lowest node, int32.
        i: Node of the lowest node in that row, int32.
    """

    row: Any
    i: Any


def list_special(ranks: EdgeRanks, grid: GridShape, device: Device) -> SpecialList:
    """List the special cells; they are there for the next launch."""
    found = SpecialList(*(device.empty(ranks.special_count, wp.int32) for _ in range(2)))
    if ranks.special_count:
        inputs = [grid.struct(), ranks.bits, ranks.special_starts]
        device.begin(list_special_kernel, grid.rows, inputs, [found.row, found.i])
    return found


def count_special(
    ranks: EdgeRanks, special: SpecialList, polygon_count: Any, grid: GridShape, device: Device
) -> tuple[int, int, int]:
    """Return the polygons of special cells, how many have several, and the ambiguous faces.

    Args:
        ranks: The crossed edges.
        special: The special cells.
        polygon_count: Polygons of each case, uint8 (256,).
        grid: The grid over the volume.
        device: Where to work.
    """
    counts = device.empty((3, ranks.special_count), wp.uint8)
    if ranks.special_count == 0:
        return 0, 0, 0
    inputs = [grid.struct(), ranks.bits, ranks.rows, special.row, special.i, polygon_count]
    device.launch(count_special_kernel, ranks.special_count, inputs, [counts], ITEMS_A_CHUNK)
    polygons, several, faces = device.totals(counts)
    return polygons, several, faces


@wp.kernel
def list_special_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: EdgeBits,
    starts: wp.array(dtype=wp.int64),
    # Out:
    row_out: wp.array(dtype=wp.int32),
    i_out: wp.array(dtype=wp.int32),
) -> None:
    """List the special cells of a row. One thread per row."""
    row = first + wp.tid()
    slot = wp.int32(starts[row])
    if slot == wp.int32(starts[row + 1]):
        return
    for w in range(grid.words):
        n = before_line(grid) + row * grid.words + w
        c0 = bits.inside[n][0]
        c2 = bits.inside[n + grid.words][0]
        c4 = bits.inside[n + grid.layer][0]
        c6 = bits.inside[n + grid.layer + grid.words][0]
        c1 = next_node(c0, bits.inside[n][1])
        c3 = next_node(c2, bits.inside[n + grid.words][1])
        c5 = next_node(c4, bits.inside[n + grid.layer][1])
        c7 = next_node(c6, bits.inside[n + grid.layer + grid.words][1])
        remaining = several_polygons(c0, c1, c2, c3, c4, c5, c6, c7) & low_bits(grid.nx - 1 - 32 * w)
        if bits.is_marked == 1:
            remaining &= bits.exists[n][0]
        while remaining != wp.uint32(0):
            row_out[slot] = row
            i_out[slot] = 32 * w + bit_index(remaining)
            slot += 1
            remaining &= remaining - wp.uint32(1)


@wp.func
def own_ambiguous_faces(grid: Grid, bits: EdgeBits, case: wp.int32, row: wp.int32, i: wp.int32) -> wp.int32:
    """Return how many ambiguous faces of a cell no lower cell shares, so that each is counted once."""
    place = row_place(grid, row)
    count = int(0)
    for face in range(6):
        if is_ambiguous(case, face):
            axis = face / 2
            lower = wp.vec3i(
                i - wp.where(axis == 0, 1, 0),
                place[0] - wp.where(axis == 1, 1, 0),
                place[1] - wp.where(axis == 2, 1, 0),
            )
            if face % 2 == 1 or not cell_exists(grid, bits, lower):
                count += 1
    return count


@wp.kernel
def count_special_kernel(
    # In:
    first: wp.int32,
    grid: Grid,
    bits: EdgeBits,
    inside: wp.array2d(dtype=wp.uint32),
    rows: wp.array(dtype=wp.int32),
    nodes: wp.array(dtype=wp.int32),
    polygon_count: wp.array(dtype=wp.uint8),
    # Out:
    counts_out: wp.array2d(dtype=wp.uint8),
) -> None:
    """Count the polygons and ambiguous faces of a special cell, and whether it has several polygons.

    One thread per special cell.
    """
    s = first + wp.tid()
    case = cell_case(grid, inside, rows[s], nodes[s])
    polygons = wp.int32(polygon_count[case])
    counts_out[0, s] = wp.uint8(polygons)
    counts_out[1, s] = wp.uint8(wp.where(polygons > 1, 1, 0))
    counts_out[2, s] = wp.uint8(own_ambiguous_faces(grid, bits, case, rows[s], nodes[s]))
