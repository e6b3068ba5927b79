"""Define the scalar field: a grid of stored values, and between its nodes a function, zero on the surface.

grid                 numbering of nodes, cells, edges and faces; from grid to world
planes               one bit per node or cell, in words
lanes                sixteen numbers side by side, in C++
lane_vectors         sixteen vectors side by side, in C++
sample_reader        stored values of whatever type
brick_ranges         least and greatest values of bricks of nodes
trilinear            the interpolant in a cell
field                F: stored values less the isovalue, with sides, borders and missing data
crossings            where a polygon crosses the edges of its cell
slices               unevenly spaced slices
simd_cells           sixteen cells at a time, on CPU
cell_lanes           the corners of sixteen cells, and sixteen points of the world
cell_lists           the cells of a block of words
central_differences  slopes of the values in sixteen cells
corner_slopes        slopes at the corners of any cell, beside missing nodes too
prefetch             values asked for ahead of their use
projection           the nearest point of the surface
kernels              its modules with kernels
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
