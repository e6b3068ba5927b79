"""Find the affine of a stack's slices: their true positions, tilt and all, with nothing resampled.

The third axis runs from the first slice to the last, so a tilted gantry becomes a shear. Slices at
uneven distances keep them in a table of positions. What looks like a missing slice or like two slices
in one place is a question to the user, not to a tolerance.
"""

from dataclasses import dataclass

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import AmbiguousVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice, notices
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.distances import ALIKE, MISSING, MOST_TIMES, gaps, is_even, shared_distance
from dmc_cli.volume_io.dicom.doubts import contradictions_told
from dmc_cli.volume_io.dicom.frames import Frame
from dmc_cli.volume_io.dicom.pixels import is_same_image
from dmc_cli.volume_io.dicom.stack import Stack
from dmc_cli.volume_io.left_out import left_out

THICK = 0.75
"""Slices thicker than this many times their distance leave nothing out."""

DRIFT_TOLD = 0.05
DRIFT_REFUSED = 0.5
"""Sideways distance of a slice from the line through the first and the last, in pixels."""


@dataclass(frozen=True, eq=False)
class SliceGeometry:
    """Where the slices of a volume lie.

    Attributes:
        frames: One frame a slice, in order.
        affine: Node index to LPS millimetres, shape (4, 4).
        slice_positions: As `Volume.slice_positions`.
        warnings: What the user is told.
    """

    frames: list[Frame]
    affine: Float64Array
    slice_positions: Float64Array | None
    warnings: tuple[Notice, ...]


def slice_geometry(stack: Stack, settings: ReadSettings, name: str) -> SliceGeometry:
    """Order a stack's slices, and return them with their distances and their affine.

    Raises:
        AmbiguousVolumeError: Duplicates or missing slices, unless the settings say what to do.
        UnsupportedFormatError: The slices do not lie along one line.
    """
    frames, places, notes = _without_duplicates(stack, settings, name)
    distances = np.diff(places)
    notes += _gaps(frames, places, stack, settings, name)
    first, last = np.array(frames[0].position), np.array(frames[-1].position)
    axis = (last - first) / (places[-1] - places[0])
    positions = np.array([frame.position for frame in frames])
    drift = positions - (first + np.outer(places - places[0], axis))
    notes += _drift(frames, np.linalg.norm(drift, axis=1), name)
    notes += contradictions_told(frames, places, float(np.linalg.norm(axis)))
    orientation = np.array(frames[0].orientation)
    affine = np.eye(4)
    affine[:3, 0] = orientation[:3] * frames[0].spacing[0]
    affine[:3, 1] = orientation[3:] * frames[0].spacing[1]
    affine[:3, 2] = (last - first) / (len(frames) - 1)
    affine[:3, 3] = first
    uneven = not is_even(places)
    table = (places - places[0]) * np.linalg.norm(axis) if uneven else None
    if uneven:
        least, most = (_told(frames, distances, int(n)) for n in (distances.argmin(), distances.argmax()))
        told = f"slice distances vary from {least} to {most}; every slice is kept where it is"
        notes.append(Notice("W-SLICES-UNEVEN", told))
    return SliceGeometry(frames, affine, table, tuple(notes))


def _told(frames: list[Frame], distances: Float64Array, n: int) -> str:
    """Return a text with distance n and the files that it lies between."""
    return f"{_length(distances[n])} mm between {frames[n].name} and {frames[n + 1].name}"


def _length(millimetres: float) -> str:
    """Return a length with three decimals, or more where these would not tell it."""
    return f"{millimetres:.3f}" if millimetres == 0 or millimetres >= 0.1 else f"{millimetres:.3g}"


def _without_duplicates(
    stack: Stack, settings: ReadSettings, name: str
) -> tuple[list[Frame], Float64Array, list[Notice]]:
    """Return the frames and their places, one frame a place, and warnings of those dropped."""
    frames, places = stack.frames, stack.places()
    closest = stack.same_place
    kept = [0]
    copies: dict[int, int] = {}
    for n in range(1, len(frames)):
        if places[n] - places[kept[-1]] >= closest:
            kept.append(n)
        else:
            copies[n] = kept[-1]
    dropped = list(copies)
    if dropped and settings.duplicates == "refuse":
        first = dropped[0]
        other = copies[first]
        raise AmbiguousVolumeError(
            f"{name}: {len(dropped)} of {len(frames)} slices lie where another one lies (closer than "
            f"{closest:.2g} mm), first {frames[other].name} and {frames[first].name}, "
            f"{_length(places[first] - places[other])} mm apart; expected one slice a position; "
            "--duplicates first takes the first of true copies"
        )
    for n, other in copies.items():
        if not is_same_image(frames[other], frames[n], name):
            raise AmbiguousVolumeError(
                f"{name}: {frames[other].name} and {frames[n].name} lie in one place with other values, and "
                "nothing that is known tells them apart; expected copies, of which --duplicates first drops "
                "one; give the slices of one volume alone"
            )
    kinds = (f"{kind} in the place of another one" for kind in ("slice", "slices"))
    notes = notices("W-DUPLICATES-DROPPED", left_out([frames[n].name for n in dropped], *kinds))
    return [frames[n] for n in kept], np.array([places[n] for n in kept]), notes


def _gaps(
    frames: list[Frame], places: Float64Array, stack: Stack, settings: ReadSettings, name: str
) -> list[Notice]:
    """Refuse distances that look like a missing slice, or return warnings of them, as the settings say."""
    distances = np.diff(places)
    found = _unfilled(frames, distances, gaps(distances))
    stated = _finer_distance(frames, distances)
    others, ends = _places_of_others(frames, places, stack)
    if found:
        elsewhere = f"{_length(np.median(np.delete(distances, found)))} mm elsewhere"
    elif others:
        found, elsewhere = others, "other volumes of the series have slices there"
    elif stated:
        found, elsewhere = list(range(len(distances))), f"SpacingBetweenSlices is {_length(stated)} mm"
    elif not stack.all_places and _lacks_numbers(frames, distances):
        found = list(range(len(distances)))
        elsewhere = "InstanceNumber leaves as many out, and slices are as thin as if they were there"
    else:
        return [*ends, *_thin_told(frames, distances)]
    told = f"{_told(frames, distances, found[0])}, {elsewhere}"
    if settings.slice_gaps == "refuse":
        raise AmbiguousVolumeError(
            f"{name}: {len(found)} missing slice{'s' if len(found) > 1 else ''} found: {told}; expected a "
            "complete series; "
            "get the missing files, or bridge the gap with --slice-gaps keep"
        )
    return [Notice("W-SLICES-MISSING", f"slices are missing: {told}"), *ends]


def _unfilled(frames: list[Frame], distances: Float64Array, found: list[int]) -> list[int]:
    """Return those of the gaps that thicker slices do not fill: a head is often thin below and thick above.

    Slices that are all of one thickness fill none, for they may overlap.
    """
    thicknesses = np.array([frame.thickness or 0.0 for frame in frames])
    if not found or thicknesses.min() <= 0 or np.ptp(thicknesses) == 0:
        return found
    wide = gaps(distances / ((thicknesses[:-1] + thicknesses[1:]) / 2))
    return [n for n in found if n in wide]


def _places_of_others(
    frames: list[Frame], places: Float64Array, stack: Stack
) -> tuple[list[int], list[Notice]]:
    """Return the numbers of the distances within which other volumes of the series have slices.

    With them comes a notice if others go on beyond the ends. Thick slices leave nothing out.
    """
    others = np.array(stack.all_places)
    if len(others) <= len(places):
        return [], []
    # a quarter of a distance off: others may lie a little beside
    reach = shared_distance(places, copies=False) / 4
    within = np.searchsorted(places, others)
    inside = (within > 0) & (within < len(places))
    nearest = np.minimum(
        np.abs(others - places[(within - 1).clip(0)]),
        np.abs(others - places[within.clip(0, len(places) - 1)]),
    )
    beyond = int(((nearest > reach) & ~inside).sum())
    sentence = f"{beyond} place(s) beyond the ends of this volume have slices of other volumes of the series"
    ends = [Notice("W-SLICES-MISSING", sentence)] if beyond else []
    if (frames[0].thickness or 0.0) > THICK * float(np.diff(places).min()):
        return [], ends
    return sorted(set((within[(nearest > reach) & inside] - 1).tolist())), ends


def _finer_distance(frames: list[Frame], distances: Float64Array) -> float | None:
    """Return the distance that the file states where all slices are several of it apart; else None.

    Slices as thick as they are far apart leave nothing out, whatever is stated: some derive one from others.
    """
    stated, thickness = frames[0].stated_step, frames[0].thickness or 0.0
    least = float(distances.min())
    times = least / stated if stated else 0
    is_whole = abs(times - round(times)) <= ALIKE or times > MOST_TIMES
    if round(times) < 2 or not is_whole or thickness > THICK * least:
        return None
    return stated if frames[0].is_placed else None


def _lacks_numbers(frames: list[Frame], distances: Float64Array) -> bool:
    """Return whether InstanceNumber leaves out as many slices as thin ones leave space for, evenly.

    A series of several volumes counts all of them; this is for one that is alone.
    """
    thickness = frames[0].thickness
    numbers = [elements.numbers(frame.header.dataset, 0x00200013) for frame in frames]
    if not thickness or frames[0].pixels.frames > 1 or not all(numbers):
        return False
    steps = np.abs(np.diff([number[0] for number in numbers if number]))
    times = np.rint(distances / thickness)
    return bool((steps == times).all() and times.min() >= 2)


def _thin_told(frames: list[Frame], distances: Float64Array) -> list[Notice]:
    """Return a notice on slices that are thin enough to have others between."""
    thickness, least = frames[0].thickness or 0.0, float(distances.min())
    if not frames[0].is_placed or not 0 < thickness * MISSING <= least:
        return []
    sentence = (
        f"slices {_length(thickness)} mm thick at distances from {_length(least)} mm: others may be missing"
    )
    return [Notice("W-SLICES-MISSING", sentence)]


def _drift(frames: list[Frame], sideways: Float64Array, name: str) -> list[Notice]:
    """Refuse slices far beside the line through the first and the last; return warnings of nearer ones."""
    pixel = min(frames[0].spacing)
    worst = int(sideways.argmax())
    told = f"{frames[worst].name} lies {sideways[worst]:.3f} mm beside the line from first to last slice"
    if sideways[worst] > DRIFT_REFUSED * pixel:
        raise UnsupportedFormatError(
            f"{name}: {told}; expected slices along one line; choose a series whose slices are not shifted"
        )
    return [Notice("W-SLICES-SHIFTED", told)] if sideways[worst] > DRIFT_TOLD * pixel else []
