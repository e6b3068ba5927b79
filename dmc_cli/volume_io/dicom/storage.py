"""Find how the frames of a DICOM file are stored: their size, type, bits and padding."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.notices import Notice, notices
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.elements import Header
from dmc_cli.volume_io.dicom.incomplete import check_pixels_expected
from dmc_cli.volume_io.dicom.place import NoSlice

MAX_FRAMES = 1 << 18
"""More frames than any file, or all files with many frames of an input, have."""

LEAST_FRAME = 8
"""Bytes of the smallest frame, whatever packs it: those that tell its length."""


@dataclass(frozen=True, eq=False)
class Pixels:
    """How a file's frames are stored.

    Attributes:
        shape: Columns and rows: nodes along x and y.
        dtype: Type of a value in native byte order.
        bits_stored: Bits of it that count.
        bits_below: Bits below those, where the file's values are as they were stored.
        frames: Number of frames in the file.
        padding: Closed range of stored values that mean no data, or None.
        is_packed: Whether a value is one bit, eight in a byte, frame after frame without a gap.
        is_label_map: Whether values are numbers of segments.
        contradictions: Notices on elements that contradict each other, or turn what is bright.
    """

    shape: tuple[int, int]
    dtype: np.dtype[Any]
    bits_stored: int
    bits_below: int
    frames: int
    padding: tuple[float, float] | None
    is_packed: bool
    is_label_map: bool
    contradictions: tuple[Notice, ...]
    whole: "Pixels | None" = None

    @property
    def frame_bytes(self) -> int:
        """Return the bytes of a frame that is not compressed."""
        return self.shape[0] * self.shape[1] * self.dtype.itemsize


def read_pixels(header: Header) -> Pixels:
    """Return how a file's frames are stored.

    Raises:
        NoSlice: It holds no greyscale images.
        DamagedVolumeError: Its number of frames cannot be.
    """
    dataset = header.dataset
    rows, columns = elements.integer(dataset, 0x00280010), elements.integer(dataset, 0x00280011)
    if header.pixel_start is None:
        check_pixels_expected(header)
    if not rows or not columns or header.pixel_start is None:
        raise NoSlice("no image")
    if elements.integer(dataset, 0x00280002, 1) != 1:
        raise NoSlice("a colour image")
    is_label_map = elements.text(dataset, 0x00620001) == "LABELMAP"
    kinds = ("", "MONOCHROME1", "MONOCHROME2", *(("PALETTE COLOR",) if is_label_map else ()))
    if elements.text(dataset, 0x00280004) not in kinds:
        raise NoSlice(f"an image of kind {elements.text(dataset, 0x00280004)[:20]}")
    count = elements.numbers(dataset, 0x00280008) or [1]
    allocated = elements.integer(dataset, 0x00280100, 16) or 16
    least = rows * columns / 8 if allocated == 1 else LEAST_FRAME
    if not 1 <= count[0] <= MAX_FRAMES or min(least, LEAST_FRAME) * (count[0] - 1) > header.file.size:
        raise DamagedVolumeError(
            f"{header.file.name}: {count[0]:.0f} frames found in {header.file.size} bytes; expected 1 or as "
            "many as fit; get the file again"
        )
    signed = elements.integer(dataset, 0x00280103, 0) == 1
    if allocated not in (1, 8, 16, 32, 64):
        raise NoSlice(f"an image of {allocated} bits a pixel")
    stored = elements.integer(dataset, 0x00280101, allocated) or allocated
    stored = min(stored, allocated)
    high = elements.integer(dataset, 0x00280102)
    below = 0 if high is None else high + 1 - stored
    dtype = np.dtype(f"{'i' if signed and allocated > 1 else 'u'}{max(allocated // 8, 1)}")
    if not 0 <= below <= allocated - stored:
        # HighBit cannot be what it says
        below = 0
    return Pixels(
        shape=(columns, rows),
        dtype=dtype,
        bits_stored=stored,
        bits_below=below,
        frames=int(count[0]),
        padding=None if is_label_map else _padding(dataset, signed, stored),
        is_packed=allocated == 1,
        is_label_map=is_label_map,
        contradictions=(*_contradictions(dataset, allocated, stored, below), *_inverse_told(dataset)),
    )


def _contradictions(dataset: Any, allocated: int, taken: int, below: int) -> list[Notice]:
    """Return notices on elements that contradict each other on how a pixel is stored."""
    stored, high = (elements.integer(dataset, tag) for tag in (0x00280101, 0x00280102))
    sign = elements.integer(dataset, 0x00280103)
    found = []
    if stored is not None and not 1 <= stored <= allocated:
        found.append(f"BitsStored {stored} of {allocated} allocated, {taken} are taken")
    if high is not None and high != taken + below - 1:
        found.append(f"HighBit {high} of {taken} stored, the lowest are taken")
    is_float = allocated >= 32 and stored is None and high is None
    if sign not in (0, 1) and not is_float:
        found.append(f"PixelRepresentation {sign}, values without a sign are taken")
    lowest = elements.integer(dataset, 0x00280106, signed=True)
    if sign == 0 and elements.kind(dataset, 0x00280106) == "SS" and lowest is not None and lowest < 0:
        found.append(f"SmallestImagePixelValue {lowest} of values without a sign (PixelRepresentation 0)")
    return notices("W-BITS-CONTRADICTED", found)


def _inverse_told(dataset: Any) -> list[Notice]:
    """Return a notice on an image that is shown with low values bright."""
    if elements.text(dataset, 0x00280004) != "MONOCHROME1":
        return []
    sentence = "MONOCHROME1 found: the lowest values are shown white; values are taken as stored"
    return [Notice("W-PHOTOMETRIC", sentence)]


def _padding(dataset: Any, signed: bool, stored: int) -> tuple[float, float] | None:
    """Return the closed range of PixelPaddingValue and PixelPaddingRangeLimit."""
    value = elements.integer(dataset, 0x00280120, signed=signed)
    if value is None:
        return None
    limit = elements.integer(dataset, 0x00280121, value, signed=signed)
    ends = sorted(_with_sign(end, signed, stored) for end in (value, value if limit is None else limit))
    return float(ends[0]), float(ends[1])


def _with_sign(value: int, signed: bool, stored: int) -> int:
    """Return a padding value that was written as the stored bits of a negative one as what it is."""
    is_above = signed and 1 << (stored - 1) <= value < 1 << stored
    return value - (1 << stored) if is_above else value
