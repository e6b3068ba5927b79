"""Find where a MINC file puts its grid: step, start and direction cosines of each axis in space.

Sources: the programmer's guide of MINC 1 for the attributes and their defaults; cosines have the length 1
whatever is stored, as the format's own tools take them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.lengths import missing_spacing, settled_affine
from dmc_cli.volume_io.units import scales_in_mm

WHAT_PLACES = "step", "start", "direction_cosines", "units", "alignment"
"""Attributes of an axis that tell where its nodes lie."""

ROUNDING_TOLD = 1e-4
"""How far the length of direction cosines may be from 1 without a word."""


def minc_world(
    axes: Sequence[tuple[str, Mapping[str, Any]]], settings: ReadSettings, name: str
) -> tuple[Float64Array, tuple[Notice, ...]]:
    """Return the affine of indices along three axes in space, shape (4, 4), in mm, RAS, and what is told.

    An axis without a unit is in millimetres, as the tools of MINC take it.

    Args:
        axes: For each index, the first one the fastest, the axis' name and its attributes.
        settings: How to read.
        name: The input, for messages.

    Raises:
        UnsupportedFormatError: Units that differ, or of time.
        ValueError, TypeError: Attributes that are no numbers.
    """
    units = [_text(told.get("units")) or "mm" for _, told in axes]
    scales, doubts = scales_in_mm(units, name)
    if len(set(scales)) > 1:
        raise UnsupportedFormatError(
            f"{name}: axes in units that differ ({', '.join(units)}) found; expected one unit; "
            "correct them with minc_modify_header"
        )
    missing = {axis[0]: scales[0] for axis, told in axes if "step" not in told}
    doubts = (*missing_spacing(missing, "the header"), *doubts)
    affine = np.eye(4)
    notices = _edges(axes)
    with np.errstate(all="ignore"):  # what is not finite is refused with the affine
        for column, (axis, told) in enumerate(axes):
            direction, remark = _direction(axis, told)
            affine[:3, column] = direction * _number(told.get("step", 1.0))
            affine[:3, 3] += direction * _number(told.get("start", 0.0))
            notices += remark
        affine[:3] *= scales[0]
    if any("start" in told for _, told in axes) or settings.origin is None:
        affine, settled = settled_affine(affine, doubts, settings)
        return affine, (*settled, *notices, *_positions(axes))
    affine, settled = settled_affine(affine, doubts, replace(settings, origin=None))
    affine[:3, 3] = settings.origin
    return affine, (*settled, *notices)


def _direction(axis: str, told: Mapping[str, Any]) -> tuple[Float64Array, list[Notice]]:
    """Return the direction of an axis, of length 1, and what is told where it is stored with another."""
    default = np.eye(3)["xyz".index(axis[0])]
    direction = np.array(told.get("direction_cosines", default), np.float64).reshape(3)
    length = float(np.linalg.norm(direction))
    if length == 0 or not np.isfinite(length) or abs(length - 1) <= ROUNDING_TOLD:
        return direction, []
    sentence = f"the direction cosines of {axis} have the length {length:.6g}; they are taken with length 1"
    return direction / length, [Notice("W-ORIENTATION-ROUNDED", sentence)]


def _positions(axes: Sequence[tuple[str, Mapping[str, Any]]]) -> list[Notice]:
    """Return what is told of axes without a first place."""
    missing = [axis for axis, told in axes if "start" not in told]
    if not missing:
        return []
    sentence = f"the header tells no start of {' and '.join(missing)}; 0 is taken"
    remedy = "; --origin gives it" if len(missing) == len(axes) else ""
    return [Notice("W-POSITION-MISSING", f"{sentence}{remedy}")]


def _edges(axes: Sequence[tuple[str, Mapping[str, Any]]]) -> list[Notice]:
    """Return what is told of axes with places that are not those of centres, which no tool looks at."""
    beside = [axis for axis, told in axes if _text(told.get("alignment", "centre")).rstrip("_") != "centre"]
    if not beside:
        return []
    sentence = (
        f"the header puts places of {' and '.join(beside)} at the edges of nodes, where MINC's tools have "
        "their centres; they are taken as these"
    )
    return [Notice("W-GEOMETRY-CONTRADICTED", sentence)]


def _number(told: Any) -> float:
    return float(np.asarray(told, np.float64).ravel()[0])


def _text(told: Any) -> str:
    """Return an attribute as a text, of whatever type it is stored."""
    text = told.decode("latin-1") if isinstance(told, bytes) else str(told or "")
    return text.strip("\0 ")
