"""Write and read GLB, the binary form of glTF 2.0: triangles that say which of them make a quad.

ngons   the order of triangles that says so (extension FB_ngon_encoding)
writer  a mesh as chunks of bytes
reader  the mesh of a file's scene
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
