"""Hold a mesh, whoever made it: vertices, faces, how they join, and where the vertices lie.

halfedges        how faces join; the walk round a vertex
mesh             the one type of meshes
array_checks     what a program hands over as one
mesh_files       meshes of files, and back
placement        where vertices lie on the surface that they were cut from
twins            pairs of halfedges, by vertices
connectivity     halfedges of any mesh
box_tree         which faces are near something
defects          quads that simplification leaves alone
valences         the share of irregular vertices
normals          normals of faces and vertices, from the mesh alone
working          a mesh while faces go and come
compaction       renumbering without what has gone
near_frame       the frame in which a mesh far from the origin is changed
check            invariants of a finished mesh
check_halfedges  invariants of a halfedge structure
kernels          its modules with kernels
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
