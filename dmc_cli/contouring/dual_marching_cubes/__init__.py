"""Contour by dual marching cubes (Grosso & Zint 2020, 2021); each file below those that it needs.

declaration       what the registry tells of the method, without Warp
cells             active cells, ordinary and special, and their numbers
special_cells     the cells with more than one polygon, or at a border
polygon_vertices  from polygons to vertices
manifold_repair   face flips that make the mesh manifold
polygons          decide, trace, number, flip: the special cells' stage
placement/        one vertex per polygon, on the surface or as the papers have it
vertices          vertices of all cells
quads             one quad a crossed edge
numbering         what the stages number, for those that follow
flips             where a face was flipped
extraction        the stages in order
halfedges/        the halfedge structure, from the grid
kernels           the modules with kernels that a run needs
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
