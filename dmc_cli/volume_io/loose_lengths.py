"""Read lengths that programs write as attributes of an array, of HDF5 and of Zarr, by habits and no standard.

N5 and its viewers: `pixelResolution`, along x, y, z, with its unit, times `downsamplingFactors`. COSEM:
`transform`, with the names of its axes. CREMI, ilastik, neuroglancer and others: `resolution`, `voxel_size`
and the like, along z, y, x or x, y, z: they count where they have a unit and names of axes (`axis_names`
of funlib), or are one length for all axes; else they are told.
"""

import json
import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from dmc_cli.notices import Notice
from dmc_cli.volume_io.layout import Triple
from dmc_cli.volume_io.units import length_of

LOOSE_LENGTHS = ("spacing", "resolution", "voxel_size", "voxel_spacing", "pixel_size", "pixelsize", "scale")
"""Attributes of lengths that no standard gives a unit."""

UNIT_SUFFIXES = ("", "_um", "_nm", "_mm")
"""Units that such an attribute may be called by."""

PIXEL_RESOLUTION = "pixelResolution"

Told = tuple[Triple | None, Triple | None, tuple[Notice, ...]]
"""Distances and the place of the first node along x, y, z in mm, None where not told, and what is told."""


def loose_lengths(owners: Sequence[tuple[str, Mapping[str, Any]]], label: str = "") -> Told:
    """Return the lengths that attributes tell with their unit.

    Args:
        owners: Where attributes are, as messages name it, and these, the array's own first; those of the
            first one with any count.
        label: The array's name in its group: s1, s2, ... are smaller copies of s0, whose lengths the group
            tells.
    """
    for number, (where, attributes) in enumerate(owners):
        factors = _factors(owners[0][1], attributes, label)
        for read in (_transform, _pixel_resolution, _loose):
            spacing, origin, told = _positive(read(attributes, where), where)
            if spacing is not None and (number or read is _pixel_resolution):
                if factors is None:
                    sentence = f"the lengths of {where} are of s0, not of the smaller copy {label}; not used"
                    return None, None, (Notice("W-SPACING-MISSING", f"{sentence}; --spacing gives them"),)
                spacing, origin = _coarser(spacing, origin, factors)
            if spacing is not None or told:
                return spacing, origin, told
    return None, None, ()


def _positive(told: Told, where: str) -> Told:
    """Return what is told, without lengths that are none: these are not used."""
    spacing = told[0]
    if spacing is None or all(0 < length < math.inf for length in spacing):
        return told
    sizes = " x ".join(f"{length:g}" for length in spacing)
    sentence = (
        f"{where} tells distances of {sizes} mm, which are no lengths and not used; --spacing gives them"
    )
    return None, None, (Notice("W-SPACING-MISSING", sentence),)


def _factors(own: Mapping[str, Any], attributes: Mapping[str, Any], label: str) -> Triple | None:
    """Return how many times farther apart nodes are along x, y, z than told; None where nothing tells it."""
    found = numbers(own.get("downsamplingFactors"))
    level = re.fullmatch(r"s(\d{1,3})", label)
    if len(found) < 3:
        if level is None or int(level[1]) == 0:
            return 1.0, 1.0, 1.0
        listed = attributes.get("scales", attributes.get("downsamplingFactors"))
        with suppress(TypeError, LookupError):
            found = numbers(listed[int(level[1])])  # type: ignore[index]
    return (found[0], found[1], found[2]) if len(found) >= 3 else None


def _coarser(spacing: Triple, origin: Triple | None, factors: Triple) -> tuple[Triple, Triple]:
    """Return distances and the first node's place of a copy whose nodes are means of so many."""
    (x, y, z), (i, j, k), (a, b, c) = spacing, origin or (0.0, 0.0, 0.0), factors
    return (x * a, y * b, z * c), (i + x * (a - 1) / 2, j + y * (b - 1) / 2, k + z * (c - 1) / 2)


def axis_names(attributes: Mapping[str, Any], count: int) -> tuple[str, ...]:
    """Return the names that funlib and COSEM write of so many axes, or none."""
    for named in (attributes.get("axis_names"), attributes.get("axes"), _inner(attributes).get("axes")):
        names = _texts(named)
        if len(names) == count and all(names):
            return tuple(name.removesuffix("^") for name in names)
    return ()


def numbers(value: Any) -> list[float]:
    """Return an attribute's numbers, none where it has not only these."""
    try:
        return [float(number) for number in np.atleast_1d(value)]
    except (TypeError, ValueError):
        return []


def _texts(value: Any) -> list[str]:
    """Return an attribute's texts: one, or a list; of other things none."""
    if value is None:
        return []
    entries = [value] if isinstance(value, str | bytes) else value
    try:
        listed = list(entries)
    except TypeError:
        return []
    plain = [entry.decode("utf-8", "replace") if isinstance(entry, bytes) else entry for entry in listed]
    return [str(entry) for entry in plain] if all(isinstance(entry, str) for entry in plain) else []


def _inner(attributes: Mapping[str, Any]) -> Mapping[str, Any]:
    found = _object(attributes.get("transform"))
    return found if isinstance(found, Mapping) else {}


def _object(value: Any) -> Any:
    """Return an attribute; of HDF5, which has no objects, what N5 writes as a JSON text."""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
    if isinstance(text, str) and text.startswith("{"):
        with suppress(ValueError, RecursionError):
            return json.loads(text)
    return value


def _by_names(names: Sequence[str], values: Sequence[float]) -> Triple | None:
    """Return values along x, y, z of those that are told along axes with names; None without these three."""
    told = {named.lower().removesuffix("^"): value for named, value in zip(names, values, strict=False)}
    if len(names) != len(values) or not {*"xyz"} <= {*told}:
        return None
    return told["x"], told["y"], told["z"]


def _transform(attributes: Mapping[str, Any], where: str) -> Told:
    """Return what COSEM's attribute tells: scale, translate, units, each along named axes."""
    inner = _inner(attributes)
    names, units = _texts(inner.get("axes")), _texts(inner.get("units"))
    lengths = [length_of(unit) for unit in units]
    scales = numbers(inner.get("scale"))
    if not scales:
        return None, None, ()
    if None in lengths or len(lengths) != len(scales):
        return _no_unit("transform", where, units)
    steps = _by_names(names, [s * (u or 0) for s, u in zip(scales, lengths, strict=True)])
    shift = numbers(inner.get("translate", [0.0] * len(scales)))
    first = _by_names(names, [s * (u or 0) for s, u in zip(shift, lengths, strict=False)])
    return (steps, first, ()) if steps else _no_axes("transform", where)


def _pixel_resolution(attributes: Mapping[str, Any], where: str) -> Told:
    """Return what N5's attribute tells: lengths along x, y, z, in its unit."""
    if PIXEL_RESOLUTION not in attributes:
        return None, None, ()
    told = _object(attributes[PIXEL_RESOLUTION])
    steps = numbers(told.get("dimensions") if isinstance(told, Mapping) else told)
    units = _texts(told.get("unit")) if isinstance(told, Mapping) else _units(attributes, PIXEL_RESOLUTION)
    scale = length_of(units[0]) if len({*units}) == 1 else None
    if scale is None:
        return _no_unit(PIXEL_RESOLUTION, where, units)
    if len(steps) < 3:
        return _no_axes(PIXEL_RESOLUTION, where)
    x, y, z = (scale * step for step in steps[:3])
    return (x, y, z), (0.0, 0.0, 0.0), ()


def _units(attributes: Mapping[str, Any], key: str) -> list[str]:
    for named in (f"{key}_unit", f"{key}_units", "units", "unit"):
        found = _texts(attributes.get(named))
        if found:
            return found
    return []


def _loose(attributes: Mapping[str, Any], where: str) -> Told:
    """Return what an attribute tells in a unit, as one length for all axes or along axes with names."""
    told: list[Notice] = []
    names = _texts(attributes.get("axis_names"))
    spatial = [named for named in names if not named.endswith("^")]
    for key in LOOSE_LENGTHS:
        for suffix in UNIT_SUFFIXES:
            if key + suffix not in attributes:
                continue
            units = [suffix[1:]] if suffix else _units(attributes, key)
            sizes = numbers(attributes[key + suffix])
            kept = names if len(names) == len(sizes) else spatial
            if len({*units}) > 1 and len(units) == len(names) > len(kept):  # channels have no length
                units = [unit for named, unit in zip(names, units, strict=True) if named in kept]
            scale = length_of(units[0]) if len({*units}) == 1 else None
            if scale is None or not sizes:
                told += _no_unit(key + suffix, where, units)[2]
                continue
            if len({*sizes}) == 1:
                length = scale * sizes[0]
                return (length, length, length), *_shifted(attributes, scale, kept, where)
            steps = _by_names(kept, [scale * size for size in sizes])
            if steps is not None:
                return steps, *_shifted(attributes, scale, kept, where)
            told += _no_axes(key + suffix, where)[2]
    return None, None, tuple(told)


def _shifted(
    attributes: Mapping[str, Any], scale: float, names: Sequence[str], where: str
) -> tuple[Triple | None, tuple[Notice, ...]]:
    """Return the place of the first node by the attribute `offset`, in mm, and what is told of it."""
    shift = numbers(attributes.get("offset", []))
    if not shift:
        return None, ()
    if len({*shift}) == 1:
        return (scale * shift[0],) * 3, ()
    first = _by_names(names, [scale * each for each in shift])
    if first is not None:
        return first, ()
    sentence = f"the attribute 'offset' of {where} does not tell of which axes it is; it is not used"
    return None, (Notice("W-POSITION-MISSING", f"{sentence}; --origin gives the place of the first node"),)


def _no_unit(key: str, where: str, units: Sequence[str]) -> Told:
    code, named = "W-UNIT-MISSING", "several units" if units else "no unit"
    if len({*units}) == 1:
        code, named = "W-UNIT-UNKNOWN", f"the unit {units[0][:20]!r}"
    sentence = f"the attribute {key!r} of {where} has {named} and is not used; --spacing gives lengths"
    return None, None, (Notice(code, sentence),)


def _no_axes(key: str, where: str) -> Told:
    sentence = f"the attribute {key!r} of {where} does not tell which axis its lengths are of"
    return None, None, (Notice("W-SPACING-MISSING", f"{sentence}; --spacing gives them"),)
