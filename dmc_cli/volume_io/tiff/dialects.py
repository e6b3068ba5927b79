"""Find distances of nodes in the tags of microscopes and other programs, as tifffile reads them.

A size of 0 means none. What a program leaves open is not used: the distance of slices in NIH Image, degrees
of a map.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from dmc_cli.volume_io.told_lengths import SAME_LENGTH, ToldLengths, differ

Found = tuple[list[Any], Any]
"""Lengths along x, y, z, None or 0 where not told, and their unit, one or one an axis."""

_NIH_UNITS = ("nm", "um", "mm", "cm", "m", "km", "inch", "ft", "mile")
"""NIH Image's units from its code 5 on."""

_LINEAR_UNITS = {9001: "m", 9002: "ft", 9003: "us_survey_foot", 9036: "km", 1025: "mm"}
"""EPSG's codes of the units of a map."""


def dialect_lengths(tiff: Any) -> ToldLengths | None:
    """Return the distances that the tags of one of `DIALECTS` tell, or None."""
    for flag, (title, read) in DIALECTS.items():
        if not getattr(tiff, f"is_{flag}", False):
            continue
        # whatever is missing or damaged in a program's tags is not told
        with suppress(LookupError, TypeError, ValueError, AttributeError, ArithmeticError):
            sizes, unit = read(tiff)
            units = unit if isinstance(unit, list) else [unit] * 3
            x, y, z = (_length(size) for size in sizes)
            told = ToldLengths((x, y, z), (units[0], units[1], units[2]), f"the TIFF of {title}")
            if told.are_known:
                return told
    return None


def _length(size: Any) -> float | None:
    """Return a size as a length, None for one that means none."""
    length = 0.0 if size is None else abs(float(size))
    return length if length > 0 and math.isfinite(length) else None


def _lsm(tiff: Any) -> Found:
    """Return what the header tells in metres."""
    told = tiff.lsm_metadata
    return [1e3 * told[f"VoxelSize{axis}"] for axis in "XYZ"], "mm"


def _stk(tiff: Any) -> Found:
    """Return MetaMorph's calibration; planes at uneven distances have none."""
    told = tiff.stk_metadata
    steps = [abs(float(step)) for step in told.get("ZDistance", ())][1:]
    is_even = steps and not differ(steps, [steps[0]] * len(steps), SAME_LENGTH)
    between = steps[0] if is_even else None
    if not told.get("SpatialCalibration", 1):
        return [None, None, between], "um"
    across: list[Any] = [_fraction(told[f"{axis}Calibration"]) for axis in "XY"]
    return [*across, between], told.get("CalibrationUnits")


def _fraction(value: Any) -> float:
    """Return a number that tifffile may give as numerator and denominator."""
    with suppress(TypeError):
        top, bottom = value
        return float(top) / float(bottom)
    return float(value)


def _fluoview(tiff: Any) -> Found:
    told = {axis[0].strip().lower(): axis for axis in tiff.fluoview_metadata["Dimensions"]}
    found = [told.get(axis, ("", 0, 0.0, 0.0, None)) for axis in "xyz"]
    first = next(axis[4] for axis in found if axis[4])
    return [axis[3] for axis in found], [axis[4] or first for axis in found]


def _metaseries(tiff: Any) -> Found:
    told = tiff.metaseries_metadata["PlaneInfo"]
    if not told.get("spatial-calibration-state", True):
        return [None] * 3, None
    across: list[Any] = [told.get(f"spatial-calibration-{axis}") for axis in "xy"]
    return [*across, None], told.get("spatial-calibration-units")


def _micromanager(tiff: Any) -> Found:
    """Return what the summary and the first frame tell; their keys name the unit."""
    frame = tiff.pages[0].tags.valueof(51123) or {}
    summary: dict[str, Any] = {}
    with suppress(ValueError):  # images that are a file each have none
        summary = (tiff.micromanager_metadata or {}).get("Summary") or {}
    pixel = frame.get("PixelSizeUm") or summary.get("PixelSize_um")
    step = summary.get("z-step_um")
    return [pixel, pixel, step], "um"


def _fei(tiff: Any) -> Found:
    """Return what the scan tells in metres."""
    told = tiff.fei_metadata
    scan = next(told[key] for key in ("Scan", "EScan", "IScan") if "PixelWidth" in told.get(key, {}))
    return [1e3 * scan["PixelWidth"], 1e3 * scan["PixelHeight"], None], "mm"


def _sem(tiff: Any) -> Found:
    """Return the size of an image's pixel of a Zeiss microscope, a name, a number and a unit."""
    told = tiff.sem_metadata
    _, pixel, unit = told.get("ap_image_pixel_size") or told["ap_pixel_size"]
    return [pixel, pixel, None], unit


def _sis(tiff: Any) -> Found:
    """Return what the header tells in metres."""
    told = tiff.sis_metadata
    return [1e3 * told["pixelsizex"], 1e3 * told["pixelsizey"], None], "mm"


def _nih(tiff: Any) -> Found:
    """Return the inverse of NIH Image's scale, its codes of units as of version 1.54."""
    told = tiff.nih_metadata
    code = int(told["UnitsID"]) + (5 if int(told["Version"]) <= 153 else 0)
    pixel = 1 / float(told["XScale"])
    aspect = float(told["PixelAspectRatio"]) if int(told["Version"]) > 140 else 0.0
    return [pixel, pixel / (aspect or 1.0), None], _NIH_UNITS[code - 5] if code >= 5 else None


def _geotiff(tiff: Any) -> Found:
    """Return the scale of a map in units of length, not one in degrees."""
    told = tiff.geotiff_metadata
    if int(told["GTModelTypeGeoKey"]) == 2:
        return [None] * 3, None
    scale: list[Any] = list(told["ModelPixelScale"])
    across = _LINEAR_UNITS.get(int(told.get("ProjLinearUnitsGeoKey", 0)))
    up = _LINEAR_UNITS.get(int(told.get("VerticalUnitsGeoKey", 0)), across)
    return scale[:3], [across, across, up]


DIALECTS: dict[str, tuple[str, Callable[[Any], Found]]] = {
    "lsm": ("Zeiss LSM", _lsm),
    "micromanager": ("Micro-Manager", _micromanager),
    "stk": ("MetaMorph", _stk),
    "metaseries": ("MetaSeries", _metaseries),
    "fluoview": ("FluoView", _fluoview),
    "fei": ("FEI", _fei),
    "sem": ("Zeiss SEM", _sem),
    "sis": ("Olympus SIS", _sis),
    "nih": ("NIH Image", _nih),
    "geotiff": ("GeoTIFF", _geotiff),
}
"""tifffile's flag of a dialect to its name and what reads its lengths."""
