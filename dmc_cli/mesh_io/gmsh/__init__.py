"""Write and read the format of Gmsh: sections between `$Name` and `$EndName`, binary or text.

sections  the sections of a file, and the numbers in one
kinds     Gmsh's numbers of kinds of elements
blocks    nodes and elements of the versions 2 and 4
groups    physical groups
writer    a mesh as chunks of bytes, version 4.1
reader    the mesh of a file, with its values
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
