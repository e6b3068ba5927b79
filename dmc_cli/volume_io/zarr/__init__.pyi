# What the rest of `volume_io/` uses of this format.

from .store import is_zarr as is_zarr, zarr_entries as zarr_entries, zarr_volume as zarr_volume
