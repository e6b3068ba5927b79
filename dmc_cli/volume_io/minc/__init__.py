"""MINC 1 (netCDF) and 2 (HDF5); `reader.py` is the way in."""
