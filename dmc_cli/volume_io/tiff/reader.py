"""Read TIFF stacks: a file with many pages, or a folder of single ones in the order of their numbers.

Read through tifffile, an extra. Spacing comes from ImageJ's or OME's metadata where the file has it,
else from the settings; space none.
"""

import logging
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError, DmcError, UnsupportedFormatError, VolumeError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, VolumeEntry, allocate_values, check_shape, storable_type
from dmc_cli.volume_io.layout import (
    Triple,
    check_file,
    check_lengths,
    chosen_index,
    chosen_origin,
    chosen_spacing,
    exists,
    scale_affine,
)
from dmc_cli.volume_io.lengths import Doubts
from dmc_cli.volume_io.tiff.ome import check_ome
from dmc_cli.volume_io.tiff.spacing import tiff_spacing
from dmc_cli.volume_io.unpacked_size import passes
from dmc_cli.volume_io.within import REMEDY, Bounds, check_beside

SUFFIXES = (".tif", ".tiff")

MISSING = 'tifffile is not installed; pip install "dmc-cli[tiff]" or pip install tifffile'

LARGEST_RATIO = 5000
"""No compression of a TIFF packs a byte into less than 1/5000 byte; a file that claims more is damaged."""


PACKERS = {8: "zlib", 32946: "zlib", 34925: "lzma", 50000: "zstd"}
"""Compression codes whose segments unpack to whatever they hold; the others' know their size."""


def tiff_files(folder: Path) -> list[Path]:
    """Return the TIFF files of a folder in the order of the numbers in their names."""

    def key(path: Path) -> list[tuple[int, str]]:
        return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", path.name)]

    return sorted((path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES), key=key)


def tiff_volume(path: Path, name: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Return the volume of a stack of pages.

    Raises:
        UnsupportedFormatError: tifffile is missing, or the pages are no stack of grey images.
        DamagedVolumeError: A file cannot be decoded.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    files = _files(path, name, settings.allow_outside)
    size = sum(check_file(file, name if file == path else f"{name} ({file.name})") for file in files)
    try:
        import tifffile
    except ImportError as error:
        raise UnsupportedFormatError(f"{name}: a TIFF file found, but {MISSING}") from error
    for file in files:
        check_pages(file, name)
    quiet = logging.getLogger("tifffile")
    level = quiet.level
    found: Triple | None = None
    doubts: Doubts = ()
    quiet.setLevel(logging.CRITICAL + 1)
    try:
        if len(files) == 1:
            values, found, doubts = _stack(tifffile, files[0], name, settings)
        else:
            values = _slices(tifffile, files, name, size, progress)
    except (DmcError, MemoryError):
        raise
    except Exception as error:
        # tifffile raises whatever its parsing and its codecs run into
        told = " ".join(str(error).split())[:200]
        raise DamagedVolumeError(f"{name}: the TIFF cannot be read ({told}); get the file again") from error
    finally:
        quiet.setLevel(level)
    if found is not None:
        check_lengths(name, found)
    spacing, warnings = chosen_spacing(found, settings, "the TIFF", doubts)
    if doubts and settings.spacing is not None:
        spacing = settings.spacing
    origin, _ = chosen_origin(None, settings)
    return Volume(
        values=values,
        affine=scale_affine(spacing, origin),
        space="none",
        path=name,
        files=tuple(files),
        format="tiff",
        warnings=warnings,
    )


def _files(path: Path, name: str, allow_outside: bool) -> list[Path]:
    """Return the file itself, or the slices of a folder, unless one is a link out of it."""
    if not exists(path) or not path.is_dir():
        return [path]
    files, bounds = tiff_files(path), Bounds(path, allow_outside=allow_outside)
    if not files:
        raise VolumeError(f"{name}: no TIFF file found; expected a stack of slices; check the path")
    for file in files:
        if file.is_symlink() and not bounds.hold(file):
            raise VolumeError(f"{name}: {file.name} is a link out of the folder; {REMEDY}")
    return files


def tiff_entries(path: Path, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return the volume of the stack as one entry.

    Raises:
        VolumeError: As `tiff_volume`.
    """
    volume = tiff_volume(path, name, replace(settings, volume_index=0))
    return [VolumeEntry(description="tiff", size=volume.shape)]


def check_pages(path: Path, name: str) -> None:
    """Raise DamagedVolumeError where the chain of pages loops, leaves the file, or has an absurd directory.

    tifffile follows such a chain for minutes.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        start = file.read(16)
        order: Literal["little", "big"] = "little" if start[:2] == b"II" else "big"
        is_big = start[2:4] in (b"+\0", b"\0+")
        count_bytes, entry_bytes, offset_bytes = (8, 20, 8) if is_big else (2, 12, 4)
        position = int.from_bytes(start[8:16] if is_big else start[4:8], order)
        seen: set[int] = set()
        while position:
            if position in seen or position >= size:
                raise DamagedVolumeError(
                    f"{name}: page {len(seen)} of {path.name} points astray; get the file again"
                )
            seen.add(position)
            file.seek(position)
            head = file.read(count_bytes)
            end = position + count_bytes + int.from_bytes(head, order) * entry_bytes
            file.seek(min(end, size))
            tail = file.read(offset_bytes)
            if len(head) < count_bytes or len(tail) < offset_bytes:
                raise DamagedVolumeError(
                    f"{name}: page {len(seen) - 1} of {path.name} is cut short; get the file again"
                )
            position = int.from_bytes(tail, order)


def _stack(
    tifffile: Any, path: Path, name: str, settings: ReadSettings
) -> tuple[AnyArray, Triple | None, Doubts]:
    """Return the values and spacing of a file with many pages, and what is told of the spacing."""
    with tifffile.TiffFile(path) as tiff:
        if tiff.is_ome and tiff.ome_metadata:
            check_ome(tiff.ome_metadata, len(tiff.pages), path, name, settings.allow_outside)
        series = tiff.series[0]
        shape = tuple(int(n) for n in series.shape)
        if len(shape) < 3 or "S" in series.axes:
            raise UnsupportedFormatError(
                f"{name}: an image of shape {shape} with axes {series.axes} found; expected a stack of grey "
                "slices"
            )
        count = int(np.prod(shape[:-3], dtype=np.int64))
        index = chosen_index(name, count, settings.volume_index)
        nodes = shape[:-4:-1]
        check_shape(name, nodes)
        storable_type(name, series.dtype)
        if series.nbytes > LARGEST_RATIO * path.stat().st_size:
            raise DamagedVolumeError(
                f"{name}: {path.stat().st_size} bytes found for {shape} values; get the file again"
            )
        for other in {page.parent.filehandle.path for page in series.pages if page is not None}:
            check_beside(path, Path(other), Path(other).name, name, settings.allow_outside)
        for page in series.pages:
            _check_segments(tiff, page, name)
        whole = allocate_values(name, (nodes[0], nodes[1], nodes[2] * count), series.dtype)
        series.asarray(out=whole.reshape(shape))
        spacing, doubts = tiff_spacing(tiff, name)
    values: AnyArray = whole.reshape(count, nodes[2], nodes[1], nodes[0])[index]
    return values, spacing, doubts


def _slices(tifffile: Any, files: list[Path], name: str, size: int, progress: Progress) -> AnyArray:
    """Return the values of a folder of single pages."""
    values: AnyArray | None = None
    for k, path in enumerate(files):
        with tifffile.TiffFile(path) as tiff:
            page = tiff.pages[0]
            if page.ndim != 2:
                raise UnsupportedFormatError(
                    f"{path.name}: an image of shape {page.shape} found; expected a grey slice"
                )
            _check_segments(tiff, page, name)
            if values is None:
                storable_type(name, page.dtype)
                rows, columns = page.shape
                check_shape(name, (columns, rows, len(files)))
                if len(files) * page.nbytes > LARGEST_RATIO * size:
                    raise DamagedVolumeError(
                        f"{name}: {size} bytes found for {len(files)} slices of {page.shape} pixels"
                    )
                values = allocate_values(name, (columns, rows, len(files)), page.dtype)
            if page.shape != values.shape[1:] or page.dtype != values.dtype:
                raise DamagedVolumeError(
                    f"{path.name}: {page.shape} pixels of {page.dtype} found; expected {values.shape[1:]} of "
                    f"{values.dtype} as in {files[0].name}"
                )
            values[k] = page.asarray()
        progress.advance((k + 1) / len(files))
    assert values is not None
    return values


def _check_segments(tiff: Any, page: Any, name: str) -> None:
    """Refuse a page with a strip or tile that unpacks to far more than its place in the page."""
    if page is None or int(page.keyframe.compression) not in PACKERS:
        return
    frame = page.keyframe
    packer, expected = PACKERS[int(frame.compression)], math.prod(frame.chunks) * frame.dtype.itemsize
    for begin, count in zip(page.dataoffsets, page.databytecounts, strict=False):
        tiff.filehandle.seek(begin)
        if passes(packer, tiff.filehandle.read(count), expected):
            raise DamagedVolumeError(
                f"{name}: {count} bytes found that unpack to more than the {expected} of a part of page "
                f"{page.index}; get the file again"
            )
