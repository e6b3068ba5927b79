"""Split a stack whose images share places into volumes: what differs at one place is a factor.

Factors are found one after the other, in the order of `labels.py`, until no two images of a part lie in one
place. Their combinations are volumes to choose from.
"""

from collections.abc import Iterable
from dataclasses import replace
from itertools import groupby

from dmc_cli.volume_io.dicom.csa import csa_labels, csa_values
from dmc_cli.volume_io.dicom.frames import Frame
from dmc_cli.volume_io.dicom.labels import (
    DISCRIMINATORS,
    FRAME_DISCRIMINATORS,
    OBJECT,
    TIMES,
    TOLD_BESIDE,
    VALUE_TYPE,
    described,
    sort_key,
)
from dmc_cli.volume_io.dicom.philips import frame_labels
from dmc_cli.volume_io.dicom.repetitions import are_regular
from dmc_cli.volume_io.dicom.stack import Stack


def split_copies(stack: Stack) -> list[Stack]:
    """Return the stack, or one stack a combination of its factors, sorted by their values as numbers.

    What every place has all values of comes before what is told of some places only. Where no factor is
    found the images stay together.
    """
    parts, shared = _split(stack)
    if shared and _add_makers_labels(stack.frames):
        parts, _ = _split(stack)
    return [piece for part in parts for piece in _by_time(part)]


def _add_makers_labels(frames: list[Frame]) -> bool:
    """Add what long elements of the makers' own tell of frames to their labels; return whether they tell any.

    They are looked at only where nothing else tells images apart: it takes as long as all else.
    """
    told = [csa_labels(csa_values(frame.header)) | frame_labels(frame) for frame in frames]
    for frame, labels in zip(frames, told, strict=True):
        frame.labels.update(labels | {name: value for name, value in frame.labels.items() if value})
    return any(told)


def _split(stack: Stack) -> tuple[list[Stack], list[list[Frame]]]:
    """Return the parts of a stack by the factors that are found, and the frames of places that still share.

    Without a factor the stack is the only part.
    """
    parts = [stack]
    shared = _shared_places(parts)
    candidates = _candidates(stack.frames) if shared else []
    factors: list[str] = []
    for everywhere in (True, False):
        for name in candidates:
            if not any(_differs(frames, name) for frames in shared):
                continue
            split = [(_parted(part, name), part.place_count() if everywhere else None) for part in parts]
            if all(_is_volume(piece, count) for pieces, count in split for piece in pieces):
                parts = [piece for pieces, _ in split for piece in pieces]
                factors.append(name)
                shared = _shared_places(parts)
    if factors:
        factors.sort(key=candidates.index)
        parts.sort(key=lambda part: [sort_key(_value(part.frames[0], name)) for name in factors])
        parts = _named(parts, factors, [name for name in candidates if name in TOLD_BESIDE])
    return parts, shared


def _is_volume(piece: Stack, count: int | None) -> bool:
    """Return whether a stack has several places, as many as `count` if it is given."""
    own = piece.place_count()
    return own > 1 and count in (None, own)


def _candidates(frames: Iterable[Frame]) -> list[str]:
    """Return the labels of frames, in the order in which they are tried, each once."""
    told = dict.fromkeys(name for frame in frames for name in frame.labels)
    first = (*FRAME_DISCRIMINATORS, *DISCRIMINATORS)
    last = (VALUE_TYPE, OBJECT)
    others = [name for name in told if name not in (*first, *last)]
    return [name for name in dict.fromkeys((*first, *others, *last)) if name in told]


def _value(frame: Frame, name: str) -> str:
    return frame.labels.get(name, "")


def _shared_places(parts: list[Stack]) -> list[list[Frame]]:
    """Return the frames of each place of a part that holds several."""
    return [frames for part in parts for frames in part.by_place() if len(frames) > 1]


def _differs(frames: list[Frame], name: str) -> bool:
    """Return whether frames have several values of a label."""
    first = _value(frames[0], name)
    return any(_value(frame, name) != first for frame in frames)


def _parted(stack: Stack, name: str) -> list[Stack]:
    """Return a stack for each value of a label."""
    numbers: dict[str, list[int]] = {}
    for number, frame in enumerate(stack.frames):
        numbers.setdefault(_value(frame, name), []).append(number)
    # the stacks of an object are volumes of their own, each with places of its own
    places = () if name == "stack" else stack.all_places or stack.different_places()
    return [stack.part(own, places) for own in numbers.values()]


def _named(parts: list[Stack], factors: list[str], beside: list[str]) -> list[Stack]:
    """Return parts described by their factors, and by what else each has one value of, not all the same."""
    values = {name: [{_value(frame, name) for frame in part.frames} for part in parts] for name in beside}
    told = [*factors, *(name for name, found in values.items() if _is_factor(found) and name not in factors)]
    named = []
    for part in parts:
        words = [described(name, _value(part.frames[0], name)) for name in told]
        description = ", ".join(filter(None, words)) or f"no {factors[0]}"
        named.append(replace(part, description=f"{part.description} ({description})"))
    return named


def _is_factor(values: list[set[str]]) -> bool:
    """Return whether each part has one value, and not all the same."""
    return all(len(found) == 1 for found in values) and len(set().union(*values)) > 1


def _by_time(part: Stack) -> list[Stack]:
    """Return the part, or its repetitions where each place has the same number of them at different times."""
    places = part.by_place()
    count = len(places[0])
    if count < 2 or any(len(frames) != count for frames in places):
        return [part]
    for name in TIMES:
        ordered = [sorted(frames, key=lambda frame: sort_key(_value(frame, name))) for frames in places]
        if all(
            len(list(groupby(frames, key=lambda frame: _value(frame, name)))) == count for frames in ordered
        ) and are_regular([[_value(frame, name) for frame in frames] for frames in ordered], name):
            return [
                _repetition(part, [frames[n] for frames in ordered], name, n, count) for n in range(count)
            ]
    return [part]


def _repetition(part: Stack, frames: list[Frame], name: str, n: int, count: int) -> Stack:
    """Return the stack of one frame a place, the n-th of so many by the time of that name."""
    numbers = {frame: number for number, frame in enumerate(part.frames)}
    own = part.part([numbers[frame] for frame in frames], part.all_places)
    own.description += f" ({name}, {n + 1} of {count} at each place)"
    return own
