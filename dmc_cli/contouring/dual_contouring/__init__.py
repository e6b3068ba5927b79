"""Contour by dual contouring (Ju et al. 2002) of a uniform grid: the dual of the grid, sharp edges kept.

A vertex in each active cell by the planes that touch the surface at the cell's crossings, a quad round each
crossed edge. Each file below those that it needs.

declaration       what the registry tells of the method, without Warp
corner_gradients  central differences at the corners of cells
symmetric_matrix  eigenvalues, and the least point of a sum of squares
cell_planes       the planes at a cell's crossings, summed: points of the least error, and particles
single_cells      vertices of cells that are read one by one
placement         all vertices, sixteen at a time
double_planes     the same of one cell in double precision
paper             vertices as the paper of 2021 has them
hermite_data      crossings and normals of a field that is known
exact_gradients   vertices by the exact normals of a field that is known
extraction        the stages in order
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
