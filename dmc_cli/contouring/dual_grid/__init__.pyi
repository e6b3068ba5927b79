# What methods of contouring use of this folder; `__init__.py` says what it is for.

from .cell_colors import color_cells as color_cells
from .costs import CELLS as CELLS
from .extraction import (
    CellContext as CellContext,
    CellVertices as CellVertices,
    PlaceCells as PlaceCells,
    extract_dual as extract_dual,
)
from .kernels import color_kernels as color_kernels, dual_kernels as dual_kernels
