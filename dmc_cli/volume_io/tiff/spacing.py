"""Find the distances of a TIFF's nodes in its metadata: lengths with their units, never times.

OME's schema gives µm as the unit of a length without one. ImageJ has one unit, and may have others along y
and z; its distances within a slice are the inverse of the TIFF's resolution. tifffile's own metadata have the
same keys where a writer gave them. Other programs' are in `dialects.py`; the resolution alone comes last.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import islice
from typing import Any
from xml.etree import ElementTree

from dmc_cli.notices import Notice
from dmc_cli.volume_io.lengths import Doubts
from dmc_cli.volume_io.tiff.dialects import dialect_lengths
from dmc_cli.volume_io.tiff.ome import steps_of_planes
from dmc_cli.volume_io.told_lengths import ToldLengths, is_of_print, resolution_lengths
from dmc_cli.volume_io.units import is_time, length_of

WHAT = "the TIFF"

_RESOLUTION_UNITS = {2: "inch", 3: "cm"}
"""Codes of ResolutionUnit, of which 1 is none."""


def tiff_lengths(tiff: Any, number: int = 0) -> ToldLengths | None:
    """Return the distances that the surest of a file's metadata tell of an image, or None.

    Args:
        tiff: tifffile's file.
        number: Which of OME's images.
    """
    found = None
    if tiff.is_ome and tiff.ome_metadata:
        found = ome_lengths(tiff.ome_metadata, number)
    if found is None and tiff.is_imagej and tiff.imagej_metadata:
        found = _imagej_lengths(tiff.imagej_metadata, tiff.pages[0].tags)
    if found is None and tiff.is_shaped:
        found = _shaped_lengths(tiff, number)
    return found or dialect_lengths(tiff) or _resolution(tiff.pages[0].tags)


def ome_lengths(xml: str, number: int = 0) -> ToldLengths | None:
    """Return the lengths that OME's XML tells of an image, or None."""
    images = (each for each in ElementTree.fromstring(xml).iter() if each.tag.endswith("}Pixels"))
    pixels = next(islice(images, number, None), None)
    sizes = [None if pixels is None else pixels.get(f"PhysicalSize{axis}") for axis in "XYZ"]
    if pixels is None or sizes == [None] * 3:
        return None
    found = _physical_sizes(pixels.attrib)
    z, unit = found.lengths[2], length_of(found.units[2] or "") or 1.0
    told = _contradiction((1.0 if z is None else z) * unit, steps_of_planes(pixels))
    return replace(found, doubts=told)


def _physical_sizes(told: Mapping[str, Any]) -> ToldLengths:
    """Return the lengths of OME's attributes."""
    sizes = [told.get(f"PhysicalSize{axis}") for axis in "XYZ"]
    x, y, z = (None if size is None else float(size) for size in sizes)
    ux, uy, uz = (str(told.get(f"PhysicalSize{axis}Unit", "µm")) for axis in "XYZ")
    return ToldLengths((x, y, z), (ux, uy, uz), WHAT)


def _contradiction(distance: float, steps: list[float]) -> Doubts:
    """Return what is told of steps between OME's planes, all in millimetres, that are no such distance.

    A stage's jitter is no contradiction.
    """
    if not any(steps) or not all(map(math.isfinite, steps)):
        return ()
    mean = abs(sum(steps)) / len(steps)
    is_even = all(abs(abs(step) - distance) <= 0.1 * distance for step in steps)
    if is_even and abs(mean - distance) <= 0.01 * distance:
        return ()
    sentence = (
        f"{WHAT} tells slices {distance:.6g} mm apart, and places of its planes that are {min(steps):.6g} "
        f"to {max(steps):.6g} mm apart; the first is taken; --spacing tells better"
    )
    return (Notice("W-GEOMETRY-CONTRADICTED", sentence),)


def _shaped_lengths(tiff: Any, number: int) -> ToldLengths | None:
    """Return what the metadata of one image tell that tifffile writes as JSON, by OME's keys or ImageJ's."""
    images = tiff.shaped_metadata or ()
    told = images[number] if number < len(images) else {}
    if any(isinstance(told.get(f"PhysicalSize{axis}"), int | float) for axis in "XYZ"):
        return _physical_sizes(told)
    if isinstance(told.get("spacing"), int | float) or isinstance(told.get("unit"), str):
        return _imagej_lengths(told, tiff.pages[0].tags)
    return None


def _imagej_lengths(told: dict[str, Any], tags: Any) -> ToldLengths | None:
    """Return ImageJ's distances; None where there is none of slices, and no unit of those within them."""
    x, y = (_pixel(tags, tag) for tag in ("XResolution", "YResolution"))
    unit = told.get("unit")
    if unit is None and "ResolutionUnit" in tags:
        unit = _RESOLUTION_UNITS.get(int(tags["ResolutionUnit"].value))
        if unit is not None and _is_print(x, y, unit):
            x = y = unit = None
    is_sure = unit is not None and (length_of(str(unit)) is not None or is_time(str(unit)))
    if "spacing" not in told and (x is None or not is_sure):
        return None
    between = abs(float(told["spacing"])) if "spacing" in told else None
    ux, uy, uz = (
        None if found is None else str(found)
        for found in (unit, told.get("yunit", unit), told.get("zunit", unit))
    )
    return ToldLengths((x, y, between), (ux, uy, uz), WHAT)


def _is_print(x: float | None, y: float | None, unit: str) -> bool:
    """Return whether a resolution is that of a screen or printer, as ImageJ takes 72 dpi."""
    length = length_of(unit)
    return all(n and length and is_of_print(25.4 / (n * length)) for n in (x, y))


def _pixel(tags: Any, tag: str) -> float | None:
    """Return the inverse of a resolution, None where there is none."""
    if tag not in tags:
        return None
    count, length = tags[tag].value
    return length / count if count else math.inf


def _resolution(tags: Any) -> ToldLengths | None:
    """Return the lengths that the tags of a resolution mean by themselves, with a unit."""
    unit = _RESOLUTION_UNITS.get(int(tags.valueof("ResolutionUnit") or 1))
    x, y = (_pixel(tags, tag) for tag in ("XResolution", "YResolution"))
    length = length_of(unit or "")
    if not x or not y or length is None:
        return None
    return resolution_lengths(1 / x, 1 / y, length, WHAT)
