"""Change a mesh by algorithms, a folder each.

color_repair      different colours for quads that have become neighbours
distance_guard    points of the mesh before that the new one must not leave behind
quad_square       a quad's area, and how far it is from a square
quad_lanes        the same of sixteen quads side by side, in C++
tangent_step      a vertex's step along the surface
surface_distance  how far points are from the surface
patterns/         quads removed where valences have a pattern: 3-X-3-Y, 3-3-3-3 (Grosso & Zint 2021)
relaxation/       vertices smoothed on the surface
remeshing/        irregular vertices removed by local operations
intersection_repair  faces that intersect, pulled apart
decimation/       quads taken away until a wanted number is left
kernels           the modules with kernels that the stages need
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
