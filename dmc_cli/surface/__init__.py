"""The isosurface: from stored values to vertices and quads, each file below those that it needs.

grid        numbering of nodes, cells, edges and faces; one bit a node
words       words of bits in one line, sixteen at a time
bit_lists   lists of the set bits of words
marks       marks, a byte an item, 32 of them at a glance
trilinear   the interpolant in a cell
stored      stored values of whatever type: the readers of the volume
field       the scalar field F whose zero set is the surface
inside      inside bits: the one pass over the values
absent_cells   what nodes without data take away
cells       active cells, ordinary and special, and their numbers
tracing     the polygons of one cell, followed from face to face
special_cells   the cells with more than one polygon, or at a border
fans        from polygons to vertices
flips       face flips that make the mesh manifold
polygons    decide, trace, number, flip: the special cells' stage
crossings   where a polygon crosses its cell's edges: their mean, their box
placement   one vertex a polygon on the trilinear surface
placement_sampled, placement_iterative   one vertex a polygon as the papers place it
lanes       sixteen vertices at a time, on CPU
blocks      exact vertices on CPU, sixteen at a time
exact_vertices   those that are left, and all on a GPU, one by one
paper_vertices   vertices of all cells by the papers' placements
vertices    vertices of all cells, by whichever placement
plain_quads   quads where all cells are ordinary
quads       one quad a crossed edge
slices      unevenly spaced slices: vertices mapped by a table of positions
surface     the stages in order
slopes      central differences in sixteen cells
normals     vertex normals by central differences
"""

from types import ModuleType

from dmc_cli.settings import Placement
from dmc_cli.surface import (
    blocks,
    cells,
    exact_vertices,
    flips,
    inside,
    normals,
    paper_vertices,
    polygons,
    quads,
    slices,
    vertices,
)
from dmc_cli.surface.field import DeviceVolume, upload_volume
from dmc_cli.surface.normals import compute_normals
from dmc_cli.surface.surface import Surface, SurfaceCounts, extract_surface

__all__ = [
    "DeviceVolume",
    "Surface",
    "SurfaceCounts",
    "compute_normals",
    "extract_surface",
    "kernel_modules",
    "upload_volume",
]


def kernel_modules(*, normals_too: bool = True, placement: Placement = "exact") -> list[ModuleType]:
    """Return the modules whose kernels a surface needs, for loading them ahead of time.

    The one that takes longest to compile comes first, so that it is not the last to be ready.
    """
    placing = [blocks, exact_vertices] if placement == "exact" else [paper_vertices]
    modules = [inside, cells, polygons, flips, vertices, *placing, quads, slices]
    return [normals, *modules] if normals_too else modules
