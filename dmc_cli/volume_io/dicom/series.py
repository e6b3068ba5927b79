"""Sort frames into stacks, each a volume: by series, size, orientation, and what tells copies apart.

Localizers, dose reports and other single images fall out by geometry: a volume has slices in at least
two places. Where several stacks are left, the user chooses.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from dmc_cli.errors import AmbiguousVolumeError, SettingsError, VolumeError
from dmc_cli.volume import VolumeEntry
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.frames import DISCRIMINATORS, FRAME_DISCRIMINATORS, VALUE_TYPE, Frame
from dmc_cli.volume_io.dicom.left_out import left_out

SAME_PLACE_MM = 0.01
"""Slices closer than this are duplicates."""

SAME_DIRECTION = 1e-3
"""Largest difference between direction cosines, or relative between spacings, within a stack."""


@dataclass(eq=False)
class Stack:
    """Frames of one series with the same size and orientation.

    Attributes:
        uid: SeriesInstanceUID.
        series_number: The scanner's own number, for the order only.
        description: SeriesDescription, and what tells this stack from others of the series.
        modality: CT, MR, ...
        frames: Its frames, in the order of their positions along the normal once sorted.
    """

    uid: str
    series_number: int
    description: str
    modality: str
    frames: list[Frame] = field(default_factory=list)

    def places(self) -> list[float]:
        """Return the position of each frame along the normal in millimetres, in the frames' order."""
        orientation = np.array(self.frames[0].orientation)
        normal = np.cross(orientation[:3], orientation[3:])
        return [float(normal @ np.array(frame.position)) for frame in self.frames]

    def entry(self, number: int) -> VolumeEntry:
        """Return the stack as `dmc info` lists it."""
        columns, rows = self.frames[0].pixels.shape
        return VolumeEntry(
            number=number,
            description=self.description,
            modality=self.modality,
            size=(columns, rows, len(self.frames)),
            uid=self.uid,
        )


def stacks_of(frames: Iterable[Frame]) -> list[Stack]:
    """Return every stack with slices in at least two places, in the order of their numbers.

    Localizers are left out where there is anything else.
    """
    stacks: list[Stack] = []
    by_series: dict[tuple[object, ...], list[Stack]] = {}
    for frame in frames:
        # some scanners give a sign only to the slices that need one
        key = (_series_uid(frame), frame.pixels.shape, frame.pixels.dtype.itemsize)
        own = by_series.setdefault(key, [])
        stack = next((s for s in own if _is_parallel(s.frames[0], frame)), None)
        if stack is None:
            stack = _new_stack(frame)
            own.append(stack)
            stacks.append(stack)
        stack.frames.append(frame)
    for stack in stacks:
        _sort(stack)
    volumes = [part for stack in stacks for part in _split_copies(stack) if _place_count(part) > 1]
    images = [stack for stack in volumes if not all(map(_is_localizer, stack.frames))]
    return sorted(images or volumes, key=lambda stack: (stack.series_number, stack.uid))


def put_aside(frames: Iterable[Frame], stacks: list[Stack], chosen: Stack, series: str | None) -> list[str]:
    """Return sentences on the images that are in no stack, of the chosen series where there is one."""
    used = {frame for stack in stacks for frame in stack.frames}
    localizers: list[str] = []
    others: list[str] = []
    singles: list[str] = []
    for frame in frames:
        is_own = _series_uid(frame) == chosen.uid
        if frame in used or (series is not None and not is_own):
            continue
        (localizers if _is_localizer(frame) else others if is_own else singles).append(frame.name)
    unlike = "of another orientation, spacing, size or type"
    alone = "of a series without a volume"
    return [
        *left_out(localizers, "localizer", "localizers"),
        *left_out(others, f"image {unlike}", f"images {unlike}"),
        *left_out(singles, f"image {alone}", f"images {alone}"),
    ]


def choose_stack(stacks: list[Stack], series: str | None, name: str) -> Stack:
    """Return the stack that `series` names, by number or SeriesInstanceUID; the only one where it is None.

    Raises:
        AmbiguousVolumeError: Several are left.
        SettingsError: None is.
    """
    numbered = list(enumerate(stacks, 1))
    chosen = numbered
    if series is not None:
        chosen = [(n, stack) for n, stack in numbered if series in (str(n), stack.uid)]
        if not chosen:
            raise SettingsError(
                f"series is {series!r}; {name} has {_listed(numbered)}; choose with --series N"
            )
    if len(chosen) > 1:
        raise AmbiguousVolumeError(
            f"{name}: {len(chosen)} series found; expected one; choose with --series N:{_listed(chosen)}"
        )
    return chosen[0][1]


def _listed(numbered: list[tuple[int, Stack]]) -> str:
    """Return one line a stack: number, what it is, size, UID."""
    lines = []
    for number, stack in numbered:
        entry = stack.entry(number)
        size = " x ".join(map(str, entry.size))
        lines.append(
            f"\n  --series {number}: {entry.modality} {entry.description!r}, {size}, UID {entry.uid}"
        )
    return "".join(lines)


def _series_uid(frame: Frame) -> str:
    return elements.text(frame.header.dataset, 0x0020000E)


def _is_parallel(one: Frame, other: Frame) -> bool:
    pairs = zip(one.orientation, other.orientation, strict=True)
    if any(abs(a - b) > SAME_DIRECTION for a, b in pairs):
        return False
    return all(abs(a - b) <= SAME_DIRECTION * a for a, b in zip(one.spacing, other.spacing, strict=True))


def _new_stack(frame: Frame) -> Stack:
    dataset = frame.header.dataset
    number = elements.text(dataset, 0x00200011)
    return Stack(
        uid=_series_uid(frame),
        series_number=int(number) if number.isdecimal() and len(number) < 10 else 0,
        description=elements.text(dataset, 0x0008103E),
        modality=elements.text(dataset, 0x00080060),
    )


def _sort(stack: Stack) -> None:
    """Order the frames by place, then by name and number."""
    keys = [
        (place, frame.header.file.name, frame.index)
        for place, frame in zip(stack.places(), stack.frames, strict=True)
    ]
    order = sorted(range(len(keys)), key=keys.__getitem__)
    stack.frames = [stack.frames[n] for n in order]


def _place_count(stack: Stack) -> int:
    """Return the number of different places."""
    places = stack.places()
    return 1 + sum(b - a >= SAME_PLACE_MM for a, b in pairwise(places))


def _is_localizer(frame: Frame) -> bool:
    return "LOCALIZER" in frame.labels.get("image type", "").upper()


def _split_copies(stack: Stack) -> list[Stack]:
    """Return the stack, or one stack a value of what tells all its copies at the same places apart."""
    if _place_count(stack) == len(stack.frames):
        return [stack]
    for label in (*FRAME_DISCRIMINATORS, *DISCRIMINATORS, VALUE_TYPE):
        parts = _parted(stack, lambda frame, label=label: frame.labels.get(label, ""))  # type: ignore[misc]
        complete = [part for part in parts if _place_count(part) == len(part.frames) > 1]
        if len(parts) > 1 and len(complete) == len(parts):
            return [
                replace(part, description=f"{stack.description} ({label} {part.frames[0].labels.get(label)})")
                for part in parts
            ]
    return [stack]


def _parted(stack: Stack, label_of: Callable[[Frame], str]) -> list[Stack]:
    parts: dict[str, Stack] = {}
    for frame in stack.frames:
        label = label_of(frame)
        if label not in parts:
            parts[label] = replace(stack, frames=[])
        parts[label].frames.append(frame)
    return [parts[label] for label in sorted(parts)]


def no_volume(name: str, reasons: list[str], singles: int) -> VolumeError:
    """Return the error of an input without a single volume, telling what was there instead."""
    if singles:
        return VolumeError(
            f"{name}: {singles} DICOM image{'s' if singles > 1 else ''} found, but no two slices of one "
            "volume; "
            "expected the slices of a series; give the folder that holds all of them"
        )
    told = f" ({'; '.join(reasons[:3])})" if reasons else ""
    return VolumeError(
        f"{name}: no DICOM image found{told}; expected the slices of a CT or MR series; check the path"
    )
