# What the rest of `volume_io/` uses of this format.

from .reader import nrrd_layout as nrrd_layout
