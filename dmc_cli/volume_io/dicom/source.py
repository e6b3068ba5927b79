"""Find DICOM files: in a folder tree, a zip of one, by a DICOMDIR, or a single file.

Links are followed as far as they stay in the folder, and no folder is entered twice (`within.py`). What
entries of a zip may be is told by `zip_archive.py`.
"""

import io
import os
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from dmc_cli.errors import DamagedVolumeError, VolumeError
from dmc_cli.volume_io.dicom.effort import Effort
from dmc_cli.volume_io.layout import check_file, exists
from dmc_cli.volume_io.left_out import left_out
from dmc_cli.volume_io.library_errors import library_errors
from dmc_cli.volume_io.within import Bounds, Walk
from dmc_cli.volume_io.zip_archive import ENTRY_MARK, unpacked_start, zip_entries

HEAD_BYTES = (1 << 16, 1 << 26)
"""How much of a zip entry is unpacked to read its header; the second where the first is not enough."""


@dataclass(frozen=True, eq=False)
class DicomFile:
    """A file that may hold DICOM: on disk, or an entry of an open zip.

    Attributes:
        name: Its name inside the input, for messages and for the order.
        path: The file on disk: itself, or the zip.
        size: Its bytes when unpacked.
        effort: What is left for the headers of the input.
        archive: The zip that holds it, or None.
        plain: Where it is unpacked, if it is packed, or None.
    """

    name: str
    path: Path
    size: int
    effort: Effort
    archive: zipfile.ZipFile | None = None
    plain: Path | None = None

    def open(self, most: int | None = None) -> BinaryIO:
        """Open the file, seekable; a zip's entry is unpacked into memory, its first `most` bytes at most.

        Raises:
            DamagedVolumeError: It cannot be read.
        """
        try:
            if self.archive is None:
                return (self.plain or self.path).open("rb")
            return io.BytesIO(self._unpacked(self.size if most is None else min(most, self.size)))
        except (OSError, RuntimeError, NotImplementedError, EOFError, zipfile.BadZipFile) as error:
            raise self._unreadable(error) from error
        except Exception as error:
            # zlib.error, lzma.LZMAError: what the packers raise has no common base
            raise self._unreadable(error) from error

    def heads(self) -> Iterator[BinaryIO]:
        """Yield the beginning of the file, then more of it, for a reader that stops when it has enough."""
        if self.archive is None:
            yield self.open()
            return
        for limit in HEAD_BYTES:
            count = min(limit, self.size)
            try:
                if limit > HEAD_BYTES[0]:
                    self.effort.take_bytes(count)
                yield io.BytesIO(self._unpacked(count))
            except Exception as error:
                # whatever an unpacker raises
                raise self._unreadable(error) from error
            if limit >= self.size:
                return

    def _unpacked(self, count: int) -> bytes:
        """Return the first bytes of a zip's entry."""
        assert self.archive is not None
        return unpacked_start(self.path, self.archive.getinfo(self.name), count)

    def _unreadable(self, error: Exception) -> DamagedVolumeError:
        told = " ".join(str(error).split())[:200]
        return DamagedVolumeError(f"{self.name}: cannot be read ({told}); get the file again")


@contextmanager
def dicom_files(path: Path, name: str, allow_outside: bool) -> Iterator[tuple[list[DicomFile], list[str]]]:
    """Yield every regular file of a folder tree or a zip, or the file itself, in the order of their names.

    With them come sentences on what was left out: entries of a zip, links out of a folder.

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
        yield _walked(path, allow_outside)
        return
    size = check_file(path, name)
    if not zipfile.is_zipfile(path):
        if _begins_as_zip(path):
            raise DamagedVolumeError(
                f"{name}: the zip has no directory of its entries at its end; the file was cut short; get it "
                "again"
            )
        yield [DicomFile(path.name, path, size, Effort(size))], []
        return
    # besides its own errors zipfile raises what a damaged directory runs it into
    with library_errors(f"{name}: the zip cannot be read"):
        archive = zipfile.ZipFile(path)
    with archive:
        entries, notes = zip_entries(archive, name)
        effort = Effort(size)
        files = [DicomFile(e.filename, path, e.file_size, effort, archive) for e in entries]
        yield sorted(files, key=lambda file: file.name), notes


def _begins_as_zip(path: Path) -> bool:
    """Return whether a file begins with a zip's entry; DICOM may have anything in its preamble."""
    with path.open("rb") as file:
        start = file.read(132)
    return start[:4] == ENTRY_MARK and start[128:] != b"DICM"


def _walked(folder: Path, allow_outside: bool) -> tuple[list[DicomFile], list[str]]:
    """Return the regular files below a folder, each once, and sentences on what was not looked at."""
    walk = Walk(folder, Bounds(folder, allow_outside=allow_outside))
    seen: dict[tuple[int, int], tuple[str, int]] = {}
    for name, status in walk.files():
        if status.st_size:
            seen.setdefault((status.st_dev, status.st_ino), (name, status.st_size))
    effort = Effort(sum(size for _, size in seen.values()))
    files = [DicomFile(name, folder / name, size, effort) for name, size in seen.values()]
    reasons: dict[str, list[str]] = {}
    for name, reason in walk.skipped:
        reasons.setdefault(reason, []).append(name)
    notes = [
        sentence
        for reason, names in reasons.items()
        for sentence in left_out(names, f"file or folder ({reason})", f"files or folders ({reason})")
    ]
    return sorted(files, key=lambda file: file.name), notes
