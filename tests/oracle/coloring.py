"""Colours of the quads (section 3.1.4): 24 from the grid, reduced to 5.

A quad's colour is 3 * parity + axis, where parity is (i & 1) | (j & 1) << 1 | (k & 1) << 2 of the lower
node of its grid edge (in the padded grid, if the border is closed). Neighbours across a twin differ.
"""

import numpy as np

from tests.oracle.halfedges import NO_TWIN
from tests.oracle.quads import GridEdge

COLORS = 24
REDUCED = 5


def grid_color(edge: GridEdge) -> int:
    """One of 24 colours for a grid edge and so for its quad."""
    axis, i, j, k = edge
    return 3 * ((i & 1) | (j & 1) << 1 | (k & 1) << 2) + axis


def reduce_colors(colors: np.ndarray, twins: np.ndarray) -> np.ndarray:
    """Reduce 24 colours to 5: classes 5 to 23 in turn take the first of 0 to 4 free among the neighbours.

    Afterwards the quads of colour 4 retry 0 to 3. Quads of one class are never neighbours, so their
    order within a class does not matter.
    """
    reduced = [int(color) for color in colors]
    for color in range(REDUCED, COLORS):
        for q in np.flatnonzero(colors == color):
            reduced[q] = first_free(neighbor_colors(q, reduced, twins), REDUCED)
    for q in [q for q, color in enumerate(reduced) if color == REDUCED - 1]:
        reduced[q] = first_free(neighbor_colors(q, reduced, twins), REDUCED)
    return np.array(reduced, dtype=np.uint8)


def neighbor_colors(q: int, colors: list[int], twins: np.ndarray) -> set[int]:
    """The colours of the up to four quads across a quad's twins."""
    across = (int(twins[4 * q + c]) for c in range(4))
    return {colors[twin // 4] for twin in across if twin != NO_TWIN}


def first_free(taken: set[int], count: int) -> int:
    """The lowest colour below `count` that is not taken."""
    return next(color for color in range(count) if color not in taken)
