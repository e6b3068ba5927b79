"""Zarr and OME-Zarr; `store.py` is the way in."""
