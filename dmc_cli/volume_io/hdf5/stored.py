"""Hold what an HDF5 file says of a dataset, and the datasets that make one image together."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.notices import Notice
from dmc_cli.volume import Space
from dmc_cli.volume_io.axes import Image
from dmc_cli.volume_io.layout import Triple

Where = tuple[int | None, ...]
"""A volume's place along each axis of an image; None for those of its grid."""


@dataclass(frozen=True)
class HdfGeometry:
    """What a file says of a dataset.

    Attributes:
        image: Its axes.
        spacing: Distances along x, y, z in mm, or None where they are not told.
        origin: Place of the first node in mm, or None.
        directions: Shape (3, 3): columns are the axes x, y, z in the world.
        space: The world's axes.
        notices: What is not used.
        doubts: What is told of the lengths that are taken, of which `--spacing` tells better.
        unsettled: What is told of lengths that are not used, and that options give.
        dtype: What the values are, where they are stored as something else of the same size.
        scale: Slope, intercept and what is told of them, where something else than attributes of CF tells.
    """

    image: Image
    spacing: Triple | None = None
    origin: Triple | None = None
    directions: Float64Array | None = None
    space: Space = "none"
    notices: tuple[Notice, ...] = ()
    doubts: tuple[Notice, ...] = ()
    unsettled: tuple[Notice, ...] = ()
    dtype: np.dtype[Any] | None = None
    scale: tuple[float, float, tuple[Notice, ...]] | None = None


@dataclass(frozen=True)
class Stored:
    """An image of a file, of one dataset or of several.

    Attributes:
        image: Its axes.
        find: Returns for a volume's place its dataset, the place in this, and what the file says of it.
    """

    image: Image
    find: Callable[[Where], tuple[Any, Where, HdfGeometry]]


def stored_alone(dataset: Any, geometry: HdfGeometry) -> Stored:
    """Return the image of one dataset."""
    return Stored(geometry.image, lambda where: (dataset, where, geometry))
