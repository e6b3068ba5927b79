"""Read TIFF stacks: a file with many pages, or a folder of single ones in the order of their numbers.

Read through tifffile, an extra; what a file with many pages holds is told by `stack.py`. Spacing comes from
ImageJ's or OME's metadata where the file has it, else from the settings; space none.
"""

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError, DmcError, UnsupportedFormatError, VolumeError
from dmc_cli.notices import Notice
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, VolumeEntry, allocate_values, check_shape, storable_type, widened_type
from dmc_cli.volume_io.axes import images_entry, unnamed_axes
from dmc_cli.volume_io.layout import (
    Triple,
    check_file,
    check_lengths,
    chosen_origin,
    chosen_spacing,
    exists,
    scale_affine,
)
from dmc_cli.volume_io.lengths import Doubts
from dmc_cli.volume_io.tiff.spacing import tiff_spacing
from dmc_cli.volume_io.tiff.stack import LARGEST_RATIO, check_segments, read_stack, stack_images
from dmc_cli.volume_io.within import REMEDY, Bounds

SUFFIXES = (".tif", ".tiff")

MIN_IS_WHITE, PALETTE = 0, 3
"""Photometric interpretations whose values are no brightness."""

MISSING = 'tifffile is not installed; pip install "dmc-cli[tiff]" or pip install tifffile'


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
    tifffile = _tifffile(name)
    found: Triple | None = None
    doubts: Doubts = ()
    notes: tuple[Notice, ...] = ()
    with _told_errors(files, name):
        if len(files) == 1:
            with tifffile.TiffFile(files[0]) as tiff:
                values, image, number = read_stack(tiff, files[0], name, settings)
                found, doubts = tiff_spacing(tiff, name, number)
                notes = (*_unfollowed(tiff, number), *unnamed_axes(image))
        else:
            values = _slices(tifffile, files, name, size, progress)
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
        warnings=(*notes, *warnings),
    )


def _tifffile(name: str) -> Any:
    try:
        import tifffile
    except ImportError as error:
        raise UnsupportedFormatError(f"{name}: a TIFF file found, but {MISSING}") from error
    return tifffile


@contextmanager
def _told_errors(files: list[Path], name: str) -> Iterator[None]:
    """Look at the chains of pages; tell in one message whatever tifffile meets then, and nothing else."""
    for file in files:
        check_pages(file, name)
    quiet = logging.getLogger("tifffile")
    level = quiet.level
    quiet.setLevel(logging.CRITICAL + 1)
    try:
        yield
    except (DmcError, MemoryError):
        raise
    except Exception as error:
        # tifffile raises whatever its parsing and its codecs run into
        told = " ".join(str(error).split())[:200]
        raise DamagedVolumeError(f"{name}: the TIFF cannot be read ({told}); get the file again") from error
    finally:
        quiet.setLevel(level)


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
    """Return the stack as one entry, with the volumes that it holds; no value of a file with many is read.

    Raises:
        VolumeError: As `tiff_volume`.
    """
    settings = replace(settings, volume_index=0)
    files = _files(path, name, settings.allow_outside)
    if len(files) > 1:
        return [VolumeEntry(description="tiff", size=tiff_volume(path, name, settings).shape)]
    check_file(files[0], name)
    tifffile = _tifffile(name)
    with _told_errors(files, name), tifffile.TiffFile(files[0]) as tiff:
        return [images_entry("tiff", stack_images(tiff, files[0], name, settings), settings, name)]


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
            check_segments(tiff, page, name)
            if values is None:
                dtype = storable_type(name, widened_type(page.dtype))
                rows, columns = page.shape
                check_shape(name, (columns, rows, len(files)))
                if len(files) * page.nbytes > LARGEST_RATIO * size:
                    raise DamagedVolumeError(
                        f"{name}: {size} bytes found for {len(files)} slices of {page.shape} pixels"
                    )
                values = allocate_values(name, (columns, rows, len(files)), dtype)
            if page.shape != values.shape[1:] or widened_type(page.dtype) != values.dtype:
                raise DamagedVolumeError(
                    f"{path.name}: {page.shape} pixels of {page.dtype} found; expected {values.shape[1:]} of "
                    f"{values.dtype} as in {files[0].name}"
                )
            values[k] = page.asarray()
        progress.advance((k + 1) / len(files))
    assert values is not None
    return values


def _unfollowed(tiff: Any, number: int) -> tuple[Notice, ...]:
    """Return what the file tells of an image that is not followed."""
    series = tiff.series[number]
    notes = []
    for named, kind in ((tiff.is_ome, "ome"), (tiff.is_imagej, "imagej")):
        if named and series.kind != kind:
            told = f"the TIFF's metadata of {kind} cannot be read; its pages are taken as slices"
            notes.append(Notice("W-AXES-MISSING", told))
    photometric = int(series.keyframe.photometric)
    if photometric == MIN_IS_WHITE:
        told = "the TIFF's lowest value is white (WhiteIsZero); values are taken as they are stored"
        notes.append(Notice("W-PHOTOMETRIC", told))
    if photometric == PALETTE:
        told = "the TIFF's values are places in a colour table; they are taken as they are stored"
        notes.append(Notice("W-PHOTOMETRIC", told))
    return tuple(notes)
