"""Write and read the input files of Abaqus, which CalculiX and others read: keywords, then rows of numbers.

keywords  the keywords of a file, with what stands behind them
kinds     the elements that are faces
sets      sets of elements
writer    a mesh as chunks of bytes
reader    the mesh of a file: all parts, where their instances lie, with their sets
groups    sets and instances as groups
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
