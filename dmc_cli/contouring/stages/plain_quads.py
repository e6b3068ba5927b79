"""Connect quads as if all cells round them were ordinary, for all edges of a block of words.

A cell's vertex is the rank of its bit; the cell before an ordinary one along x has the vertex before. Axis
and normal are selected, not branched upon.
"""

import warp as wp

from dmc_cli.bits import LANES, Words, next_node, previous_node
from dmc_cli.contouring.stages.cell_words import CellBits
from dmc_cli.field import Grid
from dmc_cli.runtime import native

QuadEdges = wp.types.vector(length=48, dtype=wp.uint32)
"""The nodes of a block of words from which an edge along x, y, z goes up that carries a quad: a bit each."""


@wp.func
def quad_edges(grid: Grid, bits: CellBits, n: wp.int32) -> QuadEdges:
    """Find the edges with a quad from the nodes of a block: crossed, and their four cells active.

    A cell at a crossed edge is active if it exists. Each of the edges has the cell at its lower node.
    """
    inside = bits.inside_line[n]
    inside_after = bits.inside_line[n + 1]
    inside_y = bits.inside_line[n + grid.words]
    inside_z = bits.inside_line[n + grid.layer]
    here = bits.active_line[n]
    here_before = bits.active_line[n - 1]
    below = bits.active_line[n - grid.words]
    below_before = bits.active_line[n - grid.words - 1]
    front = bits.active_line[n - grid.layer]
    front_before = bits.active_line[n - grid.layer - 1]
    both = bits.active_line[n - grid.layer - grid.words]
    edges = QuadEdges()
    for lane in range(LANES):
        node = inside[lane]
        cells = here[lane]
        behind = cells & previous_node(cells, here_before[lane])
        along_x = node ^ next_node(node, inside_after[lane])
        edges[lane] = along_x & cells & below[lane] & front[lane] & both[lane]
        along_y = node ^ inside_y[lane]
        edges[LANES + lane] = along_y & behind & front[lane] & previous_node(front[lane], front_before[lane])
        along_z = node ^ inside_z[lane]
        edges[2 * LANES + lane] = (
            along_z & behind & below[lane] & previous_node(below[lane], below_before[lane])
        )
    return edges


@wp.func
def count_bits(edges: QuadEdges) -> wp.int32:
    """Return the number of edges in a set: its bits."""
    count = wp.int32(0)
    for n in range(3 * LANES):
        count += wp.int32(wp.bit_count(edges[n]))
    return count


@wp.func_native(native(__file__, "store_plain_quads"))
def store_plain_quads(
    edges: QuadEdges,
    forward: Words,
    ordinary: wp.array(dtype=Words),
    rank: wp.array(dtype=wp.int32),
    at: wp.int32,
    n: wp.int32,
    row: wp.int32,
    layer: wp.int32,
    q: wp.int32,
    quads_out: wp.array(dtype=wp.vec4i),
) -> None:
    """Store the quads round the edges of a block, the first of which is q.

    The block's first word is `at` of the ordinary cells' line and n of their ranks; `row` and `layer` are the
    words of a row and a layer; `forward` tells which nodes' quads round x and z edges have their normal along
    the axis, and those round y edges against it.
    """
    ...
