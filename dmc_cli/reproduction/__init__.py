"""Make the papers' tables again.

paper_values   what a printed figure is
schmitz_table  what Schmitz et al. 2009 print
paper_tables   what the papers print, all of it
diagonals      quads split as the papers do
reproduce      their tables, ours beside them
scans          the scans of 2009, where the user has them
reproduce_run  their meshes, made and measured
spreads        what their figures show
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
