"""Read datasets of HDF5 and NeXus files, and images that ITK wrote as HDF5; `reader` is the way in.

dataset   which dataset of a file is meant
named_axes  what a file calls the axes of its dataset
imaris   what an Imaris file says of a dataset
geometry  what a file says of its dataset's axes, lengths and units
reader    the volume of a dataset
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
