# What the rest of `volume_io/` uses of this format.

from .reader import tiff_entries as tiff_entries, tiff_volume as tiff_volume
