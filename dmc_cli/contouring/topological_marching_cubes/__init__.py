"""Contour by marching cubes with the topology of the trilinear interpolant (Grosso 2016, 2017).

declaration       what the registry tells of the method, without Warp
trilinear_roots   the straight lines in the surface of a cell
cell_contours     the polygons of a cell whose faces are decided
trilinear_cells   the triangles of a special cell: tunnels, discs, inner vertices
tunnels           where the surface has a tunnel inside a cell
extraction        the stages in order; those that are shared are in `stages/`
kernels           the modules with kernels that a run needs
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
