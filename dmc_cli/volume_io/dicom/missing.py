"""Find slices that are missing between those of a volume, or may be, by all that a file tells.

A gap among the distances, slices of other volumes there and stated distances leave no doubt, and a choice to
the user. Numbers and thicknesses do: they are told, and `--strict` refuses them.
"""

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import AmbiguousVolumeError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.distances import ALIKE, MISSING, MOST_TIMES, gaps, shared_distance
from dmc_cli.volume_io.dicom.frames import Frame
from dmc_cli.volume_io.dicom.stack import Stack

THICK = 0.75
"""Slices thicker than this many times their distance leave nothing out."""


def missing_told(
    frames: list[Frame], places: Float64Array, stack: Stack, settings: ReadSettings, name: str
) -> list[Notice]:
    """Refuse distances that look like a missing slice, or return notices on them, as the settings say.

    Raises:
        AmbiguousVolumeError: Slices are missing, and nothing says to do without.
    """
    distances = np.diff(places)
    relative = distances / _thick_as(frames)
    found = _unfilled(distances, relative)
    stated = _finer_distance(frames, distances)
    others, between_them, beyond = _places_of_others(frames, places, stack)
    doubts = [
        f"{beyond} place(s) beyond the ends of this volume have slices of other volumes of the series"
    ] * (beyond > 0)
    count = len(found)
    if found:
        count = _slices_in(relative[found], float(np.median(np.delete(relative, found))))
        elsewhere = f"{length_text(np.median(np.delete(distances, found)))} mm elsewhere"
    elif others:
        found, count = others, between_them
        elsewhere = "other volumes of the series have slices there"
    elif stated:
        found, count = list(range(len(distances))), _slices_in(distances, stated)
        elsewhere = f"SpacingBetweenSlices is {length_text(stated)} mm"
    elif not stack.all_places and _lacks_numbers(frames, distances):
        found, count = list(range(len(distances))), _slices_in(distances, frames[0].thickness or 0.0)
        elsewhere = "InstanceNumber leaves as many out, and slices are as thin as if they were there"
    else:
        doubts += _thin(frames, distances) or _counted_by_more(frames, distances, stack)
        return doubts_told(doubts, settings)
    told = f"{between(frames, distances, found[0])}, {elsewhere}"
    if settings.slice_gaps == "refuse":
        raise AmbiguousVolumeError(
            f"{name}: {count} missing slice{'s' if count > 1 else ''} found: {told}; expected a "
            "complete series; "
            "get the missing files, or bridge the gap with --slice-gaps keep"
        )
    return [Notice("W-SLICES-MISSING", f"slices are missing: {told}"), *doubts_told(doubts, settings)]


def doubts_told(sentences: list[str], settings: ReadSettings) -> list[Notice]:
    """Return notices on slices that may be missing; who says what to do about gaps has no doubt."""
    code = "W-SLICES-DOUBTFUL" if settings.slice_gaps == "refuse" else "W-SLICES-MISSING"
    return [Notice(code, f"{sentence}; --slice-gaps keep takes them as they are") for sentence in sentences]


def _thick_as(frames: list[Frame]) -> Float64Array | float:
    """Return how thick slices are, halfway between neighbours; 1 where it is not known, or the same for all.

    A head is often thin below and thick above. Slices that are all of one thickness may overlap.
    """
    thicknesses = np.array([frame.thickness or 0.0 for frame in frames])
    if thicknesses.min() <= 0 or np.ptp(thicknesses) == 0:
        return 1.0
    halfway: Float64Array = (thicknesses[:-1] + thicknesses[1:]) / 2
    return halfway


def _unfilled(distances: Float64Array, relative: Float64Array) -> list[int]:
    """Return those of the gaps that thicker slices do not fill; relative distances are in thicknesses."""
    wide = set(gaps(relative))
    return [n for n in gaps(distances) if n in wide]


def _slices_in(distances: Float64Array, step: float) -> int:
    """Return how many slices, a step apart, are missing within distances; one in each at least."""
    return int(np.maximum(np.rint(distances / step) - 1, 1).sum())


def _places_of_others(frames: list[Frame], places: Float64Array, stack: Stack) -> tuple[list[int], int, int]:
    """Return the numbers of the distances within which other volumes of the series have slices.

    With them come how many places these are, and how many others have beyond the ends. Thick slices leave
    nothing out between.
    """
    others = np.array(stack.all_places)
    if len(others) <= len(places):
        return [], 0, 0
    # a quarter of a distance off: others may lie a little beside
    usual = shared_distance(places, copies=False)
    reach = usual / 4
    within = np.searchsorted(places, others)
    inside = (within > 0) & (within < len(places))
    nearest = np.minimum(
        np.abs(others - places[(within - 1).clip(0)]),
        np.abs(others - places[within.clip(0, len(places) - 1)]),
    )
    beyond = int(((nearest > reach) & ~inside).sum())
    if (frames[0].thickness or 0.0) > THICK * float(np.diff(places).min()):
        return [], 0, beyond
    missing = (nearest > reach) & inside
    # one place, a little beside, in each of the others
    count = 1 + int((np.diff(np.sort(others[missing])) > ALIKE * usual).sum())
    return sorted(set((within[missing] - 1).tolist())), count, beyond


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
    thickness, steps = frames[0].thickness, _number_steps(frames)
    if not thickness or steps is None:
        return False
    times = np.rint(distances / thickness)
    return bool((steps == times).all() and times.min() >= 2)


def _number_steps(frames: list[Frame]) -> Float64Array | None:
    """Return the distances between InstanceNumbers of neighbours; None where frames do not have one each."""
    numbers = [elements.numbers(frame.header.dataset, 0x00200013) for frame in frames]
    if frames[0].pixels.frames > 1 or not all(numbers):
        return None
    steps: Float64Array = np.abs(np.diff([number[0] for number in numbers if number]))
    return steps


def _thin(frames: list[Frame], distances: Float64Array) -> list[str]:
    """Return a sentence on slices that are thin enough to have others between."""
    thickness, least = frames[0].thickness or 0.0, float(distances.min())
    if not frames[0].is_placed or not 0 < thickness * MISSING <= least:
        return []
    told = f"slices {length_text(thickness)} mm thick at distances from {length_text(least)} mm"
    return [f"{told}: others may be missing"]


def _counted_by_more(frames: list[Frame], distances: Float64Array, stack: Stack) -> list[str]:
    """Return a sentence on slices of an unknown thickness whose numbers have others between, evenly."""
    steps = None if stack.all_places or frames[0].thickness else _number_steps(frames)
    if steps is None or len(steps) < 2 or steps.min() < 2 or np.ptp(steps) > 0:
        return []
    return [f"InstanceNumber counts by {steps[0]:g}: slices of the numbers between may be missing"]


def between(frames: list[Frame], distances: Float64Array, n: int) -> str:
    """Return a text with distance n and the files that it lies between."""
    return f"{length_text(distances[n])} mm between {frames[n].name} and {frames[n + 1].name}"


def length_text(millimetres: float) -> str:
    """Return a length with three decimals, or more where these would not tell it."""
    return f"{millimetres:.3f}" if millimetres == 0 or millimetres >= 0.1 else f"{millimetres:.3g}"
