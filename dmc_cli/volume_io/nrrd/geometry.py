"""Find where a NRRD header puts its grid: space directions, or spacings, or axis mins and maxs.

Named spaces become RAS or LPS; a left-handed or scanner space, or none, keeps the header's own coordinates
with space none.
"""

import math
import re
from dataclasses import replace

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Space
from dmc_cli.volume_io.layout import (
    Triple,
    chosen_origin,
    chosen_spacing,
    scale_affine,
)
from dmc_cli.volume_io.lengths import Doubts, missing_spacing, respaced, settled_affine
from dmc_cli.volume_io.nrrd.header import numbers, per_axis, vector
from dmc_cli.volume_io.nrrd.labels import world_axes
from dmc_cli.volume_io.units import is_missing, scales_in_mm

SPACES: dict[str, tuple[Space, tuple[float, float, float]]] = {
    "right-anterior-superior": ("RAS", (1, 1, 1)),
    "ras": ("RAS", (1, 1, 1)),
    "left-anterior-superior": ("RAS", (-1, 1, 1)),
    "las": ("RAS", (-1, 1, 1)),
    "left-posterior-superior": ("LPS", (1, 1, 1)),
    "lps": ("LPS", (1, 1, 1)),
    "scanner-xyz": ("none", (1, 1, 1)),
    "3d-right-handed": ("none", (1, 1, 1)),
    "3d-left-handed": ("none", (1, 1, 1)),
}
"""Name of a space to ours, and the signs that turn its axes into it. A name may end in `-time` (or T)."""

NO_ORIGIN = "the header tells no space origin; 0 is taken for the first node; --origin gives it"

_SAME_LENGTH = 1e-3
"""Part of a distance by which two statements of it may differ: writers round to a few digits."""

SCANNED = frozenset(name for name in SPACES if not name.startswith("3d-"))
"""Spaces of a patient or a scanner."""


def nrrd_geometry(
    fields: dict[str, str], spatial: tuple[int, int, int], settings: ReadSettings, name: str
) -> tuple[Float64Array, Space, tuple[Notice, ...]]:
    """Return the affine in millimetres, its space, and warnings; `spatial` are the axes of space.

    Raises:
        UnsupportedFormatError: An unknown space, or vectors without three coordinates.
        DamagedVolumeError: The header contradicts itself.
    """
    spelled = re.sub(r"(-time|(?<=^(?:ras|las|lps))t)$", "", fields.get("space", "").lower())
    directions = per_axis(fields.get("space directions", ""))
    notes: list[Notice] = []
    if spelled == "3d-left-handed":
        told = "the header's space is left-handed: in a right-handed viewer its mesh is the mirror image"
        notes.append(Notice("W-SPACE-LEFT-HANDED", told))
    if not directions:
        if spelled in SPACES and SPACES[spelled][0] != "none":
            told = (
                f"the header names the space {spelled} but no directions; axes are the grid's own, space none"
            )
            notes.append(Notice("W-ORIENTATION-MISSING", told))
        return _unoriented(fields, spatial, spelled, settings, name, notes), "none", tuple(notes)
    if spelled and spelled not in SPACES:
        raise UnsupportedFormatError(f"{name}: space {spelled!r} found; expected one of {', '.join(SPACES)}")
    space, signs = SPACES[spelled] if spelled else ("none", (1.0, 1.0, 1.0))
    if len(directions) <= spatial[2]:
        raise DamagedVolumeError(f"{name}: {len(directions)} space directions found; expected one an axis")
    columns = [vector(directions[a], name) for a in spatial]
    origin = vector(fields["space origin"], name) if "space origin" in fields else [0.0, 0.0, 0.0]
    if any(len(v) not in (3, 4) for v in [*columns, origin]):
        raise UnsupportedFormatError(
            f"{name}: space directions or origin without three coordinates; expected 3-D vectors"
        )
    notes += _unclear_space(fields, spelled, len(columns[0]))
    scale, doubts = _scales(_with_space_units(fields, spatial, name), "space units", (0, 1, 2), spelled, name)
    affine = np.eye(4)
    affine[:3, :3] = np.array([c[:3] for c in columns]).T
    affine[:3, 3] = origin[:3]
    with np.errstate(all="ignore"):  # what is not finite is refused with the layout
        lengths = np.linalg.norm(affine[:3, :3], axis=0).tolist()
    notes += _contradictions(
        lengths, [_entry(fields, "spacings", a, name) for a in spatial], "space directions"
    )
    affine[:3] *= (np.array(scale) * np.array(signs))[:, None]
    if "space origin" in fields or spelled not in SCANNED:
        affine, told_of_lengths = settled_affine(affine, doubts, settings)
        return affine, space, (*notes, *told_of_lengths)
    affine, told_of_lengths = settled_affine(affine, doubts, replace(settings, origin=None))
    if settings.origin is None:
        notes.append(Notice("W-POSITION-MISSING", NO_ORIGIN))
    affine[:3, 3] = settings.origin or (0.0, 0.0, 0.0)
    return affine, space, (*notes, *told_of_lengths)


def _unclear_space(fields: dict[str, str], space: str, count: int) -> list[Notice]:
    """Return what is told of a space of so many axes: no name for one with a time, too many units."""
    told = []
    if not space and count == 4:
        sentence = "the header names no space for its four coordinates; the first three are taken, space none"
        told.append(Notice("W-ORIENTATION-MISSING", sentence))
    units = len(per_axis(fields.get("space units", "")))
    if units > count:
        sentence = f"the header has {units} space units for {count} axes of its space; the first are taken"
        told.append(Notice("W-GEOMETRY-CONTRADICTED", sentence))
    return told


def _with_space_units(fields: dict[str, str], spatial: tuple[int, int, int], name: str) -> dict[str, str]:
    """Return the fields with space units, those of the axes where the header has these alone.

    Raises:
        UnsupportedFormatError: The axes' units differ, so that they are none of the world.
    """
    units = per_axis(fields.get("units", ""))
    told = [units[a].strip('"') for a in spatial if a < len(units)]
    named = {unit for unit in told if not is_missing(unit)}
    if "space units" in fields or not named:
        return fields
    if len(named) > 1:
        raise UnsupportedFormatError(
            f"{name}: units {fields['units'][:60]} of the axes found beside space directions; expected one "
            "unit, or space units; correct the header"
        )
    return fields | {"space units": " ".join(3 * [f'"{named.pop()}"'])}


def _contradictions(lengths: list[float], others: list[float], what: str) -> list[Notice]:
    """Return a warning where distances of the nodes are told twice, and differ; NaN tells none."""
    pairs = [(abs(a), abs(b)) for a, b in zip(lengths, others, strict=True)]
    if not any(abs(a - b) > _SAME_LENGTH * a for a, b in pairs if math.isfinite(a - b)):
        return []
    first, second = (" x ".join(f"{each:.6g}" for each in told) for told in zip(*pairs, strict=True))
    if what == "space directions":
        sentence = f"the header's {what} have nodes {first} apart, its spacings {second}; the first are taken"
    else:
        sentence = f"the header's spacings are {first}, those by its {what} {second}; the first are taken"
    return [Notice("W-GEOMETRY-CONTRADICTED", sentence)]


def _scales(
    fields: dict[str, str], key: str, axes: tuple[int, int, int], space: str, name: str
) -> tuple[Triple, Doubts]:
    """Return the length in millimetres of three axes' units, those of a field, and what is told of them.

    A space of a patient or a scanner is in millimetres where no unit is told at all: no program that writes
    one means anything else.
    """
    if key not in fields and space in SCANNED:
        return (1.0, 1.0, 1.0), ()
    units = per_axis(fields.get(key, ""))
    return scales_in_mm([units[a] if a < len(units) else None for a in axes], name, "the header")


def _unoriented(
    fields: dict[str, str],
    spatial: tuple[int, int, int],
    space: str,
    settings: ReadSettings,
    name: str,
    notes: list[Notice],
) -> Float64Array:
    """Return the affine along the grid's axes, by spacings or axis mins and maxs, else by the settings.

    The axes run along x, y, z of the world in their order, unless labels say otherwise.
    """
    sizes = numbers(fields, "sizes", name, int)
    world = world_axes(fields, spatial, len(sizes))
    x, y, z = (spatial[world.index(n)] for n in range(3))
    scales, doubts = _scales(fields, "units", (x, y, z), space, name)
    centers = per_axis(fields.get("centers", fields.get("centerings", "")))
    steps, lows, halves, told, others = [], [], [], [], []
    for axis, scale in zip((x, y, z), scales, strict=True):
        is_cell = axis < len(centers) and centers[axis].lower() == "cell"
        low, high, step = (_entry(fields, key, axis, name) for key in ("axis mins", "axis maxs", "spacings"))
        between = (high - low) / (sizes[axis] if is_cell else sizes[axis] - 1)
        told.append(step)
        others.append(between)
        step = between if math.isnan(step) else step
        steps.append(step * scale)
        lows.append(low * scale)
        halves.append(0.5 if is_cell else 0.0)
    missing = {axis: scales[n] for n, axis in enumerate("xyz") if math.isnan(steps[n])}
    if len(missing) < 3:
        doubts = (*missing_spacing(missing, "the header"), *doubts)
    spacing, warnings = chosen_spacing(_told(steps, list(scales)), settings, doubts=doubts)
    firsts = [low + half * step for low, half, step in zip(lows, halves, spacing, strict=True)]
    origin, unused = chosen_origin(_told(firsts, [0.0, 0.0, 0.0]), settings)
    notes += [*_contradictions(told, others, "axis mins and maxs"), *warnings, *unused]
    affine = respaced(scale_affine(spacing, origin), doubts, settings)
    return affine[:, [*world, 3]]


def _entry(fields: dict[str, str], key: str, axis: int, name: str) -> float:
    """Return an axis' number in a field, or NaN where there is none."""
    entries = per_axis(fields.get(key, ""))
    try:
        return float(entries[axis]) if axis < len(entries) else math.nan
    except ValueError as error:
        raise DamagedVolumeError(
            f"{name}: {key} {fields[key][:60]!r} found in the header; expected numbers"
        ) from error


def _told(lengths: list[float], missing: list[float]) -> Triple | None:
    """Return three lengths, those of `missing` in place of NaN, or None where all are NaN."""
    if all(math.isnan(length) for length in lengths):
        return None
    x, y, z = (m if math.isnan(length) else length for length, m in zip(lengths, missing, strict=True))
    return x, y, z
