"""Describe an image of either version of MINC, and give each slice its slope and intercept.

Stored integers fill a valid range, which stands for the values from image-min to image-max: two numbers for
all, or for each slice. Floating-point values are physical already. Source: the programmer's guide of MINC 1.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, Float64Array
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import check_shape
from dmc_cli.volume_io.minc.world import minc_world

SPACE = {"xspace", "yspace", "zspace"}


@dataclass(frozen=True, kw_only=True)
class MincImage:
    """An image whose values are still in its file.

    Attributes:
        name: The input, for messages.
        axes: Names of the axes, the slowest first.
        shape: Nodes along each.
        dtype: Type of a stored value, with its byte order.
        places: For each axis the attributes of `world.py` that the file has of it.
        valid: The range of stored values, or None where the type's own is meant.
        ends: image-min and image-max.
        ends_axes: The axes along which they differ.
        slabs: Takes a volume's place along the axes before the last three; yields its slices, shape
            (any, ny, nx) each.
    """

    name: str
    axes: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    places: tuple[Mapping[str, Any], ...]
    valid: Sequence[float] | None
    ends: tuple[AnyArray, AnyArray]
    ends_axes: tuple[str, ...]
    slabs: Callable[[tuple[int, ...]], Iterator[AnyArray]]

    @property
    def volumes(self) -> tuple[int, ...]:
        """Return how many volumes there are along each axis before the last three."""
        return self.shape[:-3]

    def nodes(self) -> tuple[int, int, int]:
        """Return the nodes along the fastest axis, the one before, and the third last.

        Raises:
            UnsupportedFormatError: The last three axes are not x, y and z in any order.
            VolumeError: A layer of less than two nodes.
        """
        is_spatial = {*self.axes[-3:]} == SPACE and not SPACE & {*self.axes[:-3]}
        if not is_spatial or len(self.axes) != len(self.shape):
            raise UnsupportedFormatError(
                f"{self.name}: axes {', '.join(self.axes)} found; expected xspace, yspace and zspace as the "
                "last three; reorder them with mincreshape"
            )
        nx, ny, nz = self.shape[:-4:-1]
        check_shape(self.name, (nx, ny, nz))
        return nx, ny, nz

    def world(self, settings: ReadSettings) -> tuple[Float64Array, tuple[Notice, ...]]:
        """Return the affine of indices whose first one is the fastest, shape (4, 4), in mm, and what is told.

        Raises:
            UnsupportedFormatError: Units that differ, or of time.
        """
        axes = list(zip(self.axes, self.places, strict=True))[:-4:-1]
        return minc_world(axes, settings, self.name)

    def scales(self, place: tuple[int, ...]) -> Float64Array:
        """Return slope and intercept of each slice of a volume, shape (nz, 2).

        Raises:
            DamagedVolumeError: The valid range is empty, or image-min and image-max do not fit the image.
        """
        if self.dtype.kind == "f":
            return np.tile([1.0, 0.0], (self.shape[-3], 1))
        outer = self.shape[:-2]
        low, high = self.valid_range()
        count = len(self.ends_axes)
        if self.ends_axes != self.axes[:count] or any(end.shape != outer[:count] for end in self.ends):
            raise DamagedVolumeError(
                f"{self.name}: image-min and image-max of {self.ends[0].shape} and {self.ends[1].shape} "
                f"numbers along {', '.join(self.ends_axes) or 'no axis'} found; expected them along the "
                f"first of {', '.join(self.axes[:-2])}; the file is damaged"
            )
        with np.errstate(all="ignore"):  # what is not finite is refused with the slices
            least, most = (
                np.broadcast_to(
                    np.asarray(end, float).reshape(end.shape + (1,) * (len(outer) - count)), outer
                )[place]
                for end in self.ends
            )
            slopes = (most - least) / (high - low)
            return np.column_stack((slopes, least - low * slopes))

    def valid_range(self) -> tuple[float, float]:
        """Return the smallest and the largest stored value that integers have.

        Raises:
            DamagedVolumeError: It is no range of the type's.
        """
        info = np.iinfo(self.dtype)
        low, high = (info.min, info.max) if self.valid is None else map(float, self.valid)
        if not info.min <= low < high <= info.max:
            raise DamagedVolumeError(
                f"{self.name}: a valid range from {low:g} to {high:g} found for {self.dtype.name}; expected "
                f"one within {info.min} to {info.max}; the file is damaged"
            )
        return low, high

    def clipped(self, slabs: Iterator[AnyArray]) -> Iterator[AnyArray]:
        """Yield slices with what is outside the valid range put to its ends, as nibabel does."""
        if self.dtype.kind == "f":
            yield from slabs
            return
        low, high = self.valid_range()
        info = np.iinfo(self.dtype)
        for slab in slabs:
            if low > info.min or high < info.max:
                yield np.clip(slab, math.ceil(low), math.floor(high))
            else:
                yield slab
