"""Tell what a folder holds: a Zarr store, a stack of images, one volume in a file, or DICOM.

The kind that most files share wins; its reader names the others. Where no name has the suffix of an image or
of another format, it is DICOM, whose files have any name, and no file is opened.
"""

import os
from dataclasses import dataclass, replace
from pathlib import Path

from dmc_cli.errors import AmbiguousVolumeError, DmcError, UnsupportedFormatError, VolumeError
from dmc_cli.notices import Notice, notices
from dmc_cli.volume_formats import ARCHIVES, format_of_suffix
from dmc_cli.volume_io.content import begins_as_dicom, first_bytes, format_of_content
from dmc_cli.volume_io.image_kinds import kind_of, most_common_kind
from dmc_cli.volume_io.layout import exists
from dmc_cli.volume_io.left_out import left_out, shortened
from dmc_cli.volume_io.packed import inner_name
from dmc_cli.volume_io.pair import PAIRS
from dmc_cli.volume_io.within import Bounds, Walk
from dmc_cli.volume_io.zarr import is_zarr

DATA_SUFFIXES = tuple(data for _, data in PAIRS)
"""Files that belong to a header beside them."""

NO_VOLUMES = ("dicom", "raw", "zarr", "tiff", "images")
"""Formats whose files are no volumes by themselves in a folder."""

SYSTEM_FOLDERS = ("__macosx",)

TEXTS = (".txt", ".log", ".ini", ".md", ".pdf", ".html", ".csv", ".json", ".xml", ".db", ".sha256", ".md5")
"""Suffixes of what lies beside the only folder that is meant."""

MOST_NESTED = 8
"""Folders that hold nothing but one other folder, at most."""


@dataclass(frozen=True)
class FolderContent:
    """What a folder holds.

    Attributes:
        format_name: Its reader.
        path: The folder, one in it, or the only volume's file.
        notices: What is left out of it.
    """

    format_name: str
    path: Path
    notices: tuple[Notice, ...] = ()


def folder_content(path: Path, name: str) -> FolderContent:
    """Return what a folder holds.

    Raises:
        VolumeError: It cannot be read.
        AmbiguousVolumeError: Several volumes, or as many images of two kinds.
    """
    folder, files, folders, strays = _entered(path, name)
    content = _content(path, folder, files, folders, name)
    told = left_out(strays, "file", "files") if content.format_name != "dicom" else []
    return replace(content, notices=(*notices("W-FILES-LEFT-OUT", told), *content.notices))


def file_of_format(folder: Path, wanted: str, name: str) -> Path:
    """Return the only file below a folder whose suffix means a format, or the only one that is no text.

    Args:
        folder: Where to look.
        wanted: The format that the user has named, one of files.
        name: The input, for messages.

    Raises:
        AmbiguousVolumeError: There is none, or there are several.
    """
    walk = Walk(folder, Bounds(folder))
    files = [file for file, _ in walk.files() if not file.rpartition("/")[2].startswith(".")]
    plain = {file: inner_name(file) for file in files}
    fitting = [file for file in files if wanted in (format_of_suffix(file), format_of_suffix(plain[file]))]
    found = fitting or [file for file in files if not plain[file].lower().endswith(TEXTS)]
    if len(found) != 1:
        raise AmbiguousVolumeError(
            f"{name}: {len(found)} files found that may be {wanted} ({shortened(found, ', ') or 'none'}); "
            "expected one; give the file that is wanted"
        )
    return folder / found[0]


def _content(path: Path, folder: Path, files: list[str], folders: list[str], name: str) -> FolderContent:
    """Return what a folder holds that was entered from a path."""
    if is_zarr(folder):
        return FolderContent("zarr", folder)
    volumes = [file for file in files if _is_volume(file)]
    image = most_common_kind(files, name)
    if not volumes and image is None:
        if len(folders) == 1 and not files and is_zarr(folder / folders[0]):
            return FolderContent("zarr", folder / folders[0])
        return _neither(path, folder, files, name)
    kind, images = image or ("", 0)
    is_stack = images >= max(2, len(volumes)) or not volumes
    others = {file for file in files if kind_of(file) is None and file not in volumes}
    if _holds_dicom(folder, others, images if is_stack else len(volumes)):
        return FolderContent("dicom", path)
    if is_stack:
        return FolderContent("tiff" if kind == "TIFF" else "images", folder)
    if len(volumes) > 1:
        raise AmbiguousVolumeError(
            f"{name}: {len(volumes)} volumes found in the folder ({shortened(volumes, ', ')}); expected one; "
            "give the file that is wanted"
        )
    return _single(folder, volumes[0], [file for file in files if file != volumes[0]])


def _neither(path: Path, folder: Path, files: list[str], name: str) -> FolderContent:
    """Return what a folder is that holds no volume or image by their names: a raw file, or DICOM.

    Raises:
        AmbiguousVolumeError: There are volumes or images in folders of it, and no DICOM.
        UnsupportedFormatError: There are archives in it, and nothing else.
    """
    raw = [file for file in files if format_of_suffix(inner_name(file)) == "raw"]
    others = {file for file in files if file not in raw}
    if len(raw) == 1 and not _holds_dicom(folder, others, 1):
        return _single(folder, raw[0], [*others])
    below: dict[str, str] = {}
    archives: list[str] = []
    for file, status in Walk(folder, Bounds(folder)).files():
        inner, _, last = file.rpartition("/")
        if _is_volume(last) or kind_of(last) is not None:
            below.setdefault(inner, file)
        elif inner_name(last).lower().endswith(ARCHIVES):
            archives.append(file)
        elif not last.lower().endswith(TEXTS) and status.st_size and _is_dicom(folder / file):
            return FolderContent("dicom", path)
    if len(below) > 1:
        raise AmbiguousVolumeError(
            f"{name}: {len(below)} folders found with volumes or images "
            f"({shortened([*below.values()], ', ')}); expected one; give the folder or file that is wanted"
        )
    if archives and not below:
        raise UnsupportedFormatError(
            f"{name}: nothing but {'an archive' if len(archives) == 1 else 'archives'} found in it "
            f"({shortened(archives, ', ')}); expected a volume or slices; an archive in another one or in a "
            "folder is not opened: unpack it, or give it alone"
        )
    return FolderContent("dicom", path)


def _entered(path: Path, name: str) -> tuple[Path, list[str], list[str], list[str]]:
    """Return the first folder that holds more than texts and another one, what it holds, and those texts.

    What it holds are the names of its files and of its folders.
    """
    strays: list[str] = []
    for _ in range(MOST_NESTED):
        files, folders = _listed(path, name)
        texts = [file for file in files if file.lower().endswith(TEXTS)]
        if len(texts) < len(files) or len(folders) != 1 or is_zarr(path):
            break
        strays += texts
        path = path / folders[0]
    return path, files, folders, strays


def _listed(folder: Path, name: str) -> tuple[list[str], list[str]]:
    """Return the names of a folder's files and of its folders, without hidden ones."""
    try:
        with os.scandir(folder) as listing:
            entries = sorted((e.name, Path(e.path).is_dir()) for e in listing if not e.name.startswith("."))
    except OSError as error:
        raise VolumeError(
            f"{name}: the folder cannot be read ({error.strerror}); check its access rights"
        ) from error
    folders = [entry for entry, is_folder in entries if is_folder and entry.lower() not in SYSTEM_FOLDERS]
    return [entry for entry, is_folder in entries if not is_folder], folders


def _is_volume(file: str) -> bool:
    """Return whether a file's suffix means a volume, with the header of a pair for both of its files."""
    plain = inner_name(file).lower()
    if plain.endswith(DATA_SUFFIXES):
        return False
    return (
        plain.endswith(".hdr")
        or (format_of_suffix(file) or format_of_suffix(plain) or "raw") not in NO_VOLUMES
    )


def _holds_dicom(folder: Path, others: set[str], count: int) -> bool:
    """Return whether so many files or more below a folder are DICOM; `others` are those in it that may be."""
    found = 0
    for file, status in Walk(folder, Bounds(folder)).files():
        may_be = file in others if "/" not in file else kind_of(file) is None and not _is_volume(file)
        if not status.st_size or not may_be:
            continue
        found += _is_dicom(folder / file)
        if found >= max(count, 1):
            return True
    return False


def _is_dicom(path: Path) -> bool:
    """Return whether a file is named or begins like DICOM, packed or not."""
    plain = inner_name(path.name).lower()
    if format_of_suffix(plain) == "dicom":
        return not plain.endswith(ARCHIVES)
    try:
        return begins_as_dicom(first_bytes(path, path.name, 132))
    except (OSError, DmcError):
        return False


def _format_of_pair(header: Path) -> str:
    """Return which of the formats of pairs a .hdr is of."""
    return format_of_content(header, header.name) or "analyze"


def _single(folder: Path, volume: str, others: list[str]) -> FolderContent:
    """Return the only volume of a folder; its data files are no strays."""
    plain = inner_name(volume)
    found = format_of_suffix(volume) or format_of_suffix(plain) or _format_of_pair(folder / volume)
    stem = plain[: plain.rfind(".")].lower() if "." in plain else plain.lower()
    strays = [other for other in others if not other.lower().startswith(stem)]
    told = tuple(Notice("W-FILES-LEFT-OUT", sentence) for sentence in left_out(strays, "file", "files"))
    if plain.lower().endswith((".nhdr", ".mhd")):  # their headers name files of any name
        told = ()
    assert exists(folder / volume)
    return FolderContent(found, folder / volume, told)
