"""Find out what an input is: its format, and the file or folder that holds it once it is unpacked.

The format is the one that the settings name, else the suffix's, else what the content looks like.
"""

import math
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dmc_cli.errors import UnsupportedFormatError, VolumeError
from dmc_cli.notices import Notice
from dmc_cli.settings import STREAM, ReadSettings
from dmc_cli.volume_formats import FORMATS, format_of_suffix, known_suffixes, reader
from dmc_cli.volume_io.content import START, first_bytes, format_of_content
from dmc_cli.volume_io.folder import file_of_format, folder_content
from dmc_cli.volume_io.hdf_path import split_dataset
from dmc_cli.volume_io.layout import Encoding, Layout, check_file, exists
from dmc_cli.volume_io.packed import file_packing, inner_name, packed_layout, unpacked_file
from dmc_cli.volume_io.pair import is_detached, pair_files
from dmc_cli.volume_io.raw import RAW_TYPES
from dmc_cli.volume_io.stream import spooled
from dmc_cli.volume_io.unarchived import is_unpacked_first, unarchived

LONGEST_VALUE = {"raw": 1, "gzip": 2, "bzip2": 2, "xz": 2, "zstd": 2, "text": 40, "hex": 4}
"""Stored bytes a byte of a value, at most, in any sensible file."""

STREAM_SLACK = 1 << 20
"""Bytes behind the values that are read, too."""


FOLDERS = ("dicom", "images", "tiff", "zarr")
"""Formats whose readers take a folder."""

MOST_LAYERS = 3
"""How often something packed may be packed again."""


@dataclass(frozen=True)
class Input:
    """An input that a reader can read.

    Attributes:
        format_name: Which reader.
        path: The file or folder.
        packed: The input's file that it was unpacked from, or None where it is there.
        notices: What of the input is left out.
    """

    format_name: str
    path: Path
    packed: Path | None = None
    notices: tuple[Notice, ...] = ()


@contextmanager
def opened(path: Path, name: str, settings: ReadSettings) -> Iterator[Input]:
    """Give what a reader can read of an input; temporary files with what was packed are gone at the end.

    Raises:
        VolumeError: There is no such path, or it is empty.
        UnsupportedFormatError: No reader knows it.
        DamagedVolumeError: It cannot be unpacked, or unpacks to far more than its size.
    """
    _check_name(name)
    (place, dataset), packed = split_dataset(path), None
    notices: tuple[Notice, ...] = ()
    with ExitStack() as layers:
        for _ in range(MOST_LAYERS):
            if _is_archive(place, name, settings):
                packed = packed or place
                place, left = layers.enter_context(unarchived(place, name))
                notices += left
            if not _is_folder(place):
                format_name = input_format(place, name, settings)
            elif settings.input_format is None:
                content = folder_content(place, name)
                format_name, place = content.format_name, content.path
                notices += content.notices
            else:
                format_name = settings.input_format
                if format_name not in FOLDERS:
                    place = file_of_format(place, format_name, name)
            packing = _packing(place, format_name)
            if packing is None:
                inner = Path(f"{place}:{dataset}") if dataset and format_name == "hdf5" else place
                yield Input(format_name, inner, packed, notices)
                return
            packed = packed or place
            place = layers.enter_context(
                unpacked_file(place, packing, name, lambda start: _promised(start, name, settings))
            )
        raise UnsupportedFormatError(
            f"{name}: a file packed more than {MOST_LAYERS - 1} times found; expected one packed once; "
            "unpack it"
        )


def _check_name(name: str) -> None:
    if not name or "\0" in name:
        raise VolumeError(f"the path {name!r} found; expected a file, a folder or synth:FIELD:N; check it")


def _is_archive(path: Path, name: str, settings: ReadSettings) -> bool:
    """Return whether a path is an archive that has to be unpacked for a reader."""
    told = settings.input_format
    is_likely = exists(path) and path.is_file() and (told or input_format(path, name, settings) == "dicom")
    return bool(is_likely) and is_unpacked_first(path, name, told)


def _is_folder(path: Path) -> bool:
    return exists(path) and path.is_dir()


def _packing(path: Path, format_name: str) -> Encoding | None:
    """Return what a file is packed by as a whole, or None where its reader takes it as it is."""
    is_read = path.is_dir() or FORMATS[format_name].unpacks or is_detached(path)
    return None if is_read else file_packing(path)


def input_format(path: Path, name: str, settings: ReadSettings) -> str:
    """Return the format that a path is read as.

    Raises:
        VolumeError: There is no such path, or it is empty.
        UnsupportedFormatError: No reader knows it.
    """
    _check_name(name)
    if settings.input_format is not None:
        return settings.input_format
    path, _ = split_dataset(path)
    if _is_folder(path):
        return folder_content(path, name).format_name
    check_file(path, name)
    by_suffix = format_of_suffix(path.name) or format_of_suffix(inner_name(path.name))
    if by_suffix is not None:
        return by_suffix
    header, _ = pair_files(path)
    check_file(header, name)
    found = format_of_content(header, name)
    if found is None:
        raise UnsupportedFormatError(
            f"{name}: neither its suffix nor its content is one that is known; expected one of "
            f"{', '.join(known_suffixes())}, .hdr with .img, a folder (slices, a Zarr store, one volume), or "
            "--input-format (raw needs --shape and --dtype too)"
        )
    return found


def read_layout(format_name: str, path: Path, name: str, settings: ReadSettings) -> Layout:
    """Return where a file's values lie, of a format whose header tells it."""
    layout: Layout = reader(FORMATS[format_name].layout)(path, name, settings)
    return layout if format_name == "raw" else packed_layout(layout, path)


def spooled_input(settings: ReadSettings) -> AbstractContextManager[Path]:
    """Give a temporary file with standard input, as much of it as its header asks for.

    Raises:
        VolumeError: It begins like no volume, cannot be read, or has no end.
    """
    return spooled(sys.stdin.buffer.read, STREAM, STREAM, lambda start: _promised(start, STREAM, settings))


def _promised(start: Path, name: str, settings: ReadSettings) -> int | None:
    """Return how many bytes of a stream its header asks for at most; None where it does not tell.

    Raises:
        VolumeError: It begins like no volume.
        SettingsError: The format needs a setting that is missing or wrong.
    """
    format_name = input_format(start, name, settings)
    if _packing(start, format_name) is not None:
        return None
    if format_name == "raw" and settings.shape and settings.dtype in RAW_TYPES:
        return settings.skip_bytes + math.prod(settings.shape) * np.dtype(settings.dtype).itemsize + 1
    if FORMATS[format_name].layout:
        layout = read_layout(format_name, start, name, settings)
        values = layout.start + max(layout.offset, 0) + layout.volume_bytes * layout.volumes
        return None if layout.line_skip else LONGEST_VALUE[layout.encoding] * values + STREAM_SLACK
    if not FORMATS[format_name].can_begin(first_bytes(start, name, START)):
        raise UnsupportedFormatError(
            f"{name}: {'standard input' if name == STREAM else 'what is packed'} does not begin like "
            f"{format_name}; check --input-format, or give a file"
        )
    return None
