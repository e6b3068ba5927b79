"""Meshes to files: one format a file, all of them complete or not there at all.

A format's module turns a `MeshFile` into chunks of bytes and knows nothing of files; `atomic` puts
chunks into a file and knows nothing of formats; `write` joins the two. NumPy only, never Warp.
"""
