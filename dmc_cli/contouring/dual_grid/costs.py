"""Tell what the arrays of the dual of the grid take; imports no Warp, for declarations."""

from dmc_cli.methods import Cost, Memory

CELLS = Memory(cells=Cost(word=10, near=4))
"""Inside and active bits, a sixteenth of eight sums; a rank. Cells are a part of the placement."""
