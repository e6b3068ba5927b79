"""Connect quads as if all cells round them were ordinary, for all edges of a block of words.

A cell's vertex is the rank of its bit; the cell before an ordinary one along x has the vertex before. Axis
and normal are selected, not branched upon.
"""

import warp as wp

from dmc_cli.bits import Words
from dmc_cli.runtime import native

QuadEdges = wp.types.vector(length=48, dtype=wp.uint32)
"""The nodes of a block of words from which an edge along x, y, z goes up that carries a quad: a bit each."""


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
