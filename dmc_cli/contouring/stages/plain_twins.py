"""Find twins through faces that are not ambiguous, for all quads of a word of nodes.

There each face has exactly one other edge with a quad: the parallel one, or one of the two across. So it is
wherever all crossed edges of a face have quads and the face is not ambiguous; on an ambiguous one all three
have. Which one it is, is as good as random, so a branch would be guessed wrongly half of the time; here all
three are looked at, one is selected, and its quad is numbered by counting bits. In C++, since to Warp the
words are an array with strides, which takes twice as long to index.
"""

import warp as wp

from dmc_cli.contouring.stages.quad_ranks import QuadWord
from dmc_cli.runtime import native

UNSURE = wp.constant(-2)
"""Stands for the twin on a side that crosses an ambiguous face."""


@wp.func_native(native(__file__, "store_plain_twins"))
def store_plain_twins(
    words: wp.array2d(dtype=QuadWord),
    n: wp.int32,
    row: wp.int32,
    layer: wp.int32,
    known: wp.uint32,
    forward: wp.uint32,
    q: wp.int32,
    twins_out: wp.array(dtype=wp.vec4i),
) -> None:
    """Store the twins of the quads of word n of the line whose lower node is `known`; q is the first quad.

    `row` and `layer` are the words of a row and a layer; `forward` tells which quads have their normal along
    the axis. A side whose face is ambiguous gets `UNSURE`. A quad round the parallel edge or the `same` one
    across has its normal towards the same end of its edge as ours, round the `opposite` one towards the other
    end.
    """
    ...
