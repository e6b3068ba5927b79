"""Find what the frames of a file without functional groups are: slices, or times, views and tiles.

FrameIncrementPointer names the elements whose values differ from frame to frame (PS3.3, C.7.6.6).
"""

from dataclasses import dataclass
from typing import Any

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.place import NoSlice

TIMES = {0x00181063: "FrameTime", 0x00181065: "FrameTimeVector"}
VIEWS = {
    0x00540050: "RotationVector",
    0x00540090: "AngularViewVector",
    0x00182003: "FramePrimaryAngleVector",
    0x00182004: "FrameSecondaryAngleVector",
    0x00181520: "PositionerPrimaryAngleIncrement",
    0x00181521: "PositionerSecondaryAngleIncrement",
}
PAGES = {0x00182001: "PageNumberVector", 0x00182002: "FrameLabelVector"}
PLACES = (0x00182005, 0x3004000C, 0x00200032, 0x00200037, 0x00201041, 0x00180088, 0x00540080)
"""Elements that tell where frames lie."""

NUCLEAR = "1.2.840.10008.5.1.4.1.1.20"
RECONSTRUCTED = ("RECON TOMO", "RECON GATED TOMO")
"""The third value of a nuclear medicine image's type where its frames are slices."""

SLICES = 0x00540080
FACTORS = {
    0x00540010: "energy window",
    0x00540020: "detector",
    0x00540030: "phase",
    0x00540060: "R-R interval",
    0x00540070: "time slot",
    0x00540100: "time slice",
}
"""Vectors of nuclear medicine: a number a frame each."""

MOST_DETECTORS = 64
"""More than any camera has."""

PLANAR = {
    "1.2.840.10008.5.1.4.1.1.3": "ultrasound",
    "1.2.840.10008.5.1.4.1.1.3.1": "ultrasound",
    "1.2.840.10008.5.1.4.1.1.6.1": "ultrasound",
    "1.2.840.10008.5.1.4.1.1.12.1": "X-ray angiography",
    "1.2.840.10008.5.1.4.1.1.12.2": "X-ray fluoroscopy",
}
"""Kinds of images whose frames are times of one plane."""

SLIDE = "1.2.840.10008.5.1.4.1.1.77.1.6"


@dataclass(frozen=True)
class Increments:
    """How frames follow each other.

    Attributes:
        offsets: Each frame's distance from the first along the normal; None where no positions are told.
        order: Each frame's number along the normal, from 0.
        labels: What may tell apart frames at the same place, one a frame.
        heights: Each frame's distance from the first where no positions are told, if that is.
    """

    offsets: list[float] | None
    order: list[int]
    labels: list[dict[str, str]]
    heights: list[float] | None = None


def placed_alone(count: int) -> Increments:
    """Return the increments of frames each of which tells its own place."""
    return Increments([0.0] * count, list(range(count)), [{}] * count)


def detectors_of(dataset: Any) -> list[Any]:
    """Return what is told of each detector of nuclear medicine; none of other images."""
    return elements.items(dataset, 0x00540022, MOST_DETECTORS)


def refuse_tiles(dataset: Any) -> None:
    """Raise NoSlice for a whole-slide image: its frames lie side by side."""
    kind = elements.text(dataset, 0x00209311)
    whole, own = (elements.integer(dataset, tag) for tag in (0x00480006, 0x00280011))
    if kind.startswith("TILED") or elements.text(dataset, 0x00080016) == SLIDE or (whole and whole != own):
        raise NoSlice("its frames are tiles of a whole-slide image, no slices")


def frame_increments(dataset: Any, count: int) -> Increments:
    """Return how the frames of a file without functional groups follow each other.

    Raises:
        NoSlice: They are no slices.
        DamagedVolumeError: A vector has not as many values as there are frames.
    """
    if count == 1:
        return placed_alone(count)
    pointed = elements.tags(dataset, 0x00280009)
    if not pointed:
        # vectors that nothing points at still tell what differs
        pointed = [
            tag for tag in (*FACTORS, SLICES, *VIEWS) if len(elements.numbers(dataset, tag) or []) == count
        ]
    _refuse_others(dataset, count, pointed)
    vectors = {tag: _vector(dataset, tag, count) for tag in (*FACTORS, SLICES) if tag in pointed}
    labels = [
        {FACTORS[tag]: f"{values[n]:g}" for tag, values in vectors.items() if tag != SLICES}
        for n in range(count)
    ]
    order = [int(n) - 1 for n in vectors[SLICES]] if SLICES in vectors else list(range(count))
    return Increments(_offsets(dataset, count, order), order, labels, _heights(dataset, count))


def _refuse_others(dataset: Any, count: int, pointed: list[int]) -> None:
    """Raise NoSlice for frames that follow each other in time, round an object, or as pages."""
    for known, what in ((TIMES, "times of one plane"), (VIEWS, "views from around"), (PAGES, "pages")):
        found = [name for tag, name in known.items() if tag in pointed]
        if found:
            raise NoSlice(f"its {count} frames are {what} ({found[0]}), no slices")
    moving = [name for tag, name in FACTORS.items() if tag in pointed]
    if moving and SLICES not in pointed:
        raise NoSlice(f"its {count} frames differ in {' and '.join(moving)}, no slices")
    timed = [name for tag, name in TIMES.items() if tag in dataset and not pointed]
    if timed and not any(tag in dataset for tag in (0x00180088, 0x00200032)):
        raise NoSlice(f"its {count} frames are times of one plane ({timed[0]}), no slices")
    unknown = [tag for tag in pointed if tag not in (*FACTORS, *PLACES, *TIMES)]
    if unknown:
        raise NoSlice(f"its {count} frames differ in element {unknown[0]:08x}, which is not known; no slices")
    is_nuclear = elements.text(dataset, 0x00080016) == NUCLEAR
    kinds = elements.texts(dataset, 0x00080008)[2:3]
    if is_nuclear and kinds and kinds[0] not in RECONSTRUCTED and SLICES not in pointed:
        raise NoSlice(f"its {count} frames are of the kind {kinds[0]}, views or times, no slices")
    kind = PLANAR.get(elements.text(dataset, 0x00080016))
    if kind and not pointed:
        raise NoSlice(f"its {count} frames are times of one plane ({kind}), no slices")


def _vector(dataset: Any, tag: int, count: int) -> list[float]:
    """Return a vector's numbers, one a frame."""
    found = elements.numbers(dataset, tag) or []
    if len(found) != count:
        raise DamagedVolumeError(
            f"{len(found)} numbers in element {tag:08x} found for {count} frames; get the file again"
        )
    return found


def _offsets(dataset: Any, count: int, order: list[int]) -> list[float] | None:
    """Return each frame's distance from the first along the normal; None where no positions are told."""
    if 0x3004000C in dataset:
        grid = _vector(dataset, 0x3004000C, count)
        return [offset - grid[0] for offset in grid]
    if 0x00200032 in dataset and (heights := _heights(dataset, count)):
        return heights
    between = elements.numbers(dataset, 0x00180088)
    if between and detectors_of(dataset):
        return [between[0] * n for n in order]
    return None


def _heights(dataset: Any, count: int) -> list[float] | None:
    """Return the distances from the first one of frames whose locations are told, or None."""
    if 0x00182005 not in dataset:
        return None
    heights = _vector(dataset, 0x00182005, count)
    return [height - heights[0] for height in heights]
