"""Number the halfedges of faces in rows of four: as `mesh/halfedges.py` does, in NumPy."""

import numpy as np

from dmc_cli.array_types import IntArray
from dmc_cli.mesh_io.mesh_file import NO_CORNER


def next_in_quads(h: IntArray) -> IntArray:
    """Return the halfedge after each of `h` in its quad."""
    following: IntArray = (h & ~3) | ((h + 1) & 3)
    return following


def next_halfedges(corners: IntArray, h: IntArray) -> IntArray:
    """Return the halfedge after each of `h` in its face; `corners` are the vertices of all corners, (4F,)."""
    following = next_in_quads(h)
    return np.where(corners[following] == NO_CORNER, h & ~3, following)


def previous_halfedges(corners: IntArray, h: IntArray) -> IntArray:
    """Return the halfedge before each of `h` in its face; `corners` as of `next_halfedges`."""
    preceding: IntArray = (h & ~3) | ((h + 3) & 3)
    return np.where(corners[preceding] == NO_CORNER, preceding - 1, preceding)
