# What the rest of `volume_io/` uses of this format.

from .reader import minc_entries as minc_entries, minc_volume as minc_volume
