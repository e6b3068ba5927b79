"""Read what Philips keeps in elements of its own: a sequence of each frame, and a scale of values.

Stored values become display values by the standard's rescale, and floating-point values, which alone are
comparable between scans, by the maker's scale: (stored value - intercept) / slope.
"""

from typing import Any

from dmc_cli.notices import Notice
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.frames import Frame
from dmc_cli.volume_io.dicom.labels import image_labels
from dmc_cli.volume_io.dicom.makers import BLOCKS, PHILIPS, PHILIPS_FRAMES, PHILIPS_GROUP, PHILIPS_SCALE

OWN_ELEMENTS = 0x0F
"""The sequence of a frame's own elements, in a block of `PHILIPS_FRAMES`."""

SAME = 1e-4
"""Largest relative difference of a scale from the standard's that is not told."""


def frame_labels(frame: Frame) -> dict[str, str]:
    """Return what the maker's sequence of a frame tells, as elements of a single image would."""
    found: dict[str, str] = {}
    for item in _own_elements(frame.group):
        found.update(image_labels(item))
    return found


def scale_told(frames: list[Frame]) -> list[Notice]:
    """Return a notice on scales of the maker's that values are not brought to."""
    found: dict[tuple[float, float], Frame] = {}
    for frame in frames:
        scale = _scale(frame)
        if scale is not None and not _is_rescale(scale, frame):
            found.setdefault(scale, frame)
    if not found:
        return []
    (slope, intercept), *others = found
    more = f", and {len(others)} other scale(s) in other slices" if others else ""
    sentence = (
        f"a scale of the maker's own found (2005,100E and 100D): floating-point values are (stored value - "
        f"{intercept:g}) / {slope:g}{more}; it is not applied: values are those of the standard's rescale"
    )
    return [Notice("W-VALUES-MAPPED", sentence)]


def _own_elements(group: Any) -> list[Any]:
    """Return the maker's elements of a frame, from its functional group."""
    found = []
    for block in BLOCKS:
        creator = PHILIPS_GROUP << 16 | block
        if elements.text(group, creator) == PHILIPS_FRAMES:
            found += elements.items(group, PHILIPS_GROUP << 16 | block << 8 | OWN_ELEMENTS)
    return found


def _scale(frame: Frame) -> tuple[float, float] | None:
    """Return slope and intercept of the maker's scale, or None where there is none."""
    for holder in (*_own_elements(frame.group), frame.header.dataset):
        for block in BLOCKS:
            if elements.text(holder, PHILIPS_GROUP << 16 | block) == PHILIPS:
                tags = (PHILIPS_GROUP << 16 | block << 8 | number for number in PHILIPS_SCALE)
                slope, intercept = (elements.numbers(holder, tag) or [0.0] for tag in tags)
                if slope[0]:
                    return slope[0], intercept[0]
    return None


def _is_rescale(scale: tuple[float, float], frame: Frame) -> bool:
    """Return whether the maker's scale is the standard's."""
    slope, intercept = scale
    is_same_slope = abs(slope * frame.slope - 1) <= SAME
    return is_same_slope and abs(intercept * frame.slope + frame.intercept) <= SAME * max(1, abs(intercept))
