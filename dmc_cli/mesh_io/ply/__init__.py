"""Write and read PLY, the Stanford polygon format, with values of vertices and faces.

properties  how the files name and type what a vertex or a face has
writer      a mesh as chunks of bytes
header      what a file says that it has
items       vertices and faces out of its text or bytes
reader      the mesh that they make
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
