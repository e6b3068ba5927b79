"""Read TIFF, OME-TIFF and ImageJ; `reader` is the way in.

ome       what OME metadata promise, checked
ome_set   a folder with one OME-TIFF of several files
dialects  distances of the nodes in the tags of microscopes and other programs
spacing   distances of the nodes, as the surest of a file's metadata tells them
imagej    its origin and its calibration of values
pages     what is told of pages: previews, how they are to be shown
stack     the volumes of a file with many pages, and the planes of one
reader    the volume of a stack of pages or of files
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
