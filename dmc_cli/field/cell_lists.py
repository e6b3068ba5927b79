"""List the cells whose bits are set in a block of words: their numbers, in the order of the bits."""

import warp as wp

from dmc_cli.bits import Words
from dmc_cli.runtime import native


@wp.func_native(native(__file__, "store_cells"))
def store_cells(
    words: Words,
    n: wp.int32,
    words_a_row: wp.int32,
    nx: wp.int32,
    v: wp.int32,
    cell_out: wp.array(dtype=wp.int64),
) -> None:
    """Store the numbers of the cells of a block of words, its first one word n of the line, from v on."""
    ...
