"""Hold an array of a Zarr store and what it is: its axes, and how far apart its nodes are."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.volume_io.axes import Image
from dmc_cli.volume_io.layout import Triple, check_lengths
from dmc_cli.volume_io.lengths import Doubts, missing_spacing
from dmc_cli.volume_io.loose_lengths import Told
from dmc_cli.volume_io.units import scales_in_mm
from dmc_cli.volume_io.zarr.metadata import ZarrArray


@dataclass(frozen=True)
class StoredImage:
    """An array of a store, and what it is.

    Attributes:
        folder: The array's own folder.
        array: Its metadata.
        image: Its axes and its title.
        scale: Distance of the nodes along each axis in its unit, or None where nothing tells it.
        shift: Place of the first node along each axis, likewise.
        units: The axes' units as the metadata spell them, None for one without.
        plain: Of an array that is no OME image: what its names, places and attributes tell.
    """

    folder: Path
    array: ZarrArray
    image: Image
    scale: Float64Array | None = None
    shift: Float64Array | None = None
    units: tuple[str | None, ...] = ()
    plain: Told = (None, None, ())

    def placed(self, name: str) -> tuple[Triple | None, Triple | None, Doubts]:
        """Return spacing and origin in millimetres along x, y, z, None where they are not told, and doubts.

        Raises:
            UnsupportedFormatError: An axis of space is measured in units of time.
            DamagedVolumeError: Lengths that are not positive.
        """
        assert self.image.grid is not None
        order = list(self.image.grid[::-1])
        units = [self.units[axis] if self.units else None for axis in order]
        if self.scale is None and units == [None] * 3:
            return self.plain[0], self.plain[1], ()
        scales, doubts = scales_in_mm(units, name, "the store")
        if self.scale is None:
            doubts = (*missing_spacing(dict(zip("xyz", scales, strict=True)), "the store"), *doubts)
        scale = np.ones(len(self.units)) if self.scale is None else self.scale
        shift = np.zeros(len(self.units)) if self.shift is None else self.shift
        with np.errstate(all="ignore"):  # what is not finite is refused with the lengths
            (x, y, z), (p, q, r) = ((lengths[order] * scales).tolist() for lengths in (scale, shift))
        check_lengths(name, (x, y, z))
        return (x, y, z), (p, q, r), doubts
