"""Read MINC 1 (netCDF) and 2 (HDF5); `reader` is the way in.

world   where the grid lies: step, start and cosines of its axes
image   an image of either version, its values still in the file
netcdf  version 1, by nibabel
hdf     version 2, by h5py and nibabel
reader  the volume of an image
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
