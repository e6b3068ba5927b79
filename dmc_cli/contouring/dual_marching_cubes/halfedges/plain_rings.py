"""Find a halfedge and the valence of ordinary cells' vertices, for all cells of a word.

The valences are counted for 32 cells at a time, digit by digit. Which of the candidates for the halfedge a
vertex takes is as good as random: not a branch but a place in a table of the word.
"""

import warp as wp

from dmc_cli.contouring.stages.quad_ranks import QuadWord
from dmc_cli.runtime import native


@wp.func_native(native(__file__, "store_plain_rings"))
def store_plain_rings(
    words: wp.array2d(dtype=QuadWord),
    n: wp.int32,
    row: wp.int32,
    layer: wp.int32,
    ordinary: wp.uint32,
    v: wp.int32,
    inside: wp.uint32,
    inside_y: wp.uint32,
    inside_z: wp.uint32,
    inside_yz: wp.uint32,
    halfedge_out: wp.array(dtype=wp.int32),
    valence_out: wp.array(dtype=wp.int32),
) -> None:
    """Store a halfedge and the valence of the vertices of word n's ordinary cells; v is the first one.

    `row` and `layer` are the words of a row and a layer. A cell takes a quad round an x edge if it has one:
    else its low and its high face across x are alike, and one of the low face's edges is crossed. `inside`
    words are those of the rows, complemented where quads are reversed.
    """
    ...
