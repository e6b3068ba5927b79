"""Sort frames into stacks, each a volume: by series, size, orientation, and what tells copies apart.

Localizers, dose reports and other single images fall out by geometry: a volume has slices in at least
two places. Where several stacks are left, the user chooses.
"""

from collections.abc import Iterable

from dmc_cli.errors import AmbiguousVolumeError, SettingsError, VolumeError
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.factors import split_copies
from dmc_cli.volume_io.dicom.frames import Frame
from dmc_cli.volume_io.dicom.place import NO_POSITION
from dmc_cli.volume_io.dicom.segments import split_segments
from dmc_cli.volume_io.dicom.stack import Stack
from dmc_cli.volume_io.layout import index_range
from dmc_cli.volume_io.left_out import left_out

SAME_DIRECTION = 1e-3
"""Largest difference between direction cosines, or relative between spacings, within a stack."""


def stacks_of(frames: Iterable[Frame]) -> list[Stack]:
    """Return every stack with slices in at least two places, in the order of their numbers.

    Localizers are left out where there is anything else.
    """
    stacks: list[Stack] = []
    by_series: dict[tuple[object, ...], list[Stack]] = {}
    for frame in frames:
        # some scanners give a sign only to the slices that need one; a localizer may lie among the slices
        key = (_series_uid(frame), frame.pixels.shape, frame.pixels.dtype.itemsize, _is_localizer(frame))
        own = by_series.setdefault(key, [])
        stack = next((s for s in own if _is_parallel(s.frames[0], frame)), None)
        if stack is None:
            stack = _new_stack(frame)
            own.append(stack)
            stacks.append(stack)
        stack.frames.append(frame)
    for stack in stacks:
        stack.sort()
    parts = [part for stack in stacks for whole in split_segments(stack) for part in split_copies(whole)]
    volumes = [part for part in parts if part.place_count() > 1]
    images = [stack for stack in volumes if not all(map(_is_localizer, stack.frames))]
    found = sorted(images or volumes, key=lambda stack: (stack.series_number, _uid_key(stack.uid)))
    _name_apart(found)
    return found


def _name_apart(stacks: list[Stack]) -> None:
    """Describe stacks of one series that nothing else tells apart by how they lie, or by their number."""
    alike: dict[tuple[str, str], list[Stack]] = {}
    for stack in stacks:
        alike.setdefault((stack.uid, stack.description), []).append(stack)
    for group in alike.values():
        planes = [stack.plane() for stack in group]
        for number, (stack, plane) in enumerate(zip(group, planes, strict=True), 1):
            if len(group) > 1:
                words = plane if len(set(planes)) == len(group) else f"{plane}, {number} of {len(group)}"
                stack.description += f" ({words})"


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


def choose_stack(stacks: list[Stack], series: str | None, volume_index: int | None, name: str) -> Stack:
    """Return the stack that is chosen; the only one where nothing is.

    Args:
        stacks: All of them, in the order of their numbers.
        series: Number or SeriesInstanceUID, which several stacks may have.
        volume_index: Which of the stacks of one series, from 0.
        name: The input, for messages.

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
    if volume_index is not None and len({stack.uid for _, stack in chosen}) == 1:
        if not 0 <= volume_index < len(chosen):
            raise SettingsError(
                f"volume_index is {volume_index}; {name} has {len(chosen)} "
                f"volume{'s' if len(chosen) > 1 else ''} in the series; expected "
                f"{index_range(len(chosen))} (--volume-index):{_listed(chosen)}"
            )
        chosen = [chosen[volume_index]]
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


def _uid_key(uid: str) -> list[tuple[int, str]]:
    """Return a key that sorts the parts of a UID as the numbers that they are."""
    return [(len(part.lstrip("0")), part.lstrip("0")) for part in uid.split(".")]


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


def _is_localizer(frame: Frame) -> bool:
    return "LOCALIZER" in frame.labels.get("image type", "").upper()


ASK_ORDER = (
    "--slice-order instance, location or filename reads them in that order, at the distances of "
    "--spacing X,Y,Z"
)


def no_volume(name: str, reasons: list[str], singles: int) -> VolumeError:
    """Return the error of an input without a single volume, telling what was there instead."""
    if singles:
        told = f"; where their positions are wrong, {ASK_ORDER}" if singles > 1 else ""
        return VolumeError(
            f"{name}: {singles} DICOM image{'s' if singles > 1 else ''} found, but no two slices of one "
            "volume; "
            f"expected the slices of a series; give the folder that holds all of them{told}"
        )
    told = f" ({'; '.join(reasons[:3])})" if reasons else ""
    return VolumeError(
        f"{name}: no DICOM image found{told}; expected the slices of a CT or MR series; "
        + (ASK_ORDER if any(NO_POSITION in reason for reason in reasons) else "check the path")
    )
