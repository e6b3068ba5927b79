"""Put the slices' values into one array: read or decoded in threads, straight to where they belong."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, Float32Array
from dmc_cli.errors import DamagedVolumeError
from dmc_cli.progress import Progress
from dmc_cli.system import usable_cores
from dmc_cli.threads import each_in_threads
from dmc_cli.volume import allocate_values
from dmc_cli.volume_io.dicom.decoding import UNPACKED, decode
from dmc_cli.volume_io.dicom.elements import (
    BIG_ENDIAN,
    DOUBLE_PIXEL_DATA,
    EXPLICIT,
    FLOAT_PIXEL_DATA,
    IMPLICIT,
    RLE,
    Header,
)
from dmc_cli.volume_io.dicom.frames import Frame, Pixels

LARGE_FRAME = 1 << 26
LARGEST_RATIO = 5000
"""A frame beyond LARGE_FRAME bytes must have a stored byte for every LARGEST_RATIO of them: a damaged size
must not make a decoder fill the memory."""

LEAST_RLE_RATIO = 64
"""RLE needs two bytes for 128 equal ones."""


@dataclass(frozen=True, eq=False)
class SliceValues:
    """Stored values [k, j, i] and what they mean."""

    values: AnyArray
    slope: float
    intercept: float
    padding: tuple[float, float] | None


def read_slices(frames: list[Frame], threads: int | None, name: str, progress: Progress) -> SliceValues:
    """Return the values of the frames, in their order.

    They stay in their stored type, unless that, slope, intercept or padding differ between them: then they
    become physical values in float32 and padding becomes NaN.

    Raises:
        DamagedVolumeError: A file ends early, or cannot be decoded.
        UnsupportedFormatError: A compressed transfer syntax whose package is not installed.
        MemoryBudgetError: The values do not fit into the memory that is free.
    """
    for frame in frames:
        _check_size(frame)
    meanings = {(frame.slope, frame.intercept, frame.padding) for frame in frames}
    columns, rows = frames[0].pixels.shape
    uniform = len(meanings) == 1 and len({frame.pixels.dtype for frame in frames}) == 1
    stored = _stored_type(frames[0])
    values = allocate_values(name, (columns, rows, len(frames)), stored if uniform else np.dtype(np.float32))
    tasks = list(_tasks(frames, threads))
    done = 0
    # pydicom warns of every value that breaks a rule, from within the threads
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        read_task = partial(_read_task, values=values, uniform=uniform)
        with closing(each_in_threads(read_task, tasks, _thread_count(threads), "dmc-slices")) as counts:
            # in the slices' order, so that of several errors always the same one is told
            for count in counts:
                done += count
                progress.advance(done / len(frames))
    if uniform:
        return SliceValues(values, frames[0].slope, frames[0].intercept, frames[0].padding)
    return SliceValues(values, 1.0, 0.0, None)


def _thread_count(threads: int | None) -> int:
    return threads or usable_cores()


def _stored_type(frame: Frame) -> np.dtype[Any]:
    """Return the type of the stored values; of Float Pixel Data that of its element."""
    tag = _pixel_tag(frame.header)
    return np.dtype({FLOAT_PIXEL_DATA: "f4", DOUBLE_PIXEL_DATA: "f8"}.get(tag, frame.pixels.dtype))


def _pixel_tag(header: Header) -> int:
    with header.file.open((header.pixel_start or 0) + 4) as file:
        file.seek(header.pixel_start or 0)
        start = file.read(4)
    order: Any = "big" if header.syntax == BIG_ENDIAN else "little"
    return int.from_bytes(start[:2], order) << 16 | int.from_bytes(start[2:], order)


def _check_size(frame: Frame) -> None:
    """Refuse a frame whose file cannot hold it."""
    pixels, file, syntax = frame.pixels, frame.header.file, frame.header.syntax
    expected = pixels.frame_bytes * pixels.frames
    if syntax in (IMPLICIT, EXPLICIT, BIG_ENDIAN):
        found = file.size - (frame.header.pixel_start or 0) - 8
        if found < expected:
            raise DamagedVolumeError(
                f"{file.name}: {found} bytes of pixel data found, {expected} expected for "
                f"{pixels.frames} x {pixels.shape[0]} x {pixels.shape[1]} pixels; get the file again"
            )
        return
    ratio = LEAST_RLE_RATIO if syntax == RLE else LARGEST_RATIO
    if pixels.frame_bytes > LARGE_FRAME and pixels.frame_bytes > ratio * file.size:
        raise DamagedVolumeError(
            f"{file.name}: {file.size} bytes found for {pixels.shape[0]} x {pixels.shape[1]} pixels; "
            "expected more even if packed at its best; the header is damaged; get the file again"
        )


def _tasks(frames: list[Frame], threads: int | None) -> Iterator[list[tuple[int, Frame]]]:
    """Yield the slices to read together: those of one file, in as many parts as there are threads."""
    first: dict[Header, int] = {}
    for k, frame in enumerate(frames):
        first.setdefault(frame.header, k)
    numbered = sorted(enumerate(frames), key=lambda pair: (first[pair[1].header], pair[1].index))
    for _, group in groupby(numbered, key=lambda pair: id(pair[1].header)):
        slices = list(group)
        step = -(-len(slices) // _thread_count(threads))
        for begin in range(0, len(slices), step):
            yield slices[begin : begin + step]


def _read_task(task: list[tuple[int, Frame]], values: AnyArray, uniform: bool) -> int:
    """Read the slices of one file; returns how many."""
    header, pixels = task[0][1].header, task[0][1].pixels
    direct = header.syntax in (IMPLICIT, EXPLICIT) and sys.byteorder == "little"
    decoded = _read_direct(task, values, uniform) if direct else decode(task)
    try:
        for (k, frame), plane in zip(task, decoded, strict=True):
            # a codestream tells its own bits
            _clear_unused_bits(plane, pixels, pixels.bits_below if header.syntax in UNPACKED else 0)
            if not uniform:
                values[k] = _physical(plane, frame)
            elif plane.base is not values:
                values[k] = plane
    except OSError as error:
        raise DamagedVolumeError(
            f"{header.file.name}: the pixel data cannot be read ({error.strerror or error}); get the file "
            "again"
        ) from error
    return len(task)


def _read_direct(task: list[tuple[int, Frame]], values: AnyArray, uniform: bool) -> Iterator[AnyArray]:
    """Read uncompressed slices, into their place in the volume where their type is kept."""
    header, pixels = task[0][1].header, task[0][1].pixels
    with header.file.open((header.pixel_start or 0) + 12 + pixels.frames * pixels.frame_bytes) as file:
        file.seek(header.pixel_start or 0)
        start = file.read(12)
        explicit = header.syntax == EXPLICIT
        if start[:2] != b"\xe0\x7f":
            raise DamagedVolumeError(
                f"{header.file.name}: no pixel data found where they should begin; get the file again"
            )
        long_form = start[4:6] in (b"OB", b"OW", b"OF", b"OD", b"OV", b"OL", b"UN")
        begin = (header.pixel_start or 0) + (12 if explicit and long_form else 8)
        dtype = _stored_type(task[0][1])
        for k, frame in task:
            plane = values[k] if uniform else np.empty(pixels.shape[::-1], dtype)
            size = plane.nbytes
            file.seek(begin + frame.index * size)
            found = file.readinto(plane.data.cast("B"))  # type: ignore[attr-defined]
            if found != size:
                raise DamagedVolumeError(
                    f"{frame.name}: {found} bytes of pixel data found, {size} expected; get the file again"
                )
            yield plane


def _clear_unused_bits(plane: AnyArray, pixels: Pixels, below: int) -> None:
    """Drop the bits below the stored ones, make those above copies of the sign, or zero."""
    unused = pixels.dtype.itemsize * 8 - pixels.bits_stored
    if unused and plane.dtype.kind in "iu":
        np.left_shift(plane, unused - below, out=plane)
        np.right_shift(plane, unused, out=plane)


def _physical(plane: AnyArray, frame: Frame) -> Float32Array:
    """Return the physical values in float32, padding as NaN."""
    values = (plane * frame.slope + frame.intercept).astype(np.float32)
    if frame.padding is not None:
        values[(plane >= frame.padding[0]) & (plane <= frame.padding[1])] = np.nan
    return values
