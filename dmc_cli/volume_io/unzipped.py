"""Unpack a zip that holds no DICOM, onto the disk and no further than it may.

A zip of DICOM is read entry by entry by the reader of DICOM. Of any other one the entries that can be what
they claim are unpacked into a temporary folder, which is then read as folders are.
"""

import shutil
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from dmc_cli.errors import DamagedVolumeError, DmcError, VolumeError
from dmc_cli.notices import Notice, notices
from dmc_cli.volume_formats import format_of_start, format_of_suffix
from dmc_cli.volume_io.image_kinds import kind_of
from dmc_cli.volume_io.layout import ZARR_MARKERS
from dmc_cli.volume_io.packed import FREE_BYTES, LARGEST_RATIO, inner_name
from dmc_cli.volume_io.stream import LEAST_FREE, MOST_FREE
from dmc_cli.volume_io.zip_archive import ENTRY_MARK, unpacked_start, zip_entries

START_BYTES = 132
"""Bytes of an entry that tell whether it is DICOM."""

ZARR_FILES = (*ZARR_MARKERS, ".zattrs", ".zmetadata")

PASSED_OVER = ("__MACOSX",)
"""Folders that systems put into zips."""


def is_other_zip(path: Path, name: str) -> bool:
    """Return whether a file is a zip in which most volumes or images are no DICOM.

    Raises:
        VolumeError: The zip is encrypted.
        DamagedVolumeError: Its entries cannot be what they claim.
    """
    with path.open("rb") as file:
        start = file.read(START_BYTES)
    if start[:4] != ENTRY_MARK or start[128:] == b"DICM" or not zipfile.is_zipfile(path):
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            entries, _ = zip_entries(archive, name)
            wanted = [entry for entry in entries if _is_wanted(entry.filename)]
            if any(PurePosixPath(entry.filename).name in ZARR_MARKERS for entry in wanted):
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
    """Return whether an entry's suffix means an image or a volume of another format than DICOM."""
    plain = inner_name(entry_name).lower()
    meant = format_of_suffix(entry_name) or format_of_suffix(plain)
    return kind_of(entry_name) is not None or plain.endswith(".hdr") or meant not in (None, "dicom")


def _is_dicom(path: Path, entry: zipfile.ZipInfo) -> bool:
    try:
        return format_of_start(unpacked_start(path, entry, START_BYTES)) == "dicom"
    except Exception:
        return False  # what cannot be unpacked is told by the reader


@contextmanager
def unzipped(path: Path, name: str) -> Iterator[tuple[Path, tuple[Notice, ...]]]:
    """Give a temporary folder with the entries of a zip, gone at the end, and what is left out.

    Raises:
        VolumeError: The disk is too small for them, or the zip is encrypted.
        DamagedVolumeError: It is damaged, or unpacks to far more than its size.
    """
    size = path.stat().st_size
    most = FREE_BYTES + LARGEST_RATIO * size
    with zipfile.ZipFile(path) as archive, tempfile.TemporaryDirectory() as folder:
        entries, notes = zip_entries(archive, name)
        entries = [entry for entry in entries if _is_wanted(entry.filename)]
        total = sum(entry.file_size for entry in entries)
        if total > most:
            raise DamagedVolumeError(
                f"{name}: a zip of {size} bytes found that unpacks to {total}; expected at most {most}; "
                "unpack it yourself if that is right"
            )
        disk = shutil.disk_usage(folder)
        if disk.free - total < min(LEAST_FREE * disk.total, MOST_FREE):
            raise VolumeError(
                f"{name}: a zip found that unpacks to {total >> 20} MiB, and {folder} has {disk.free >> 20} "
                "MiB left; unpack it elsewhere, and give the folder"
            )
        for entry in entries:
            _unpack(archive, entry, Path(folder), name)
        yield Path(folder), tuple(notices("W-FILES-LEFT-OUT", notes))


def _unpack(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, folder: Path, name: str) -> None:
    """Write an entry, no more bytes than it claims, below a folder.

    Raises:
        DamagedVolumeError: It cannot be unpacked.
    """
    target = folder.joinpath(*PurePosixPath(entry.filename.replace("\\", "/")).parts)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with archive.open(entry) as packed, target.open("xb") as file:
            left = entry.file_size
            while left and (piece := packed.read(min(left, 1 << 20))):
                left -= file.write(piece)
    except Exception as error:
        # what the packers raise has no common base
        told = " ".join(str(error).split())[:200]
        raise DamagedVolumeError(
            f"{name}: the zip entry {entry.filename} cannot be unpacked ({told}); get the file again"
        ) from error
