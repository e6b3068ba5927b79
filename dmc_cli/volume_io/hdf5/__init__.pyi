# What other folders use of this one; `__init__.py` says what it is for.

from .reader import hdf5_entries as hdf5_entries, hdf5_volume as hdf5_volume
