"""Put the slices' values into one array: read or decoded in threads, straight to where they belong."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, Float32Array
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.progress import SILENT, Progress
from dmc_cli.system import usable_cores
from dmc_cli.threads import each_in_threads
from dmc_cli.volume import allocate_values
from dmc_cli.volume_io.dicom.decoding import UNPACKED, decode, undefined_length
from dmc_cli.volume_io.dicom.elements import (
    BIG_ENDIAN,
    DOUBLE_PIXEL_DATA,
    EXPLICIT,
    FLOAT_PIXEL_DATA,
    IMPLICIT,
    RLE,
    Header,
)
from dmc_cli.volume_io.dicom.frames import Frame
from dmc_cli.volume_io.dicom.mosaic import tiles_of
from dmc_cli.volume_io.dicom.storage import Pixels

LARGE_FRAME = 1 << 26
LARGEST_RATIO = 5000
"""A frame beyond LARGE_FRAME bytes must have a stored byte for every LARGEST_RATIO of them: a damaged size
must not make a decoder fill the memory."""

UNDEFINED = 0xFFFFFFFF
"""The length of an element that ends with a delimiter."""

ITEM = b"\xfe\xff\x00\xe0"
"""What packed pixel data begin with."""

LEAST_RLE_RATIO = 64
"""RLE needs two bytes for 128 equal ones."""


@dataclass(frozen=True, eq=False)
class SliceValues:
    """Stored values [k, j, i] and what they mean; notices on values that contradict their headers."""

    values: AnyArray
    slope: float
    intercept: float
    padding: tuple[float, float] | None
    warnings: tuple[Notice, ...]


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
    uniform &= all(frame.lookup is None for frame in frames)
    stored = _stored_type(frames[0])
    values = allocate_values(name, (columns, rows, len(frames)), stored if uniform else np.dtype(np.float32))
    for k, frame in enumerate(frames):
        if frame.is_blank:
            values[k] = 0
    tasks = list(_tasks(frames, threads))
    done = 0
    # pydicom warns of every value that breaks a rule, from within the threads
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        dropped: list[int] = []
        longer: list[int] = []
        read_task = partial(_read_task, values=values, uniform=uniform, dropped=dropped, longer=longer)
        with closing(each_in_threads(read_task, tasks, _thread_count(threads), "dmc-slices")) as counts:
            # in the slices' order, so that of several errors always the same one is told
            for count in counts:
                done += count
                progress.advance(done / sum(map(len, tasks)))
    told = (*_dropped_told(frames, dropped), *_longer_told(frames, longer))
    if uniform:
        return SliceValues(values, frames[0].slope, frames[0].intercept, frames[0].padding, told)
    return SliceValues(values, 1.0, 0.0, None, told)


def is_same_image(one: Frame, other: Frame, name: str) -> bool:
    """Return whether two frames hold the same physical values: one is a copy of the other.

    Raises:
        DamagedVolumeError: One of them ends early, or cannot be decoded.
    """
    found = read_slices([one, other], 1, name, SILENT)
    first, second = found.values
    return np.array_equal(first, second, equal_nan=first.dtype.kind == "f")


def _dropped_told(frames: list[Frame], dropped: list[int]) -> list[Notice]:
    """Return a notice on slices that had bits beside the stored ones."""
    if not dropped:
        return []
    first = frames[min(dropped)]
    return [
        Notice(
            "W-BITS-CONTRADICTED",
            f"bits above the {first.pixels.bits_stored} that are stored (BitsStored) found in "
            f"{len(dropped)} of {len(frames)} slices, first {first.name}; they are dropped, as overlays",
        )
    ]


def _longer_told(frames: list[Frame], longer: list[int]) -> list[Notice]:
    """Return a notice on slices whose pixel data go on behind their pixels."""
    if not longer:
        return []
    return [
        Notice(
            "W-BITS-CONTRADICTED",
            f"pixel data longer than rows, columns and bits make them found in {len(longer)} of "
            f"{len(frames)} slices, first {frames[min(longer)].name}; the first bytes are taken",
        )
    ]


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
    pixels, file, syntax = frame.pixels.whole or frame.pixels, frame.header.file, frame.header.syntax
    expected = _native_bytes(pixels, pixels.dtype)
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
    wanted = [(k, frame) for k, frame in enumerate(frames) if not frame.is_blank]
    numbered = sorted(wanted, key=lambda pair: (first[pair[1].header], pair[1].index))
    for _, group in groupby(numbered, key=lambda pair: id(pair[1].header)):
        slices = list(group)
        # a mosaic is read as a whole
        step = len(slices) if slices[0][1].pixels.whole else -(-len(slices) // _thread_count(threads))
        for begin in range(0, len(slices), step):
            yield slices[begin : begin + step]


def _read_task(
    task: list[tuple[int, Frame]], values: AnyArray, uniform: bool, dropped: list[int], longer: list[int]
) -> int:
    """Read the slices of one file, adding the numbers of those that lost bits or bytes; returns how many."""
    header, pixels = task[0][1].header, task[0][1].pixels
    direct = header.syntax in (IMPLICIT, EXPLICIT) and (sys.byteorder == "little" or pixels.is_packed)
    if pixels.is_packed and not direct:
        raise UnsupportedFormatError(
            f"{header.file.name}: single bits under the transfer syntax {header.syntax} found; expected "
            f"{EXPLICIT}; convert the file to it"
        )
    if pixels.whole:
        decoded = _read_mosaic(task, direct, longer)
    else:
        decoded = _read_direct(task, values, uniform, longer) if direct else decode(task)
    try:
        for (k, frame), plane in zip(task, decoded, strict=True):
            # a codestream tells its own bits
            if _clear_unused_bits(plane, pixels, pixels.bits_below if header.syntax in UNPACKED else 0):
                dropped.append(k)
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


def _read_mosaic(task: list[tuple[int, Frame]], direct: bool, longer: list[int]) -> Iterator[AnyArray]:
    """Read the image that slices are tiles of, and yield them."""
    first, frame = task[0]
    assert frame.pixels.whole is not None
    whole = [(first, replace(frame, pixels=frame.pixels.whole, index=0))]
    (image,) = _read_direct(whole, np.empty(0), False, longer) if direct else decode(whole)
    yield from tiles_of(image, [frame.index for _, frame in task], frame.pixels)


def _read_direct(
    task: list[tuple[int, Frame]], values: AnyArray, uniform: bool, longer: list[int]
) -> Iterator[AnyArray]:
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
        file.seek(begin)
        told = start[8:12] if explicit and long_form else start[4:8]
        if _is_longer(header, pixels, dtype, told, file.read(len(ITEM))):
            longer += [k for k, _ in task]
        for k, frame in task:
            if pixels.is_packed:
                yield _unpacked(file, begin, frame)
                continue
            plane = values[k] if uniform else np.empty(pixels.shape[::-1], dtype)
            size = plane.nbytes
            file.seek(begin + frame.index * size)
            found = file.readinto(plane.data.cast("B"))  # type: ignore[attr-defined]
            if found != size:
                raise DamagedVolumeError(
                    f"{frame.name}: {found} bytes of pixel data found, {size} expected; get the file again"
                )
            yield plane


def _native_bytes(pixels: Pixels, dtype: np.dtype[Any]) -> int:
    """Return the bytes of all frames of a file that is not compressed."""
    count = pixels.frames * pixels.shape[0] * pixels.shape[1]
    return -(-count // 8) if pixels.is_packed else count * dtype.itemsize


def _unpacked(file: Any, begin: int, frame: Frame) -> AnyArray:
    """Return a frame of single bits, the lowest of a byte first; frames do not begin with a byte."""
    columns, rows = frame.pixels.shape
    count = columns * rows
    first, skipped = divmod(frame.index * count, 8)
    file.seek(begin + first)
    packed = np.frombuffer(file.read(-(-(skipped + count) // 8)), np.uint8)
    if 8 * len(packed) < skipped + count:
        raise DamagedVolumeError(
            f"{frame.name}: {len(packed)} bytes of single bits found, {-(-(skipped + count) // 8)} expected; "
            "get the file again"
        )
    bits = np.unpackbits(packed, count=skipped + count, bitorder="little")[skipped:]
    return bits.reshape(rows, columns)


def _is_longer(header: Header, pixels: Pixels, dtype: np.dtype[Any], told: bytes, start: bytes) -> bool:
    """Return whether pixel data go on behind the frames, by less than these take.

    Args:
        header: The file's header.
        pixels: How its frames are stored.
        dtype: Type of their values.
        told: The length of the pixel data's element.
        start: The first bytes of the pixels.

    Raises:
        DamagedVolumeError: They are not what header and transfer syntax say: packed, fewer than the frames
            take, or so many that there must be more frames, or wider ones.
    """
    expected = _native_bytes(pixels, dtype)
    length = int.from_bytes(told, "little")
    if length == UNDEFINED:
        raise undefined_length(header)
    is_padded = length <= expected + expected % 2
    if not is_padded and start == ITEM:
        raise undefined_length(header)
    if length < expected or (not is_padded and length >= 2 * expected):
        raise DamagedVolumeError(
            f"{header.file.name}: pixel data of {length} bytes found, {expected} expected for "
            f"{pixels.frames} x {pixels.shape[0]} x {pixels.shape[1]} pixels; get the file again"
        )
    return not is_padded


def _clear_unused_bits(plane: AnyArray, pixels: Pixels, below: int) -> bool:
    """Drop the bits below the stored ones, make those above copies of the sign, or zero.

    Returns:
        Whether any above were neither.
    """
    unused = pixels.dtype.itemsize * 8 - pixels.bits_stored
    if not unused or pixels.is_packed or plane.dtype.kind not in "iu":
        return False
    signed = plane.dtype.kind == "i"
    highest = (1 << (pixels.bits_stored - signed)) - 1
    if not below and plane.max() <= highest and (not signed or plane.min() >= -highest - 1):
        # as most are: nothing to clear
        return False
    above = plane >> (pixels.bits_stored + below) if pixels.bits_stored + below < 8 * plane.itemsize else None
    np.left_shift(plane, unused - below, out=plane)
    np.right_shift(plane, unused, out=plane)
    if above is None:
        return False
    return bool(((above != 0) & ((above != -1) | (plane >= 0))).any() if signed else above.any())


def _physical(plane: AnyArray, frame: Frame) -> Float32Array:
    """Return the physical values in float32, padding as NaN."""
    table = frame.lookup
    values = table(plane) if table else (plane * frame.slope + frame.intercept).astype(np.float32)
    if frame.padding is not None:
        values[(plane >= frame.padding[0]) & (plane <= frame.padding[1])] = np.nan
    return values
