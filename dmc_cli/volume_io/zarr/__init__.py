"""Read Zarr and OME-Zarr; `store` is the way in.

metadata  what a store says of an array, read once
codecs    the bytes of a chunk, unpacked
chunks    all chunks of an array, put together
store     the volume of a store
"""
