"""Read NRRD; `reader` is the way in.

header    the fields of a header
labels    what it calls its axes
segments  what 3D Slicer calls its segments
geometry  where they put the grid
reader    the volume that they describe
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
