"""Read Zarr and OME-Zarr; `store` is the way in.

metadata  what a store says of an array, read once
codecs    the bytes of a chunk, unpacked
chunks    all chunks of an array, put together
stored    an array, and what it is
ome, plain  OME images; other arrays, by their names, places and attributes
images    the images of a store
store     the volume of a store
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
