"""Read TIFF stacks: a file with many pages, or a folder of single ones in the order of their numbers.

Read through tifffile, an extra; what a file with many pages holds is told by `stack.py`. Spacing comes from
ImageJ's or OME's metadata where the file has it, else from the settings; space none.
"""

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice, notices
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, VolumeEntry
from dmc_cli.volume_io.axes import images_entry, unnamed_axes
from dmc_cli.volume_io.image_kinds import KINDS, are_grey
from dmc_cli.volume_io.image_stack import ImageKind, Plane, find_slices, stack_volume
from dmc_cli.volume_io.layout import check_file, chosen_origin, exists, scale_affine
from dmc_cli.volume_io.left_out import left_out
from dmc_cli.volume_io.library_errors import library_errors, told_by
from dmc_cli.volume_io.tiff.imagej import imagej_origin, imagej_scale
from dmc_cli.volume_io.tiff.ome_set import ome_set
from dmc_cli.volume_io.tiff.pages import RGB, pages_told, shown
from dmc_cli.volume_io.tiff.spacing import WHAT, tiff_lengths
from dmc_cli.volume_io.tiff.stack import LARGEST_RATIO, check_segments, read_stack, stack_images
from dmc_cli.volume_io.told_lengths import settled_spacing

MISSING = 'tifffile is not installed; pip install "dmc-cli[tiff]" or pip install tifffile'


def tiff_volume(path: Path, name: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Return the volume of a stack of pages.

    Raises:
        UnsupportedFormatError: tifffile is missing, or the pages are no stack of grey images.
        DamagedVolumeError: A file cannot be decoded.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    files, strays = _files(path, name, settings)
    if len(files) > 1:
        return stack_volume(path, name, settings, progress, _slice_kind())
    path = files[0]
    check_file(path, name)
    tifffile = _tifffile(name)
    check_pages(path, name)
    with _told_errors(name), tifffile.TiffFile(path) as tiff:
        values, image, number = read_stack(tiff, path, name, settings)
        notes = (
            *pages_told(tiff, number),
            *shown(tiff.series[number].keyframe),
            *unnamed_axes(image),
        )
        slope, intercept, mapped = imagej_scale(tiff)
        spacing, warnings = settled_spacing(tiff_lengths(tiff, number), name, settings, WHAT)
        origin, unused = chosen_origin(imagej_origin(tiff, spacing), settings, WHAT)
        pages = (page for page in tiff.series[number].pages if page is not None)
        # tifffile's paths are absolute
        others = {Path(page.parent.filehandle.path) for page in pages} - {path.absolute()}
    return Volume(
        values=values,
        affine=scale_affine(spacing, origin),
        space="none",
        path=name,
        files=(path, *sorted(others)),
        format="tiff",
        slope=slope,
        intercept=intercept,
        warnings=(*notes, *mapped, *warnings, *unused, *notices("W-FILES-LEFT-OUT", strays)),
    )


def _files(path: Path, name: str, settings: ReadSettings) -> tuple[tuple[Path, ...], list[str]]:
    """Return the file itself, the first of an OME-TIFF in a folder, or its slices; and what is left out.

    Raises:
        VolumeError: As `find_slices` and `ome_set`.
    """
    if not exists(path) or not path.is_dir():
        return (path,), []
    there = [file for file in path.iterdir() if not file.name.startswith(".") and file.is_file()]
    images = [file for file in there if file.suffix.lower() in KINDS["TIFF"]]
    if images:
        found, tifffile = None, _tifffile(name)
        with suppress(DamagedVolumeError), _told_errors(name):  # which may be no slice at all
            check_pages(min(images), name)
            found = ome_set(images, tifffile, name)
        if found is not None:
            strays = sorted(file.name for file in there if file.name not in found.names)
            return (found.first,), left_out(strays, "file", "files")
    return find_slices(path, name, _slice_kind(), settings.allow_outside)[0].files, []


def _slice_kind() -> ImageKind:
    return ImageKind("tiff", "TIFF", KINDS["TIFF"], _opened_slice, LARGEST_RATIO)


def _tifffile(name: str) -> Any:
    """Return the package that reads TIFF.

    Raises:
        UnsupportedFormatError: It is missing.
    """
    try:
        import tifffile
    except ImportError as error:
        raise UnsupportedFormatError(f"{name}: a TIFF file found, but {MISSING}") from error
    return tifffile


def _refuse_packing(error: Exception, name: str) -> None:
    """Raise UnsupportedFormatError where tifffile lacks the package for a TIFF's packing."""
    needs = r"(?:<COMPRESSION\.(\w+)|of (\d+-bit)).*requires the 'imagecodecs' package"
    packed = re.search(needs, told_by(error))
    if packed is not None:
        found = f"compression {packed[1]}" if packed[1] else f"{packed[2]} values"
        raise UnsupportedFormatError(
            f"{name}: a TIFF of {found} found, which needs imagecodecs; pip install imagecodecs, or "
            "write the TIFF uncompressed, or packed by deflate, its values in whole bytes"
        ) from error


@contextmanager
def _told_errors(name: str) -> Iterator[None]:
    """Tell in one message whatever tifffile meets, and nothing else."""
    quiet = logging.getLogger("tifffile")
    level = quiet.level
    quiet.setLevel(logging.CRITICAL + 1)
    try:
        with library_errors(f"{name}: the TIFF cannot be read"):
            try:
                yield
            except Exception as error:
                _refuse_packing(error, name)
                raise
    finally:
        quiet.setLevel(level)


def tiff_entries(path: Path, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return the stack as one entry, with the volumes that it holds; no value of a file with many is read.

    Raises:
        VolumeError: As `tiff_volume`.
    """
    settings = replace(settings, volume_index=0)
    files, _ = _files(path, name, settings)
    if len(files) > 1:
        return [VolumeEntry(description="tiff", size=tiff_volume(path, name, settings).shape)]
    check_file(files[0], name)
    tifffile = _tifffile(name)
    check_pages(files[0], name)
    with _told_errors(name), tifffile.TiffFile(files[0]) as tiff:
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


@contextmanager
def _opened_slice(path: Path, name: str) -> Iterator[Plane]:
    """Open a file of a single page."""
    tifffile = _tifffile(name)
    check_pages(path, name)
    with _told_errors(name), tifffile.TiffFile(path) as tiff:
        page = tiff.pages[0]
        is_colored = page.axes == "YXS" and int(page.photometric) == RGB
        if page.ndim != 2 and not is_colored:
            raise UnsupportedFormatError(
                f"{name}: {path.name} has an image of shape {page.shape}; expected a grey slice"
            )
        if len(tiff.pages) > 1:
            raise UnsupportedFormatError(
                f"{name}: {path.name} has {len(tiff.pages)} pages; expected a slice a file; give a file that "
                "has all slices by itself"
            )
        check_segments(page, name)
        notes = (*shown(page), *_uncalibrated(tiff))
        read = partial(_grey_of_colors, page, path, name) if is_colored else page.asarray
        yield Plane(page.shape[:2], page.dtype, read, notes, told=tiff_lengths(tiff))


def _grey_of_colors(page: Any, path: Path, name: str) -> AnyArray:
    """Return the values of a slice written as colours.

    Raises:
        UnsupportedFormatError: They are not all the same, or not opaque.
    """
    parts: AnyArray = page.asarray()
    if parts.dtype.kind != "u" or not are_grey(parts):
        raise UnsupportedFormatError(
            f"{name}: {path.name} has colours or transparent pixels; expected grey slices; convert them, or "
            "put what is no slice elsewhere"
        )
    return parts[..., 0]


def _uncalibrated(tiff: Any) -> tuple[Notice, ...]:
    """Return what is told of a slice whose values ImageJ calibrates: those of a folder may differ in it."""
    if imagej_scale(tiff) == (1.0, 0.0, ()):
        return ()
    sentence = "ImageJ's calibration of the slices' values is not applied; they are as stored"
    return (Notice("W-VALUES-MAPPED", sentence),)
