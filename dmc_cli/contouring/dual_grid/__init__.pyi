# What methods of contouring use of this folder; `__init__.py` says what it is for.

from .cell_twins import connect_dual as connect_dual
from .costs import DUAL as DUAL
from .extraction import (
    CellContext as CellContext,
    CellVertices as CellVertices,
    PlaceCells as PlaceCells,
    extract_dual as extract_dual,
)
from .kernels import connecting_dual_kernels as connecting_dual_kernels, dual_kernels as dual_kernels
