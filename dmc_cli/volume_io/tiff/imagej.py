"""Find what ImageJ's metadata tell of a TIFF beside distances: where the origin lies, and what values mean.

ImageJ has the origin in pixels, and a function from stored values to calibrated ones, of whole numbers alone:
Calibration.java numbers its kinds, of which 0 is a straight line and 20 none.
"""

from typing import Any

from dmc_cli.notices import Notice
from dmc_cli.volume_io.layout import Triple

_STRAIGHT, _NONE, _UNCALIBRATED_DENSITY = 0, 20, 21


def imagej_origin(tiff: Any, spacing: Triple) -> Triple | None:
    """Return where the first node lies, in the unit of `spacing`; None where nothing tells it."""
    told = _metadata(tiff)
    if not any(f"{axis}origin" in told for axis in "xyz"):
        return None
    x, y, z = (
        0.0 - float(told.get(f"{axis}origin", 0.0)) * step for axis, step in zip("xyz", spacing, strict=True)
    )
    return x, y, z


def imagej_scale(tiff: Any) -> tuple[float, float, tuple[Notice, ...]]:
    """Return slope and intercept from stored values to ImageJ's calibrated ones, and what is told of them."""
    told = _metadata(tiff)
    kind = int(told.get("cf", _NONE))
    if kind == _NONE or (kind != _UNCALIBRATED_DENSITY and not ("c0" in told and "c1" in told)):
        return 1.0, 0.0, ()
    if kind != _STRAIGHT or tiff.pages[0].dtype.kind not in "iu":
        sentence = f"ImageJ's calibration of the values (function {kind}) is not applied; they are as stored"
        return 1.0, 0.0, (Notice("W-VALUES-MAPPED", sentence),)
    slope, intercept = float(told["c1"]), float(told["c0"])
    if slope == 0.0:
        sentence = "ImageJ's calibration has the factor 0; values are taken as they are stored"
        return 1.0, 0.0, (Notice("W-RESCALE-UNKNOWN", sentence),)
    return slope, intercept, ()


def _metadata(tiff: Any) -> dict[str, Any]:
    return (tiff.imagej_metadata or {}) if tiff.is_imagej else {}
