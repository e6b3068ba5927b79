"""Meshes in files, a format a file; NumPy only, never Warp.

formats        the formats that there are, and where their functions are
mesh_file      a mesh as writers take it
text           numbers as text, fast
ply, obj, off  meshes as chunks of bytes
halfedge_dump  halfedge structures likewise
write          a mesh to a file, whole or not at all
numbers, read_ply, read_obj, read_off  meshes out of files
read           a mesh from a file of any format
mesh_input     what was read, checked
"""
