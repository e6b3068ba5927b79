"""Tell what the arrays of the dual of the grid take; imports no Warp, for declarations."""

from dmc_cli.methods import Cost, Memory

BITS = Cost(word=10, near=4)
"""Inside and active bits, a sixteenth of eight sums; a rank. Cells are a part of the placement."""

RANKS = Cost(near=16)
"""The quads' ranks: three bits per node and a number per word."""

DUAL = Memory(cells=BITS, connecting=BITS + RANKS + Cost(vertex=4))
"""While vertices get their halfedges, keys of these, too."""
