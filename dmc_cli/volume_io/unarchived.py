"""Unpack a zip or a tar onto the disk, and no further than it may.

A zip of DICOM is read entry by entry by the reader of DICOM. Of any other archive the entries that can be
what they claim are unpacked into a temporary folder, which is then read as folders are.
"""

import shutil
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import IO, Any, NamedTuple

from dmc_cli.errors import DamagedVolumeError, DmcError, VolumeError
from dmc_cli.notices import Notice, notices
from dmc_cli.volume_formats import ARCHIVES, format_of_suffix
from dmc_cli.volume_io.content import begins_as_dicom
from dmc_cli.volume_io.image_kinds import kind_of
from dmc_cli.volume_io.layout import ZARR_MARKERS
from dmc_cli.volume_io.library_errors import library_errors
from dmc_cli.volume_io.packed import (
    FREE_BYTES,
    LARGEST_RATIO,
    inner_name,
    packing_of,
    plain_file,
    unpacked_stream,
)
from dmc_cli.volume_io.stream import LEAST_FREE, MOST_FREE
from dmc_cli.volume_io.tar_archive import is_tar, tar_entries
from dmc_cli.volume_io.zip_archive import ENTRY_MARK, unpacked_start, zip_entries

START_BYTES = 132
"""Bytes of an entry that tell whether it is DICOM."""

PACKED_START = 1 << 16
"""Bytes of an entry from which so many can be unpacked."""

ZARR_FILES = (*ZARR_MARKERS, ".zattrs", ".zmetadata")

PASSED_OVER = ("__MACOSX",)
"""Folders that systems put into archives."""


class Entry(NamedTuple):
    """A file in an archive.

    Attributes:
        name: As the archive has it.
        size: Bytes that it claims to unpack to.
        open: Opens it.
    """

    name: str
    size: int
    open: Callable[[], IO[bytes]]


def is_unpacked_first(path: Path, name: str, told_format: str | None) -> bool:
    """Return whether a file is an archive that no reader takes: a tar, or a zip of something else than DICOM.

    Args:
        path: The file.
        name: The input, for messages.
        told_format: What the user says that it is.

    Raises:
        VolumeError: The zip is encrypted.
        DamagedVolumeError: Its entries cannot be what they claim.
    """
    with path.open("rb") as file:
        start = file.read(START_BYTES)
    if start[128:] == b"DICM":
        return False
    if start[:4] != ENTRY_MARK:
        return is_tar(path)
    if told_format in ("dicom", "numpy") or not zipfile.is_zipfile(path):
        return False
    return told_format is not None or _holds_others(path, name)


def _holds_others(path: Path, name: str) -> bool:
    """Return whether most volumes or images of a zip are no DICOM."""
    try:
        with zipfile.ZipFile(path) as archive:
            entries, _ = zip_entries(archive, name)
            wanted = [entry for entry in entries if _is_wanted(entry.filename)]
            if any(PurePosixPath(entry.filename).name in ZARR_MARKERS for entry in wanted):
                return True
            packed = (entry for entry in wanted if inner_name(entry.filename) != Path(entry.filename).name)
            if any(_is_dicom(path, entry) for entry in islice(packed, 1)):
                return True
            others = {entry.filename for entry in wanted if _is_other(entry.filename)}
            found = 0
            for entry in wanted if others else ():
                found += entry.filename not in others and _is_dicom(path, entry)
                if found >= len(others):
                    return False
            return bool(others)
    except DmcError:
        raise
    except Exception:
        return False  # the reader of DICOM tells what is wrong with it


def _is_wanted(entry_name: str) -> bool:
    parts = PurePosixPath(entry_name).parts
    if parts[0] in PASSED_OVER:
        return False
    return parts[-1] in ZARR_FILES or not parts[-1].startswith(".")


def _is_other(entry_name: str) -> bool:
    """Return whether an entry's suffix means an archive, an image or a volume, but for DICOM."""
    plain = inner_name(entry_name).lower()
    meant = format_of_suffix(entry_name) or format_of_suffix(plain)
    is_plain = kind_of(entry_name) is None and not plain.endswith((".hdr", *ARCHIVES))
    return not is_plain or meant not in (None, "dicom")


def _is_dicom(path: Path, entry: zipfile.ZipInfo) -> bool:
    """Return whether an entry begins like DICOM, unpacked where it is packed."""
    try:
        start = unpacked_start(path, entry, PACKED_START)
        packing = packing_of(start)
        if packing is not None:
            start = unpacked_stream(BytesIO(start), packing, entry.filename).read(START_BYTES)
        return begins_as_dicom(start)
    except Exception:
        return False  # what cannot be unpacked is told by the reader


@contextmanager
def unarchived(path: Path, name: str) -> Iterator[tuple[Path, tuple[Notice, ...]]]:
    """Give a temporary folder with the files of a zip or a tar, gone at the end, and what is left out.

    Raises:
        VolumeError: The disk is too small for them, or the zip is encrypted.
        DamagedVolumeError: It is damaged, or unpacks to far more than its size.
    """
    size = path.stat().st_size
    most = FREE_BYTES + LARGEST_RATIO * size
    with tempfile.TemporaryDirectory() as folder:
        with _entries(path, name) as (found, notes):
            entries = [entry for entry in found if _is_wanted(entry.name)]
            total = sum(entry.size for entry in entries)
            if total > most:
                raise DamagedVolumeError(
                    f"{name}: an archive of {size} bytes found that unpacks to {total}; expected at most "
                    f"{most}; unpack it yourself if that is right"
                )
            disk = shutil.disk_usage(folder)
            if disk.free - total < min(LEAST_FREE * disk.total, MOST_FREE):
                raise VolumeError(
                    f"{name}: an archive found that unpacks to {total >> 20} MiB, and {folder} has "
                    f"{disk.free >> 20} MiB left; unpack it elsewhere, and give the folder"
                )
            for entry in entries:
                _unpack(entry, Path(folder), name)
        yield Path(folder), tuple(notices("W-FILES-LEFT-OUT", notes))


@contextmanager
def _entries(path: Path, name: str) -> Iterator[tuple[list[Entry], list[str]]]:
    """Give the files of an archive, in whatever it is packed, as long as it is open, and what is left out."""
    if not is_tar(path):
        with zipfile.ZipFile(path) as archive:
            entries, notes = zip_entries(archive, name)
            yield [_entry(archive.open, entry, entry.filename, entry.file_size) for entry in entries], notes
        return
    with (
        plain_file(path, name) as plain,
        tar_entries(plain, path.stat().st_size, name) as (tar, files, notes),
    ):
        yield [_entry(tar.extractfile, file, file.name, file.size) for file in files], notes


def _entry(open_entry: Callable[[Any], Any], entry: Any, name: str, size: int) -> Entry:
    return Entry(name, size, lambda: open_entry(entry))


def _unpack(entry: Entry, folder: Path, name: str) -> None:
    """Write an entry, no more bytes than it claims, below a folder.

    Raises:
        DamagedVolumeError: It cannot be unpacked.
    """
    target = folder.joinpath(*PurePosixPath(entry.name.replace("\\", "/")).parts)
    with library_errors(f"{name}: the archive's entry {entry.name} cannot be unpacked"):
        target.parent.mkdir(parents=True, exist_ok=True)
        with entry.open() as packed, target.open("xb") as file:
            left = entry.size
            while left and (piece := packed.read(min(left, 1 << 20))):
                left -= file.write(piece)
