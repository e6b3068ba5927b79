"""Split a DICOM file into its frames: where each image lies in space, and what its values mean.

Single-frame images tell this in their own elements, enhanced ones in functional groups, shared by all
frames or one a frame; dose grids and nuclear medicine have offsets from the first frame.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume import FARTHEST_MM
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.elements import Header
from dmc_cli.volume_io.dicom.incomplete import check_pixels_expected

MAX_FRAMES = 1 << 18
"""More frames than any file, or all files with many frames of an input, have."""

LEAST_FRAME = 8
"""Bytes of the smallest frame, whatever packs it: those that tell its length."""

DISCRIMINATORS = {
    "image type": 0x00080008,
    "acquisition": 0x00200012,
    "temporal position": 0x00200100,
    "echo time": 0x00180081,
    "trigger time": 0x00181060,
    "b-value": 0x00189087,
    "kernel": 0x00181210,
    "acquisition time": 0x00080032,
    "content time": 0x00080033,
}
"""What may tell apart images at the same place, in the order in which it is tried."""

VALUE_TYPE = "value type"
"""What is tried last: slices of one volume may differ in it."""

FRAME_DISCRIMINATORS = {
    "stack": (0x00209111, 0x00209056),
    "temporal position": (0x00209111, 0x00209128),
    "echo time": (0x00189114, 0x00189082),
    "b-value": (0x00189117, 0x00189087),
    "frame type": (0x00189226, 0x00089007),
}
"""The same in enhanced images: sequence and element."""


@dataclass(frozen=True, eq=False)
class Pixels:
    """How a file's frames are stored.

    Attributes:
        shape: Columns and rows: nodes along x and y.
        dtype: Type of a value in native byte order.
        bits_stored: Bits of it that count.
        bits_below: Bits below those, where the file's values are as they were stored.
        frames: Number of frames in the file.
    """

    shape: tuple[int, int]
    dtype: np.dtype[Any]
    bits_stored: int
    bits_below: int
    frames: int

    @property
    def frame_bytes(self) -> int:
        """Return the bytes of a frame that is not compressed."""
        return self.shape[0] * self.shape[1] * self.dtype.itemsize


@dataclass(frozen=True, eq=False)
class Frame:
    """One image of a file.

    Attributes:
        header: The file's header.
        pixels: How the file's frames are stored.
        index: Number of the frame in its file, from 0.
        position: Centre of the first node, LPS, in millimetres.
        orientation: Direction of x, then of y.
        spacing: Distance of nodes along x and y in millimetres.
        slope: Physical value a stored unit.
        intercept: Physical value of stored 0.
        padding: Closed range of stored values that mean no data, or None.
        labels: What may tell apart frames at the same place.
        lacks_scale: Whether the file tells a slope of 0, which cannot be meant and is read as 1.
        is_placed: Whether the file tells where the frame lies; if not, frames follow each other along z.
    """

    header: Header
    pixels: Pixels
    index: int
    position: tuple[float, ...]
    orientation: tuple[float, ...]
    spacing: tuple[float, float]
    slope: float
    intercept: float
    padding: tuple[float, float] | None
    labels: dict[str, str]
    lacks_scale: bool = False
    is_placed: bool = True

    @property
    def name(self) -> str:
        """Return the file's name, with the frame's number where it has several."""
        name = self.header.file.name
        return name if self.pixels.frames == 1 else f"{name} frame {self.index + 1}"


class NoSlice(Exception):  # noqa: N818 -- not an error: most folders hold files that are no slices
    """A DICOM file that is no slice of a volume; the text says why."""


def read_frames(header: Header) -> list[Frame]:
    """Return the frames of a file, in its order.

    Raises:
        NoSlice: The file holds no greyscale images with a place in space.
        DamagedVolumeError: An element cannot be what it is.
    """
    pixels = _pixels(header)
    dataset = header.dataset
    shared = (elements.items(dataset, 0x52009229) or [None])[0]
    each = elements.items(dataset, 0x52009230, pixels.frames + 1)
    if each and len(each) != pixels.frames:
        raise DamagedVolumeError(
            f"{header.file.name}: {len(each)} functional groups found for {pixels.frames} frames; get the "
            "file again"
        )
    offsets = [0.0] * pixels.frames if each else _frame_offsets(dataset, pixels.frames)
    padding = _padding(dataset, pixels)
    common = {key: elements.label(dataset, tag) for key, tag in DISCRIMINATORS.items() if tag in dataset}
    common[VALUE_TYPE] = pixels.dtype.name
    frames = []
    for index in range(pixels.frames):
        own = each[index] if each else None
        place = _Place(dataset, shared, own)
        if offsets is None:
            position, orientation, spacing = _unplaced(dataset, index)
        else:
            position, orientation, spacing = place.geometry(offsets[index])
        slope, intercept = place.rescale()
        labels = {**common, **place.labels()} if each else common
        frames.append(
            Frame(
                header,
                pixels,
                index,
                position,
                orientation,
                spacing,
                slope or 1.0,
                intercept,
                padding,
                labels,
                lacks_scale=slope == 0,
                is_placed=offsets is not None,
            )
        )
    return frames


def _pixels(header: Header) -> Pixels:
    dataset = header.dataset
    rows, columns = elements.integer(dataset, 0x00280010), elements.integer(dataset, 0x00280011)
    if header.pixel_start is None:
        check_pixels_expected(header)
    if not rows or not columns or header.pixel_start is None:
        raise NoSlice("no image")
    if elements.integer(dataset, 0x00280002, 1) != 1:
        raise NoSlice("a colour image")
    if elements.text(dataset, 0x00280004) not in ("", "MONOCHROME1", "MONOCHROME2"):
        raise NoSlice(f"an image of kind {elements.text(dataset, 0x00280004)[:20]}")
    count = elements.numbers(dataset, 0x00280008) or [1]
    if not 1 <= count[0] <= MAX_FRAMES or LEAST_FRAME * (count[0] - 1) > header.file.size:
        raise DamagedVolumeError(
            f"{header.file.name}: {count[0]:.0f} frames found in {header.file.size} bytes; expected 1 or as "
            "many as fit; get the file again"
        )
    allocated = elements.integer(dataset, 0x00280100, 16) or 16
    signed = elements.integer(dataset, 0x00280103, 0) == 1
    if allocated not in (8, 16, 32, 64):
        raise NoSlice(f"an image of {allocated} bits a pixel")
    stored = elements.integer(dataset, 0x00280101, allocated) or allocated
    stored = min(stored, allocated)
    high = elements.integer(dataset, 0x00280102)
    below = 0 if high is None else high + 1 - stored
    dtype = np.dtype(f"{'i' if signed else 'u'}{allocated // 8}")
    if not 0 <= below <= allocated - stored:
        # HighBit cannot be what it says
        below = 0
    return Pixels((columns, rows), dtype, stored, below, int(count[0]))


def _padding(dataset: Any, pixels: Pixels) -> tuple[float, float] | None:
    """Return the closed range of PixelPaddingValue and PixelPaddingRangeLimit."""
    signed = pixels.dtype.kind == "i"
    value = elements.integer(dataset, 0x00280120, signed=signed)
    if value is None:
        return None
    limit = elements.integer(dataset, 0x00280121, value, signed=signed)
    ends = sorted((value, value if limit is None else limit))
    return float(ends[0]), float(ends[1])


def _frame_offsets(dataset: Any, count: int) -> list[float] | None:
    """Return each frame's distance from the first along the normal; None where no positions are told."""
    if count == 1:
        return [0.0]
    grid = elements.numbers(dataset, 0x3004000C)
    if grid is not None and len(grid) == count:
        return [offset - grid[0] for offset in grid]
    between = elements.numbers(dataset, 0x00180088)
    if elements.items(dataset, 0x00540022) and between:
        return [between[0] * n for n in range(count)]
    return None


def _unplaced(dataset: Any, index: int) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, float]]:
    """Return position, orientation and spacing along the grid's own axes: the file tells none."""
    between = elements.numbers(dataset, 0x00180088) or elements.numbers(dataset, 0x00180050) or [1.0]
    spacing = elements.numbers(dataset, 0x00280030, 2) or [1.0, 1.0]
    _check_spacing(spacing)
    _check_place([between[0] * index])
    return (0.0, 0.0, index * (abs(between[0]) or 1.0)), (1.0, 0, 0, 0, 1, 0), (spacing[1], spacing[0])


def _check_spacing(spacing: list[float]) -> None:
    if not all(0 < length <= FARTHEST_MM for length in spacing):
        raise DamagedVolumeError(
            f"pixel spacing {spacing} found; expected positive lengths up to {FARTHEST_MM:.2g} mm"
        )


def _check_place(millimetres: list[float]) -> None:
    if not max(map(abs, millimetres)) <= FARTHEST_MM:
        told = ", ".join(f"{number:g}" for number in millimetres)
        raise DamagedVolumeError(
            f"a slice at {told} mm found; expected coordinates that float32 holds, up to {FARTHEST_MM:.2g}; "
            "get the file again"
        )


@dataclass(frozen=True)
class _Place:
    """Where to look up a frame's elements: its own group, the shared one, the data set."""

    dataset: Any
    shared: Any
    own: Any

    def find(self, sequence: int, tag: int) -> Any:
        """Return the data set that holds an element."""
        for group in (self.own, self.shared):
            for item in elements.items(group, sequence)[:1]:
                if tag in item:
                    return item
        if tag in self.dataset:
            return self.dataset
        for detector in elements.items(self.dataset, 0x00540022)[:1]:
            if tag in detector:
                return detector
        return None

    def geometry(self, offset: float) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, float]]:
        """Return the frame's position, `offset` millimetres along the normal, orientation and spacing."""
        position = elements.numbers(self.find(0x00209113, 0x00200032), 0x00200032, 3)
        orientation = elements.numbers(self.find(0x00209116, 0x00200037), 0x00200037, 6)
        spacing = elements.numbers(self.find(0x00289110, 0x00280030), 0x00280030, 2)
        if position is None or orientation is None:
            raise NoSlice("no position or orientation")
        if spacing is None:
            raise NoSlice("no pixel spacing")
        _check_spacing(spacing)
        _check_place([*position, offset] if offset else position)
        x, y = np.array(orientation[:3]), np.array(orientation[3:])
        if abs(x @ x - 1) > 0.01 or abs(y @ y - 1) > 0.01 or abs(x @ y) > 0.01:
            raise DamagedVolumeError(
                f"orientation {orientation} found; expected two perpendicular directions"
            )
        if offset:
            position = [float(p) for p in np.array(position) + offset * np.cross(x, y)]
        return tuple(position), tuple(orientation), (spacing[1], spacing[0])

    def rescale(self) -> tuple[float, float]:
        """Return the slope, 1 where none is told, and the intercept; of a dose grid its scaling."""
        slope = elements.numbers(self.find(0x00289145, 0x00281053), 0x00281053, 1)
        intercept = elements.numbers(self.find(0x00289145, 0x00281052), 0x00281052, 1)
        dose = elements.numbers(self.dataset, 0x3004000E, 1)
        return (slope or dose or [1.0])[0], (intercept or [0.0])[0]

    def labels(self) -> dict[str, str]:
        """Return what may tell apart frames at the same place."""
        found = {}
        for key, (sequence, tag) in FRAME_DISCRIMINATORS.items():
            holder = self.find(sequence, tag)
            if holder is not None:
                found[key] = elements.label(holder, tag)
        return found
