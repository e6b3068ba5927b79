"""Find what the stored values of an image mean: by rescale, lookup table or dose scaling.

A Modality LUT takes the place of the rescale where a file has both (PS3.3, C.11.1). Maps to real-world values
and the standardised uptake of PET depend on more than the image, and are told only.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, Float32Array
from dmc_cli.errors import DamagedVolumeError
from dmc_cli.notices import Notice
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.place import Place

AXIAL = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
SAME_HEIGHT_MM = 0.01

MOST_ENTRIES = 1 << 16
"""Entries of a lookup table whose descriptor says 0: 16 bits do not hold their number."""


@dataclass(frozen=True, eq=False)
class Lookup:
    """A table from stored to physical values.

    Attributes:
        first: The stored value of the first entry; smaller ones have its value, too.
        values: Physical values, float32, shape (entries,); stored values beyond them have the last one.
    """

    first: int
    values: Float32Array

    def __call__(self, stored: AnyArray) -> Float32Array:
        """Return the physical values of stored integers, in the same shape."""
        entries = stored.astype(np.int64) - self.first
        found: Float32Array = self.values[entries.clip(0, len(self.values) - 1)]
        return found


def rescale(place: Place) -> tuple[float, float]:
    """Return the slope, 1 where none is told, and the intercept; of a dose grid its scaling.

    A fractional segmentation has its highest value as 1.
    """
    slope = elements.numbers(place.find(0x00289145, 0x00281053), 0x00281053, 1)
    intercept = elements.numbers(place.find(0x00289145, 0x00281052), 0x00281052, 1)
    dose = elements.numbers(place.dataset, 0x3004000E, 1)
    if elements.text(place.dataset, 0x00620001) == "FRACTIONAL":
        most = elements.integer(place.dataset, 0x0062000E)
        return 1 / most if most else 1.0, 0.0
    return (dose or slope or [1.0])[0], (intercept or [0.0])[0]


def lookup(place: Place, signed: bool, known: dict[int, Lookup]) -> Lookup | None:
    """Return a frame's Modality LUT, or None where it has none.

    Args:
        place: Where its elements are.
        signed: Whether stored values have a sign.
        known: Tables of the file that were read before, by the data set that holds them.

    Raises:
        DamagedVolumeError: The table is not what its descriptor says.
    """
    holder = place.find(0x00289145, 0x00283000)
    items = [] if holder is None or id(holder) in known else elements.items(holder, 0x00283000)
    if not items:
        return known.get(id(holder))
    descriptor = elements.numbers(items[0], 0x00283002, 3)
    content = elements.words(items[0], 0x00283006)
    if descriptor is None or content is None:
        raise DamagedVolumeError("a Modality LUT without descriptor or data found; get the file again")
    entries = (int(descriptor[0]) & 0xFFFF) or MOST_ENTRIES
    first = int(descriptor[1]) & 0xFFFF
    if signed and first >= 0x8000:
        first -= 0x10000
    if len(content) == -(-entries // 2) and descriptor[2] <= 8 and entries > 1:
        # two entries a word
        content = content.astype("<u2").view(np.uint8)
    if len(content) < entries:
        raise DamagedVolumeError(
            f"a Modality LUT of {len(content)} entries found, {entries} expected; get the file again"
        )
    known[id(holder)] = Lookup(first, content[:entries].astype(np.float32))
    return known[id(holder)]


def kind_of_values(place: Place) -> str:
    """Return what a frame's values are measured in, as its Modality LUT or its rescale says: HU, US, OD, ...

    Without a word those of CT are HU (PS3.3, C.8.2.1), those of others US, which is unspecified.
    """
    holder = place.find(0x00289145, 0x00283000)
    items = elements.items(holder, 0x00283000)
    holder, tag = (items[0], 0x00283004) if items else (place.find(0x00289145, 0x00281054), 0x00281054)
    is_ct = elements.text(place.dataset, 0x00080060) == "CT"
    return elements.text(holder, tag).upper() or ("HU" if is_ct else "US")


def mapping_told(place: Place, scale: tuple[float, float]) -> list[Notice]:
    """Return a notice on a map to real-world values other than `scale`, slope and intercept of a frame."""
    mapped = _real_world(place)
    if mapped is None or mapped[:2] == scale:
        return []
    slope, intercept, unit = mapped
    return [
        Notice(
            "W-VALUES-MAPPED",
            f"a map to real-world values found ({slope:g} * stored value + {intercept:g}, in "
            f"{unit or 'no unit'}); it is not applied: values are {scale[0]:g} * stored value + {scale[1]:g}",
        )
    ]


def values_told(dataset: Any) -> list[Notice]:
    """Return notices on what a file says of the values of all its frames."""
    told = []
    modality = elements.text(dataset, 0x00080060)
    if modality == "PT":
        unit, decay = elements.text(dataset, 0x00541001), elements.text(dataset, 0x00541102)
        told.append(
            Notice(
                "W-VALUES-MAPPED",
                f"PET values in {unit or 'an unknown unit'} with decay correction {decay or 'unknown'} "
                "found; no standardised uptake (SUV) is computed",
            )
        )
    if modality == "RTDOSE" and elements.numbers(dataset, 0x3004000E, 1) is None:
        told.append(
            Notice("W-RESCALE-UNKNOWN", "a dose without DoseGridScaling found; its stored values are taken")
        )
    if elements.text(dataset, 0x30040002) == "RELATIVE":
        told.append(Notice("W-VALUES-MAPPED", "a relative dose found (DoseUnits); values are no grays"))
    return [*told, *_offsets_told(dataset)]


def _offsets_told(dataset: Any) -> list[Notice]:
    """Return a notice on a dose whose offsets begin with a height of their own (PS3.3, C.8.8.3.2)."""
    grid = elements.numbers(dataset, 0x3004000C)
    position = elements.numbers(dataset, 0x00200032)
    cosines = elements.numbers(dataset, 0x00200037)
    if not grid or not grid[0] or not position or not cosines:
        return []
    if cosines == AXIAL and len(position) == 3 and abs(grid[0] - position[2]) <= SAME_HEIGHT_MM:
        return []
    return [
        Notice(
            "W-GEOMETRY-CONTRADICTED",
            f"GridFrameOffsetVector begins with {grid[0]:g}; expected 0, or the z of an axial dose's "
            "position; its numbers are taken as distances from the first",
        )
    ]


def _real_world(place: Place) -> tuple[float, float, str] | None:
    """Return slope, intercept and unit of a linear map to real-world values; None where there is none."""
    for holder in (place.own, place.shared, place.dataset):
        for item in elements.items(holder, 0x00409096):
            slope, intercept = (elements.numbers(item, tag, 1) for tag in (0x00409225, 0x00409224))
            units = elements.items(item, 0x004008EA)
            unit = elements.text(units[0], 0x00080100) if units else ""
            return (slope or [float("nan")])[0], (intercept or [float("nan")])[0], unit
    return None
