"""Make a surface mesh of a volume. A method is a folder, and a line of `methods.py`.

surface               what a method returns
stages/               what several methods have: inside bits, polygons of a cell, decisions on faces
marching_cubes/       triangles, their vertices on the grid's edges (Lorensen & Cline 1987)
topological_marching_cubes/  the same with the trilinear interpolant's topology (Grosso 2016, 2017)
macet/                marching cubes with vertices moved along the surface (after Dietrich et al. 2009)
dual_grid/            a vertex in each active cell, a quad round each crossed edge
dual_marching_cubes/  quads only, one vertex per polygon (Grosso & Zint 2021)
dual_contouring/      the dual of the grid, vertices by planes through their crossings
surface_nets/         the dual of the grid, vertices at the mean of their crossings
label_surfaces/       shells of a label map's labels, smooth without shrinking
extraction            a volume and its settings to a surface, by whichever method
vertex_colors         colours of vertices by the parity of their cells
kernels               the modules with kernels that a run needs
normals               vertex normals by central differences, whatever the method
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
