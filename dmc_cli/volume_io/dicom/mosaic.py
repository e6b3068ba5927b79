"""Take mosaics apart: images of Siemens whose tiles are the slices of a volume, row by row.

How many tiles are slices and to which side they follow each other is in elements of the maker's own; the
position is that of the corner of an image as large as the mosaic, whose middle is that of the first slice.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.csa import csa_values, read_again
from dmc_cli.volume_io.dicom.elements import Header
from dmc_cli.volume_io.dicom.increments import Increments
from dmc_cli.volume_io.dicom.makers import BLOCKS, SIEMENS, SIEMENS_GROUP
from dmc_cli.volume_io.dicom.place import NoSlice, Place, unit_directions
from dmc_cli.volume_io.dicom.storage import Pixels

SLICE_COUNT = 0x0A
"""The number of slices, in a block of `SIEMENS`."""

PARALLEL = 0.99
"""Least product of the normal that the maker tells and that of the directions, of length 1 each."""


def is_mosaic(dataset: Any) -> bool:
    """Return whether an image is made of slices side by side."""
    return "MOSAIC" in elements.texts(dataset, 0x00080008)


def read_mosaic(header: Header, image: Pixels) -> tuple[Pixels, Increments]:
    """Return how the slices of a mosaic are stored, and how they follow each other.

    Args:
        header: Its header.
        image: How it is stored as one image.

    Raises:
        NoSlice: The file does not tell how its tiles lie.
        DamagedVolumeError: What it tells cannot be.
    """
    values = csa_values(header)
    count = _slice_count(header) or int((values.get("NumberOfImagesInMosaic") or [0])[0] or 0)
    if not count or image.frames > 1:
        raise NoSlice("a mosaic of many slices in one image, which does not tell how many (0019,100A)")
    across = math.ceil(math.sqrt(count))
    columns, rows = (size // across for size in image.shape)
    if count < 0 or columns * across != image.shape[0] or rows * across != image.shape[1]:
        raise DamagedVolumeError(
            f"{header.file.name}: a mosaic of {image.shape[0]} x {image.shape[1]} pixels found; expected a "
            f"multiple of {across} for its {count} slices; get the file again"
        )
    step = _step(header, values.get("SliceNormalVector"))
    pixels = replace(image, shape=(columns, rows), frames=count, whole=image)
    return pixels, Increments([step * n for n in range(count)], list(range(count)), [{}] * count)


def _slice_count(header: Header) -> int:
    """Return how many slices a mosaic has; 0 where it does not tell."""
    owners = {block: SIEMENS_GROUP << 16 | block for block in BLOCKS}
    counts = {block: SIEMENS_GROUP << 16 | block << 8 | SLICE_COUNT for block in BLOCKS}
    found = read_again(header, [*owners.values(), *counts.values()])
    own = [block for block in BLOCKS if elements.text(found, owners[block]) == SIEMENS]
    return elements.integer(found, counts[own[0]], 0) or 0 if own else 0


def _step(header: Header, told: list[Any] | None) -> float:
    """Return the distance of slices, negative where they follow each other against the normal."""
    place = Place(header.dataset, None, None)
    step = place.step()
    cosines = elements.numbers(header.dataset, 0x00200037, 6)
    if not step or cosines is None or told is None or len(told) != 3:
        lacking = "SpacingBetweenSlices" if not step else "a direction" if told else "SliceNormalVector"
        raise NoSlice(
            f"a mosaic of many slices in one image, which does not tell how they lie: {lacking} is missing"
        )
    directions, _ = unit_directions(tuple(cosines))
    product = float(np.cross(directions[:3], directions[3:]) @ np.array(told, float))
    if not PARALLEL <= abs(product) <= 1 / PARALLEL:
        raise DamagedVolumeError(
            f"{header.file.name}: a mosaic whose SliceNormalVector {told} is no normal of its directions "
            "found; get the file again"
        )
    return math.copysign(step, product)


def corner_of_tile(
    position: tuple[float, ...], orientation: tuple[float, ...], spacing: tuple[float, float], pixels: Pixels
) -> tuple[float, ...]:
    """Return where the first node of a mosaic's slice lies, from what the file tells of the whole image."""
    assert pixels.whole is not None
    x, y = (
        (whole - own) / 2 * length
        for whole, own, length in zip(pixels.whole.shape, pixels.shape, spacing, strict=True)
    )
    directions = np.array(orientation)
    moved = np.array(position) + x * directions[:3] + y * directions[3:]
    return tuple(moved.tolist())


def tiles_of(image: AnyArray, indices: list[int], pixels: Pixels) -> Iterator[AnyArray]:
    """Yield the slices of a mosaic by their numbers, views of the image."""
    columns, rows = pixels.shape
    across = image.shape[1] // columns
    for index in indices:
        row, column = divmod(index, across)
        yield image[row * rows : (row + 1) * rows, column * columns : (column + 1) * columns]
