"""Read and write meshes in files, one file or folder per format; NumPy only, never Warp.

mesh_file      a mesh as readers return it and writers take it
text           numbers as text, fast
numbers        numbers out of text
parsed         what was read, checked
grouping       faces of a file in its groups
joined         meshes of a scene as one
selection      some faces of a mesh, or all turned round
triangles      quads split into triangles
numbered       nodes, elements and parts as solvers have them
meshio_file    what meshio reads
obj_parts      parts and materials of an OBJ file
ply/, vtk/, glb/, obj, off, stl, three_mf  meshes as chunks of bytes, and out of files
gmsh/, abaqus/, nastran, ls_dyna, medit, xdmf  likewise, for solvers
patient        coordinates of formats that have one space
gifti, freesurfer  likewise, for neuroimaging
usd            likewise, for films and engines
halfedge_numbers  next and previous in NumPy
halfedge_dump  halfedge structures as chunks of bytes
write          a mesh to a file, whole or not at all
read           a mesh from a file of any format
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
