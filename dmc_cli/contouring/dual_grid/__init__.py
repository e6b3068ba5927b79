"""Make the dual of the grid: a vertex in each active cell, a quad round each crossed edge.

It is the mesh of surface nets and of dual contouring, which differ in where a vertex lies. Each file below
those that it needs.

active_cells  active cells, and their vertices' numbers
cell_quads    one quad a crossed edge
extraction    the stages in order, with a method's own way to place vertices
cell_twins    halfedges, from the grid
costs         what it all takes
kernels       the modules with kernels that a run needs
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
