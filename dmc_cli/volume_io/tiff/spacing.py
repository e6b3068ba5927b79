"""Find the distances of a TIFF's nodes in OME's or ImageJ's metadata: lengths with their units, never times.

OME's schema gives µm as the unit of a length without one. ImageJ has one unit, and may have others along y
and z; its distances within a slice are the inverse of the TIFF's resolution.
"""

import math
from itertools import islice
from typing import Any
from xml.etree import ElementTree

from dmc_cli.notices import Notice
from dmc_cli.volume_io.layout import Triple
from dmc_cli.volume_io.lengths import Doubts, missing_spacing
from dmc_cli.volume_io.tiff.ome import steps_of_planes
from dmc_cli.volume_io.units import length_of, scales_in_mm

_WHAT = "the TIFF"

_RESOLUTION_UNITS = {2: "inch", 3: "cm"}
"""Codes of ResolutionUnit, of which 1 is none."""


def tiff_spacing(tiff: Any, name: str, number: int = 0) -> tuple[Triple | None, Doubts]:
    """Return the spacing along x, y, z in millimetres, None where there is none, and what is told of it.

    Args:
        tiff: tifffile's file.
        name: The input, for messages.
        number: Which of OME's images.

    Raises:
        UnsupportedFormatError: An axis of space is measured in units of time.
    """
    if tiff.is_ome and tiff.ome_metadata:
        return ome_spacing(tiff.ome_metadata, name, number)
    if tiff.is_imagej and tiff.imagej_metadata:
        return _imagej_spacing(tiff, name)
    return None, ()


def ome_spacing(xml: str, name: str, number: int = 0) -> tuple[Triple | None, Doubts]:
    """Return the spacing that OME's XML tells of an image, as `tiff_spacing` does."""
    images = (each for each in ElementTree.fromstring(xml).iter() if each.tag.endswith("}Pixels"))
    pixels = next(islice(images, number, None), None)
    lengths = [None if pixels is None else pixels.get(f"PhysicalSize{axis}") for axis in "XYZ"]
    if pixels is None or lengths == [None] * 3:
        return None, ()
    units = [pixels.get(f"PhysicalSize{axis}Unit", "µm") for axis in "XYZ"]
    spacing, doubts = _scaled([None if length is None else float(length) for length in lengths], units, name)
    return spacing, (*doubts, *_contradiction(spacing[2], steps_of_planes(pixels)))


def _contradiction(distance: float, steps: list[float]) -> tuple[Notice, ...]:
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
        f"{_WHAT} tells slices {distance:.6g} mm apart, and places of its planes that are {min(steps):.6g} "
        f"to {max(steps):.6g} mm apart; the first is taken; --spacing tells better"
    )
    return (Notice("W-GEOMETRY-CONTRADICTED", sentence),)


def _imagej_spacing(tiff: Any, name: str) -> tuple[Triple | None, Doubts]:
    """Return ImageJ's distances; none where there is none of slices, and no unit of those within them."""
    told, tags = tiff.imagej_metadata, tiff.pages[0].tags
    lengths: list[float | None] = []
    for tag in ("XResolution", "YResolution"):
        count, length = tags[tag].value if tag in tags else (1, None)
        lengths.append(None if length is None else length / count if count else math.inf)
    unit = told.get("unit")
    if unit is None and "ResolutionUnit" in tags:
        unit = _RESOLUTION_UNITS.get(int(tags["ResolutionUnit"].value))
    units = [unit, told.get("yunit", unit), told.get("zunit", unit)]
    if "spacing" not in told and (unit is None or length_of(str(unit)) is None):
        return None, ()
    between = abs(float(told["spacing"])) if "spacing" in told else None
    return _scaled([*lengths, between], units, name)


def _scaled(lengths: list[float | None], units: list[Any], name: str) -> tuple[Triple, Doubts]:
    """Return three lengths in millimetres, 1 of its unit in place of one that is missing."""
    scales, doubts = scales_in_mm([None if unit is None else str(unit) for unit in units], name, _WHAT)
    missing = {axis: scales[n] for n, axis in enumerate("xyz") if lengths[n] is None}
    x, y, z = (
        scale * (1.0 if length is None else length) for length, scale in zip(lengths, scales, strict=True)
    )
    return (x, y, z), (*missing_spacing(missing, _WHAT), *doubts)
