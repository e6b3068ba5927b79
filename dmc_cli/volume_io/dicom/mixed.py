"""Tell slices of one volume whose values do not mean the same."""

from dmc_cli.notices import Notice
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.frames import Frame

MOST_KINDS = 5
"""Kinds of values that a message names."""


def mixed_told(frames: list[Frame]) -> list[Notice]:
    """Return warnings on slices whose values are scaled, or measured, otherwise than others."""
    return [*_scales_told(frames), *_kinds_told(frames)]


def _kinds_told(frames: list[Frame]) -> list[Notice]:
    """Return a warning where slices say that their values are measured in different things."""
    kinds: dict[str, list[str]] = {}
    for frame in frames:
        if not frame.is_blank:
            kinds.setdefault(frame.kind_of_values, []).append(frame.name)
    if len(kinds) < 2:
        return []
    found = ", ".join(
        f"{kind[:16]!r} in {len(names)}, first {names[0]}" for kind, names in list(kinds.items())[:MOST_KINDS]
    )
    sentence = (
        f"values measured in different things found among {len(frames)} slices ({found}; Rescale Type or "
        "Modality LUT Type, CT's without one is HU); expected one; they are taken as if they were the same"
    )
    return [Notice("W-RESCALE-UNKNOWN", sentence)]


def _scales_told(frames: list[Frame]) -> list[Notice]:
    """Return a warning where some slices tell a rescale and others, which then are stored values, none."""
    singles = [frame for frame in frames if frame.pixels.frames == 1 and frame.lookup is None]
    without = [frame for frame in singles if not _tells_scale(frame)]
    others = {(frame.slope, frame.intercept) for frame in singles if frame not in without}
    if not without or others <= {(1.0, 0.0)}:
        return []
    sentence = (
        f"no RescaleSlope and RescaleIntercept found in {len(without)} of {len(frames)} slices, first "
        f"{without[0].name}, that others have; the values of these slices are the stored ones"
    )
    return [Notice("W-RESCALE-UNKNOWN", sentence)]


def _tells_scale(frame: Frame) -> bool:
    dataset = frame.header.dataset
    return any(elements.numbers(dataset, tag, 1) for tag in (0x00281052, 0x00281053, 0x3004000E))
