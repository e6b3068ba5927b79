"""Read a volume from a path, whatever its format: the one way in.

The format is the one that the settings name, else the suffix's, else what the content looks like.
A new format is a file with a reader, and a line in `formats.py`.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from dmc_cli.errors import DmcError, UnsupportedFormatError, VolumeError
from dmc_cli.notices import refuse_uncertain
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import STREAM, ReadSettings
from dmc_cli.volume import Volume, VolumeEntry
from dmc_cli.volume_formats import FORMATS, format_of_suffix, known_suffixes, reader
from dmc_cli.volume_io.content import START, first_bytes, format_of_content
from dmc_cli.volume_io.layout import Layout, check_file, exists, file_entry
from dmc_cli.volume_io.pair import pair_files
from dmc_cli.volume_io.raw import RAW_TYPES
from dmc_cli.volume_io.stream import spooled_stream
from dmc_cli.volume_io.synthetic import PREFIX, parse_synthetic, synthetic_volume
from dmc_cli.volume_io.unused_options import unused_options
from dmc_cli.volume_io.values import load_volume
from dmc_cli.volume_io.zarr import is_zarr

LONGEST_VALUE = {"raw": 1, "gzip": 2, "bzip2": 2, "text": 40, "hex": 4}
"""Stored bytes per byte of a value, at most, in any sensible file."""

STREAM_SLACK = 1 << 20
"""Bytes behind the values that are read, too."""


def read_volume(path: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Read a volume: a file, a folder (DICOM, TIFF, Zarr), a zip with DICOM, `synth:FIELD:N`, or `-`.

    Args:
        path: The input as the user named it.
        settings: How to read it; what the format does not need is ignored, with a warning.
        progress: Who is told the stages.

    Returns:
        The volume, at least two nodes along each axis, its affine invertible.

    Raises:
        VolumeError: The input cannot be used; its subclasses tell why.
        AmbiguousVolumeError: Several volumes, or `settings.strict` and a warning about meaning.
        SettingsError: The format needs a setting that is missing or wrong.
        MemoryBudgetError: The values do not fit into the memory that is free.
    """
    if path.startswith(PREFIX):
        return _warned(synthetic_volume(path, settings, progress), "synthetic", settings)
    with _told_errors(path):
        if path == STREAM:
            with spooled_stream(lambda start: _promised(start, settings)) as file:
                return replace(_read_path(file, STREAM, settings, progress), files=())
        return _read_path(Path(path), path, settings, progress)


def check_input(path: str, settings: ReadSettings) -> None:
    """Find out, without reading it, whether there is an input and a reader for it.

    Raises:
        VolumeError: There is no such input, or it is empty.
        UnsupportedFormatError: No reader knows it.
    """
    if path.startswith(PREFIX):
        parse_synthetic(path)
    elif path != STREAM:
        with _told_errors(path):
            input_format(Path(path), path, settings)


def list_volumes(path: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return what there is to choose from in an input: the series of a folder, or the one volume of a file.

    The values are not read. A file with several volumes is one entry that tells how many.

    Raises:
        VolumeError: The input cannot be used; its subclasses tell why.
        SettingsError: The format needs a setting that is missing or wrong.
    """
    if path.startswith(PREFIX):
        field, count = parse_synthetic(path)
        return [VolumeEntry(description=f"synthetic field {field}", size=(count, count, count))]
    with _told_errors(path):
        return _entries(Path(path), path, settings)


def _entries(path: Path, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return the entries of a file or folder."""
    format_name = input_format(path, name, settings)
    known = FORMATS[format_name]
    if known.entries:
        found: list[VolumeEntry] = reader(known.entries)(path, name, settings)
        return found
    layout = read_layout(format_name, path, name, replace(settings, volume_index=0))
    is_filtered = settings.channel is not None or settings.time is not None
    count = len(layout.listed) if is_filtered and layout.listed else layout.count
    return [file_entry(format_name, count, layout.shape, layout.listed)]


def input_format(path: Path, name: str, settings: ReadSettings) -> str:
    """Return the format that a path is read as.

    Raises:
        VolumeError: There is no such path, or it is empty.
        UnsupportedFormatError: No reader knows it.
    """
    if not name or "\0" in name:
        raise VolumeError(f"the path {name!r} found; expected a file, a folder or synth:FIELD:N; check it")
    if settings.input_format is not None:
        return settings.input_format
    if exists(path) and path.is_dir():
        return _format_of_folder(path, name)
    check_file(path, name)
    by_suffix = format_of_suffix(path.name)
    if by_suffix is not None:
        return by_suffix
    header, _ = pair_files(path)
    check_file(header, name)
    found = format_of_content(header, name)
    if found is None:
        raise UnsupportedFormatError(
            f"{name}: neither its suffix nor its content is one that is known; expected one of "
            f"{', '.join(known_suffixes())}, .hdr with .img, a folder (DICOM or TIFF slices, a Zarr store), "
            "or --input-format (raw needs --shape and --dtype too)"
        )
    return found


def read_layout(format_name: str, path: Path, name: str, settings: ReadSettings) -> Layout:
    """Return where a file's values lie, of a format whose header tells it."""
    layout: Layout = reader(FORMATS[format_name].layout)(path, name, settings)
    return layout


@contextmanager
def _told_errors(name: str) -> Iterator[None]:
    """Tell in one message what the system refuses while an input is read, wherever a reader meets it."""
    try:
        yield
    except (DmcError, BrokenPipeError):
        raise
    except (OSError, UnicodeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise VolumeError(
            f"{name}: cannot be read ({reason}); expected files that can be read to their end; check the "
            "path, the disk and the access rights"
        ) from error


def _read_path(path: Path, name: str, settings: ReadSettings, progress: Progress) -> Volume:
    format_name = input_format(path, name, settings)
    known = FORMATS[format_name]
    if known.read:
        volume: Volume = reader(known.read)(path, name, settings, progress)
    else:
        volume = load_volume(read_layout(format_name, path, name, settings), progress)
    return _warned(volume, format_name, settings)


def _warned(volume: Volume, format_name: str, settings: ReadSettings) -> Volume:
    """Return the volume with a warning for each option that has no effect on its format.

    Raises:
        AmbiguousVolumeError: `settings.strict`, and a warning is about the meaning of the file.
    """
    if settings.strict:
        refuse_uncertain(volume.warnings, volume.path)
    return replace(volume, warnings=(*unused_options(format_name, settings), *volume.warnings))


def _promised(start: Path, settings: ReadSettings) -> int | None:
    """Return how many bytes of standard input its header asks for at most; None where it does not tell.

    Raises:
        VolumeError: It begins like no volume.
        SettingsError: The format needs a setting that is missing or wrong.
    """
    format_name = input_format(start, STREAM, settings)
    if format_name == "raw" and settings.shape and settings.dtype in RAW_TYPES:
        return settings.skip_bytes + math.prod(settings.shape) * np.dtype(settings.dtype).itemsize + 1
    if FORMATS[format_name].layout:
        layout = read_layout(format_name, start, STREAM, settings)
        values = layout.start + max(layout.offset, 0) + layout.volume_bytes * layout.volumes
        return None if layout.line_skip else LONGEST_VALUE[layout.encoding] * values + STREAM_SLACK
    if not FORMATS[format_name].can_begin(first_bytes(start, STREAM, START)):
        raise UnsupportedFormatError(
            f"{STREAM}: standard input does not begin like {format_name}; check --input-format, or give "
            "a file"
        )
    return None


def _format_of_folder(path: Path, name: str) -> str:
    """Return the format of a folder: a Zarr store, nothing but TIFF slices, or else DICOM."""
    if is_zarr(path):
        return "zarr"
    try:
        files = [entry.name.lower() for entry in path.iterdir() if not entry.name.startswith(".")]
    except OSError as error:
        raise VolumeError(
            f"{name}: the folder cannot be read ({error.strerror}); check its access rights"
        ) from error
    is_stack = len(files) > 1 and all(file.endswith((".tif", ".tiff")) for file in files)
    return "tiff" if is_stack else "dicom"
