"""Put the slices of series without positions in the order that the user asks for, at distances he gives.

Numbers and names tell an order, never where a slice lies nor on which side the first one is: the volume
has no space.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from dmc_cli.errors import AmbiguousVolumeError, SettingsError, VolumeError
from dmc_cli.notices import Notice, notices
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.distances import ALIKE, shared_distance
from dmc_cli.volume_io.dicom.frames import Frame
from dmc_cli.volume_io.dicom.labels import DISCRIMINATORS, FRAME_DISCRIMINATORS, SEGMENT, TIMES
from dmc_cli.volume_io.dicom.place import other_spacings

Key = tuple[float | str, ...]

FACTORS = sorted({*DISCRIMINATORS, *FRAME_DISCRIMINATORS, SEGMENT} - set(TIMES) | {"temporal position"})
"""What separates volumes without a look at places: no times, which differ from slice to slice."""

NO_POSITIONS = "the file tells no positions of its frames; order and axes are the grid's own"

SAME_LENGTH = 0.01
"""Largest relative difference between a length that the user gave and one of the file that is not told."""


def check_order(settings: ReadSettings, name: str) -> None:
    """Raise SettingsError for an order without distances."""
    if settings.slice_order != "position" and settings.spacing is None:
        raise SettingsError(
            f"slice_order is {settings.slice_order!r}, but no spacing is given; {name} is then read without "
            "positions; give the distances between its nodes with --spacing X,Y,Z"
        )


def ordered_frames(frames: list[Frame], settings: ReadSettings, name: str) -> list[Frame]:
    """Return the frames of each series and size one after the other along z, in the order that is asked for.

    Raises:
        VolumeError: A slice does not tell what the order goes by.
        AmbiguousVolumeError: Two slices tell the same.
    """
    assert settings.spacing is not None
    key_of = KEYS[settings.slice_order]
    groups: dict[tuple[object, ...], list[tuple[Key, Frame]]] = {}
    for frame in frames:
        series = elements.text(frame.header.dataset, 0x0020000E)
        group = (series, frame.pixels.shape, frame.pixels.dtype.itemsize)
        groups.setdefault(group, []).append((key_of(frame, name), frame))
    placed = []
    for slices in _apart(groups.values()):
        slices.sort(key=lambda pair: pair[0])
        counted = _counted([key for key, _ in slices], settings.slice_order)
        for number, (key, frame) in enumerate(slices):
            if number and key == slices[number - 1][0]:
                raise AmbiguousVolumeError(
                    f"{name}: {slices[number - 1][1].name} and {frame.name} have the same "
                    f"{settings.slice_order}; expected another one for each slice; choose another "
                    "--slice-order"
                )
            placed.append(replace(frame, position=(0.0, 0.0, counted[number] * settings.spacing[2])))
    return placed


def _counted(keys: list[Key], order: str) -> list[float]:
    """Return the number of each slice along z, those counted that keys leave out, which are gaps then.

    Keys that are not whole steps apart tell nothing of missing ones.
    """
    numbers = np.array([key[0] for key in keys] if order != "filename" else [], np.float64)
    steps = np.diff(numbers)
    step = shared_distance(numbers, copies=False) if order == "location" else steps.min(initial=np.inf)
    times = np.rint(steps / step) if len(steps) and step > 0 else np.zeros(0)
    if len(times) == 0 or times.min() < 1 or np.abs(steps / step - times).max() > ALIKE:
        return [float(number) for number in range(len(keys))]
    return [0.0, *np.cumsum(times).tolist()]


def _apart(groups: Iterable[list[tuple[Key, Frame]]]) -> Iterator[list[tuple[Key, Frame]]]:
    """Yield the slices of each group, or of each combination of values that as many slices have as any other.

    Echoes and phases are volumes each, in the same places; `factors.py` names them.
    """
    for slices in groups:
        factors = []
        for name in FACTORS:
            counts = Counter(frame.labels.get(name, "") for _, frame in slices)
            if len(counts) > 1 and len(set(counts.values())) == 1 and len(slices) > len(counts):
                factors.append(name)
        parts: dict[tuple[str, ...], list[tuple[Key, Frame]]] = {}
        for pair in slices:
            parts.setdefault(tuple(pair[1].labels.get(name, "") for name in factors), []).append(pair)
        yield from parts.values()


def order_told(frames: list[Frame], settings: ReadSettings) -> list[Notice]:
    """Return notices on what is not known of slices without a place, and on what contradicts the user."""
    if settings.slice_order == "position":
        return _placed_told(frames, settings) if frames[0].is_placed else _unplaced_told(frames[0], settings)
    told = Notice(
        "W-POSITION-MISSING",
        f"slices follow each other by {settings.slice_order} at the distances of --spacing; on which "
        "side the first one lies is not known: the mesh may be a mirror image",
    )
    ends = [elements.numbers(frame.header.dataset, 0x00201041) or [] for frame in (frames[0], frames[-1])]
    step = abs(ends[1][0] - ends[0][0]) / (len(frames) - 1) if all(ends) else None
    return [told, *_preferred(settings, frames[0], step, "their SliceLocation has {} mm on average")]


def _preferred(settings: ReadSettings, frame: Frame, step: float | None, file_has: str) -> list[Notice]:
    """Return notices where --spacing counts and the file has other distances.

    Args:
        settings: How to read.
        frame: A frame, for its pixels.
        step: The file's distance of slices, or None.
        file_has: A sentence on that, with {} in its place.
    """
    if settings.spacing is None:
        return []
    x, y, z = settings.spacing
    rows, columns = frame.stated_spacing or (y, x)
    others = []
    if not (_is_near(columns, x) and _is_near(rows, y)):
        others.append(f"--spacing has pixels of {x:g} x {y:g} mm, the file of {columns:g} x {rows:g} mm")
    if step is not None and not _is_near(step, z):
        others.append(f"--spacing has slices at {z:g} mm, {file_has.format(f'{step:g}')}")
    return notices("W-OPTION-PREFERRED", others)


def _placed_told(frames: list[Frame], settings: ReadSettings) -> list[Notice]:
    """Return a notice where --spacing, given for pixels alone, has slices elsewhere than their positions."""
    if settings.spacing is None or all(frame.stated_spacing for frame in frames):
        return []
    ends = np.array(frames[-1].position) - np.array(frames[0].position)
    step, told = float(np.linalg.norm(ends)) / (len(frames) - 1), settings.spacing[2]
    if _is_near(step, told):
        return []
    sentence = f"--spacing has slices at {told:g} mm, their positions {step:g} mm on average, which are taken"
    return [Notice("W-OPTION-UNUSED", sentence)]


def _unplaced_told(frame: Frame, settings: ReadSettings) -> list[Notice]:
    """Return notices on frames whose file tells no positions, and on distances that it lacks besides."""
    dataset = frame.header.dataset
    step = elements.numbers(dataset, 0x00180088) or elements.numbers(dataset, 0x00180050)
    locations = elements.numbers(dataset, 0x00182005)
    if locations and len(locations) > 1:
        step = [(locations[-1] - locations[0]) / (len(locations) - 1)]
    told = [Notice("W-POSITION-MISSING", NO_POSITIONS)]
    if settings.spacing is not None:
        return [*told, *_preferred(settings, frame, abs(step[0]) if step else None, "the file {} mm")]
    lacking = [] if frame.stated_spacing else ["of pixels"]
    lacking += [] if step else ["of frames"]
    if lacking:
        others = other_spacings(dataset) if frame.stated_spacing is None else ""
        sentence = (
            f"the file tells no distances {' and '.join(lacking)}{f', only {others}' if others else ''}"
        )
        shape = "1 mm is taken" if frame.spacing[0] == frame.spacing[1] else "pixels 1 mm wide are taken"
        sentence += f"; {shape}; --spacing gives them"
        told.append(Notice("W-SPACING-MISSING", sentence))
    return told


def _is_near(one: float, other: float) -> bool:
    return abs(one - other) <= SAME_LENGTH * other


def _by_instance(frame: Frame, name: str) -> Key:
    return *_number(frame, 0x00200013, "InstanceNumber", name), frame.index


def _by_location(frame: Frame, name: str) -> Key:
    return _number(frame, 0x00201041, "SliceLocation", name)


def _by_filename(frame: Frame, _name: str) -> Key:
    """Return a key that sorts numbers in names as numbers."""
    parts = re.split(r"(\d+)", frame.header.file.name)
    numbered = (part.zfill(20) if n % 2 else part for n, part in enumerate(parts))
    return *numbered, frame.header.file.name, float(frame.index)


def _number(frame: Frame, tag: int, element: str, name: str) -> tuple[float]:
    found = elements.numbers(frame.header.dataset, tag)
    if not found:
        raise VolumeError(
            f"{name}: {frame.name} has no {element}; expected one in every slice; choose another "
            "--slice-order"
        )
    return (found[0],)


KEYS: dict[str, Callable[[Frame, str], Key]] = {
    "instance": _by_instance,
    "location": _by_location,
    "filename": _by_filename,
}
