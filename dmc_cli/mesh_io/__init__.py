"""Read and write meshes in files, a format a file; NumPy only, never Warp.

mesh_file      a mesh as readers return it and writers take it
formats        the formats that there are, and where their functions are
text           numbers as text, fast
ply_properties  how PLY files name and type what a vertex or a face has
ply, obj, off  meshes as chunks of bytes
halfedge_numbers  next and previous in NumPy
halfedge_dump  halfedge structures likewise
write          a mesh to a file, whole or not at all
numbers        numbers out of text
parsed         what was read, checked
ply_header     what a PLY file says that it has
ply_items      vertices and faces out of its text or bytes
read_ply, read_obj, read_off  meshes out of files
read           a mesh from a file of any format
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
