"""Hold the numbers of vertices and quads along the grid, by which halfedges and colours are found."""

from dataclasses import dataclass
from typing import Any

from dmc_cli.contouring.dual_marching_cubes.cells import Cells
from dmc_cli.contouring.dual_marching_cubes.polygons import Polygons


@dataclass(frozen=True)
class Numbering:
    """Numbers of vertices and quads, as ranks.

    Attributes:
        cells: Active cells and their numbers.
        polygons: The special cells' polygons.
        quad_starts: Quads before each block of words (`words.py`), int64, one item more than blocks.
        is_reversed: Whether normals point towards the inside nodes.
        quad_words: The quads' ranks, as `rank_quads` returns them; None before the faces are connected.
    """

    cells: Cells
    polygons: Polygons
    quad_starts: Any
    is_reversed: bool
    quad_words: Any | None = None
