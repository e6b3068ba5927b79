"""Colour the quads of whole rows, in C++: what a quad costs here is a few instructions.

Warp's arrays have strides, and its branches copy what they change; this took three times as long.
"""

import warp as wp

from dmc_cli.contouring.stages.quad_ranks import QuadWord
from dmc_cli.runtime import native


@wp.func_native(native(__file__, "color_row"))
def color_row(
    words: wp.array2d(dtype=QuadWord), row: wp.int32, group: wp.int32, colors_out: wp.array(dtype=wp.uint8)
) -> None:
    """Give the quads of a row of nodes their colours from the grid; bit 0 of a word has an even index."""
    ...


@wp.func_native(native(__file__, "reduce_row"))
def reduce_row(
    words: wp.array2d(dtype=QuadWord),
    twin: wp.array(dtype=wp.int32),
    row: wp.int32,
    group: wp.int32,
    colors_inout: wp.array(dtype=wp.uint8),
) -> None:
    """Give the quads of the classes of a row their lowest free colour, class after class.

    Quads of even nodes are neighbours only at the same node, and so are those of odd nodes; what is odd only
    has to wait for the even nodes beside it. So a word behind is far enough.
    """
    ...


@wp.func_native(native(__file__, "retry_quads"))
def retry_quads(
    twin: wp.array(dtype=wp.int32), start: wp.int32, count: wp.int32, colors_inout: wp.array(dtype=wp.uint8)
) -> None:
    """Let those of `count` quads from `start` on, 64 at most, that have colour 4 retry the others."""
    ...
