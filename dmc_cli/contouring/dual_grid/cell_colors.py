"""Colour the quads of a connected surface, as dual marching cubes does: by their grid edges.

Neighbours go round two edges of one cell face, whichever of these a face with four crossed edges pairs.
"""

from dataclasses import replace

from dmc_cli.contouring.stages.coloring import color
from dmc_cli.contouring.stages.numbering import numbering_of
from dmc_cli.contouring.stages.quad_ranks import rank_quads
from dmc_cli.contouring.surface import Surface


def color_cells(surface: Surface) -> Surface:
    """Return a connected surface with the colours of its quads, uint8 (Q,): 24 from the grid, and 5."""
    numbering, grid = numbering_of(surface), surface.placement.frame.grid
    words = rank_quads(numbering.cells, grid, numbering.quad_starts, surface.mesh.device)
    return color(replace(surface, numbering=replace(numbering, quad_words=words)))
