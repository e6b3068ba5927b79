"""Where DICOM files come from: a folder tree, a zip of one, a DICOMDIR, a single file.

Links are followed, but no folder is entered twice. A zip is read entry by entry and never unpacked;
an entry that claims to be larger than its packed bytes can hold, or whose name leads out of the zip, is
not touched.
"""

import io
import os
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from dmc_cli.errors import DamagedVolumeError, VolumeError
from dmc_cli.volume.decoding import new_inflater
from dmc_cli.volume.layout import check_file, exists
from dmc_cli.volume.left_out import left_out

MAX_RATIO = 1040
"""Deflate packs a byte into no less than 1/1032 byte; an entry that claims more is a bomb."""

HEAD_BYTES = (1 << 16, 1 << 26)
"""How much of a zip entry is unpacked to read its header; the second where the first is not enough."""

ENTRY_MARK = b"PK\x03\x04"
"""How a zip's entry begins."""

ENTRY_HEAD = 30
"""Bytes of a zip entry's own header before its name."""

MAX_ENTRY = 1 << 32
"""Largest zip entry that is read."""


@dataclass(frozen=True, eq=False)
class DicomFile:
    """A file that may hold DICOM: on disk, or an entry of an open zip.

    Attributes:
        name: Its name inside the input, for messages and for the order.
        path: The file on disk: itself, or the zip.
        size: Its bytes when unpacked.
        archive: The zip that holds it, or None.
    """

    name: str
    path: Path
    size: int
    archive: zipfile.ZipFile | None = None

    def open(self, most: int | None = None) -> BinaryIO:
        """The file, seekable; a zip entry is unpacked into memory, its first `most` bytes if there are more.

        Raises:
            DamagedVolumeError: It cannot be read.
        """
        try:
            if self.archive is None:
                return self.path.open("rb")
            return io.BytesIO(self._unpacked(self.size if most is None else min(most, self.size)))
        except (OSError, RuntimeError, NotImplementedError, EOFError, zipfile.BadZipFile) as error:
            raise self._unreadable(error) from error
        except Exception as error:
            # zlib.error, lzma.LZMAError: what the packers raise has no common base
            raise self._unreadable(error) from error

    def heads(self) -> Iterator[BinaryIO]:
        """The beginning of the file, then more of it, for a reader that stops when it has enough."""
        if self.archive is None:
            yield self.open()
            return
        for limit in HEAD_BYTES:
            try:
                yield io.BytesIO(self._unpacked(min(limit, self.size)))
            except Exception as error:
                # whatever an unpacker raises
                raise self._unreadable(error) from error
            if limit >= self.size:
                return

    def _unpacked(self, count: int) -> bytes:
        """The first bytes of a zip's entry, its checksum compared where they are all."""
        assert self.archive is not None
        entry = self.archive.getinfo(self.name)
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            with self.archive.open(entry) as stream:
                return stream.read(count)
        with self.path.open("rb") as file:
            file.seek(entry.header_offset)
            head = file.read(ENTRY_HEAD)
            if len(head) < ENTRY_HEAD or head[:4] != ENTRY_MARK:
                raise zipfile.BadZipFile("no entry where the zip's directory says")
            file.seek(sum(struct.unpack_from("<HH", head, 26)), os.SEEK_CUR)
            packed = file.read(entry.compress_size)
        stored = entry.compress_type == zipfile.ZIP_STORED
        content: bytes = packed[:count] if stored else new_inflater(-15).decompress(packed, count)
        if count >= entry.file_size and zlib.crc32(content) != entry.CRC:
            raise zipfile.BadZipFile("wrong checksum")
        return content

    def _unreadable(self, error: Exception) -> DamagedVolumeError:
        told = " ".join(str(error).split())[:200]
        return DamagedVolumeError(f"{self.name}: cannot be read ({told}); get the file again")


@contextmanager
def dicom_files(path: Path, name: str) -> Iterator[tuple[list[DicomFile], list[str]]]:
    """Every regular file of a folder tree or a zip, or the file itself, in the order of their names.

    With them come sentences on a zip's entries that were left out.

    They can be read as long as the context is open.

    Raises:
        VolumeError: The folder or file cannot be read.
        DamagedVolumeError: The zip is damaged.
    """
    if not exists(path):
        check_file(path, name)
    if path.name.upper() == "DICOMDIR" and path.is_file():
        # the index of a file set; the set is the folder that it stands in
        path = path.parent
    if path.is_dir():
        if not os.access(path, os.R_OK | os.X_OK):
            raise VolumeError(f"{name}: no permission to read the folder; check its access rights")
        yield sorted(_walked(path), key=lambda file: file.name), []
        return
    size = check_file(path, name)
    if not zipfile.is_zipfile(path):
        if _begins_as_zip(path):
            raise DamagedVolumeError(
                f"{name}: the zip has no directory of its entries at its end; the file was cut short; get it "
                "again"
            )
        yield [DicomFile(path.name, path, size)], []
        return
    try:
        archive = zipfile.ZipFile(path)
    except Exception as error:
        # besides its own errors zipfile raises what a damaged directory runs it into
        told = " ".join(str(error).split())[:200]
        raise DamagedVolumeError(f"{name}: the zip cannot be read ({told}); get the file again") from error
    with archive:
        yield _zipped(archive, path, name)


def _begins_as_zip(path: Path) -> bool:
    """Whether a file begins with a zip's entry; DICOM may have anything in its preamble."""
    with path.open("rb") as file:
        start = file.read(132)
    return start[:4] == ENTRY_MARK and start[128:] != b"DICM"


def _walked(folder: Path) -> Iterator[DicomFile]:
    """The regular files below a folder, each folder entered once."""
    seen: set[tuple[int, int]] = set()
    for parent, folders, names in os.walk(folder, followlinks=True):
        status = os.stat(parent)  # noqa: PTH116 -- os.walk's own strings, thousands of them
        identity = (status.st_dev, status.st_ino)
        if identity in seen:
            folders.clear()
            continue
        seen.add(identity)
        folders.sort()
        for file_name in sorted(names):
            path = Path(parent, file_name)
            try:
                status = path.stat()
            except OSError:
                continue
            if stat.S_ISREG(status.st_mode) and status.st_size and (status.st_dev, status.st_ino) not in seen:
                seen.add((status.st_dev, status.st_ino))
                yield DicomFile(str(path.relative_to(folder)), path, status.st_size)


def _zipped(archive: zipfile.ZipFile, path: Path, name: str) -> tuple[list[DicomFile], list[str]]:
    """The entries of a zip that can be what they claim, and sentences on those that cannot."""
    entries = archive.infolist()
    full = [entry for entry in entries if entry.filename and not entry.is_dir() and entry.file_size > 0]
    leading = [entry.filename for entry in full if _leads_out(entry.filename)]
    inside = [entry for entry in full if not _leads_out(entry.filename)]
    claiming = [entry.filename for entry in inside if not _can_hold(entry)]
    honest = [entry for entry in inside if _can_hold(entry)]
    if any(entry.flag_bits & 1 for entry in honest):
        raise VolumeError(f"{name}: the zip is encrypted; unpack it and give the folder")
    out = "whose name leads out of the zip"
    notes = [
        *left_out(leading, f"zip entry {out}", f"zip entries {out}"),
        *left_out(
            claiming,
            "zip entry that claims more bytes than it can hold",
            "zip entries that claim more bytes than they can hold",
        ),
    ]
    if not honest and entries:
        empty = len(entries) - len(full)
        found = [*([f"{empty} empty entries or folders found"] if empty else []), *notes]
        raise DamagedVolumeError(
            f"{name}: {'; '.join(found)}; expected a zip of the slices of a series; get the file again"
        )
    files = {entry.filename: DicomFile(entry.filename, path, entry.file_size, archive) for entry in honest}
    return sorted(files.values(), key=lambda file: file.name), notes


def _can_hold(entry: zipfile.ZipInfo) -> bool:
    """Whether a zip's entry can be as large as it claims."""
    return entry.file_size <= min(MAX_ENTRY, MAX_RATIO * entry.compress_size)


def _leads_out(entry_name: str) -> bool:
    """Whether the name of a zip's entry is absolute or climbs: a trick on whoever unpacks it."""
    parts = entry_name.replace("\\", "/").split("/")
    return parts[0] == "" or ".." in parts or parts[0][1:2] == ":"
