"""Measure any mesh.

topology          Euler characteristic, boundaries, manifoldness
components        connected components
component_list    faces, area, volume and bounds of each
vertex_fans       the fans of faces round vertices
shape             areas, angles, how square
quality           the measures of the papers
verdict           Verdict's measures of a face
elements          these of a mesh
lists             measures of each face and vertex
predicates        exact signs; whether two triangles meet
intersections     pairs of faces that intersect
split_faces       how quads are split into triangles
sampling          points spread over a mesh
nearest           how far points are from a mesh
distance          how far two meshes are from each other
proximity         a bound of that, proven of every point
thickness         how thick walls are at the vertices
curvature         mean and Gaussian curvature at the vertices
deviation         how far vertices are from the surface
location          the cell of its volume that each vertex lies in
rounding          what writing in float32 costs
rounding_kernels  its kernels
plain_values      numbers as JSON has them
kernels           the modules with kernels
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
