"""Contour by dual marching cubes (Grosso & Zint 2020, 2021); each file below those that it needs.

classification    inside bits: the one pass over the values
nodata_cells      what nodes without data take away
cells             active cells, ordinary and special, and their numbers
tracing           the polygons of one cell, followed from face to face
special_cells     the cells with more than one polygon, or at a border
polygon_vertices  from polygons to vertices
manifold_repair   face flips that make the mesh manifold
polygons          decide, trace, number, flip: the special cells' stage
placement/        one vertex a polygon, on the surface or as the papers have it
vertices          vertices of all cells
plain_quads       quads where all cells are ordinary
quads             one quad a crossed edge
numbering         what the stages number, for those that follow
extraction        the stages in order
halfedges/        the halfedge structure, from the grid
color_words       colours of the quads of whole rows
coloring          colours of quads
"""

from types import ModuleType

from dmc_cli.contouring.dual_marching_cubes.extraction import extract
from dmc_cli.contouring.surface import Surface
from dmc_cli.settings import PlacementRule

__all__ = ["color", "connect", "extract", "kernels", "mesh_kernels"]


def connect(surface: Surface) -> Surface:
    """Return the surface with halfedges; imported when it is first wanted, like `color`."""
    from dmc_cli.contouring.dual_marching_cubes.halfedges.connect import connect

    return connect(surface)


def color(surface: Surface) -> Surface:
    """Return the connected surface with colours of its quads."""
    from dmc_cli.contouring.dual_marching_cubes.coloring import color

    return color(surface)


def mesh_kernels(*, colors: bool) -> list[ModuleType]:
    """Return the modules whose kernels halfedges need, and those of colours if they are wanted."""
    from dmc_cli.contouring.dual_marching_cubes.halfedges import grid_twins, quad_ranks, vertex_rings

    modules = [quad_ranks, grid_twins, vertex_rings]
    if colors:
        from dmc_cli.contouring.dual_marching_cubes import coloring

        modules.append(coloring)
    return modules


def kernels(placement: PlacementRule) -> list[ModuleType]:
    """Return the modules whose kernels a surface needs, those that take longest to compile first."""
    from dmc_cli.contouring.dual_marching_cubes import (
        cells,
        classification,
        manifold_repair,
        polygons,
        quads,
        vertices,
    )
    from dmc_cli.contouring.dual_marching_cubes.placement import exact_scalar, exact_simd, paper
    from dmc_cli.field import slice_kernels

    placing = [exact_simd, exact_scalar] if placement == "exact" else [paper]
    return [classification, cells, polygons, manifold_repair, vertices, *placing, quads, *slice_kernels()]
