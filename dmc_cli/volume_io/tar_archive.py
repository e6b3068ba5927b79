"""Look at the entries of a tar: which of them are files in it, and what is said of the others.

Headers are tarfile's, which takes as many and as long ones as a tar claims; so they are counted as it reads.
"""

import re
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.content import first_bytes
from dmc_cli.volume_io.left_out import left_out
from dmc_cli.volume_io.library_errors import library_errors
from dmc_cli.volume_io.zip_archive import MAX_ENTRIES, leads_out

LONGEST_HEADER = 1 << 20
"""Bytes of the header of an entry, with all that its maker put before it."""

FREE_BYTES = 1 << 24
"""Bytes that such additions may have in all, beside one for each byte of the input."""

FREE_ENTRIES, BYTES_AN_ENTRY = 20_000, 64
"""Entries that any tar may have, and beyond them bytes of the input for each: a packed header takes more."""

MOST_FIELDS = 1000
"""Fields of an entry; those that count for all entries that follow are copied for each."""

_DIGITS = re.compile(rb"\d{100}")
"""More than any number has: tarfile's pattern for them takes the second power of their count."""

BLOCK = 512


def is_tar(path: Path) -> bool:
    """Return whether a file, unpacked where it is packed, begins with the header of a tar's entry."""
    try:
        tarfile.TarInfo.frombuf(first_bytes(path, path.name, BLOCK), "utf-8", "surrogateescape")
    except Exception:
        return False  # what tarfile raises has no common base
    return True


class _Guarded:
    """A file of which headers take no more than they may.

    Attributes:
        allowed: Bytes left for the header of this entry; None where no header is read.
    """

    def __init__(self, file: BinaryIO, additions: int) -> None:
        """Guard a file whose headers may have so many bytes of additions in all."""
        self._file = file
        self._additions = additions
        self.allowed: int | None = LONGEST_HEADER
        self.seek = file.seek
        self.tell = file.tell

    def read(self, size: int = -1) -> bytes:
        """Return so many bytes, or fewer at the end.

        Raises:
            tarfile.ReadError: A header takes more than it may.
        """
        if self.allowed is None:
            return self._file.read(size)
        self.allowed -= size
        self._additions -= size if size > BLOCK else 0
        if size < 0 or self.allowed < 0 or self._additions < 0:
            raise tarfile.ReadError("headers of more bytes than any have")
        content = self._file.read(size)
        if content.count(b"\n") > MOST_FIELDS or _DIGITS.search(content):
            raise tarfile.ReadError("a header of more fields or digits than any has")
        return content


@contextmanager
def tar_entries(
    path: Path, stored: int, name: str
) -> Iterator[tuple[tarfile.TarFile, list[tarfile.TarInfo], list[str]]]:
    """Give an open tar, the files in it, the last one of each name, and sentences on what is left out.

    Args:
        path: A tar that is not packed.
        stored: Bytes of the input.
        name: The input, for messages.

    Raises:
        DamagedVolumeError: It cannot be read to its end, or has more entries or longer headers than any.
    """
    with path.open("rb") as file:
        guarded = _Guarded(file, FREE_BYTES + stored)
        most = min(MAX_ENTRIES, FREE_ENTRIES + stored // BYTES_AN_ENTRY)
        # besides its own errors tarfile raises what a damaged header runs it into
        with library_errors(f"{name}: the tar cannot be read"):
            archive = tarfile.open(fileobj=guarded, mode="r:")  # type: ignore[call-overload]  # noqa: SIM115
            entries = _entries(archive, guarded, most)
            is_ended = _is_ended(file, archive.offset)
        if not is_ended:
            raise DamagedVolumeError(
                f"{name}: the tar ends, or is damaged, behind {len(entries)} entries; expected zeros as "
                "the mark of its end; get the file again"
            )
        guarded.allowed = None
        yield archive, *_files(entries)


def _entries(archive: tarfile.TarFile, guarded: _Guarded, most: int) -> list[tarfile.TarInfo]:
    """Return all entries, `most` at most, in their order."""
    entries: list[tarfile.TarInfo] = []
    guarded.allowed = LONGEST_HEADER
    while (entry := archive.next()) is not None:
        entries.append(entry)
        if len(entries) > most or len(archive.pax_headers) > MOST_FIELDS:
            raise tarfile.ReadError("more entries, or fields for all of them, than any has")
        guarded.allowed = LONGEST_HEADER
    return entries


def _is_ended(file: BinaryIO, position: int) -> bool:
    """Return whether a block of zeros is where the entries end: tarfile stops at anything."""
    file.seek(position)
    return file.read(BLOCK) == bytes(BLOCK)


def _files(entries: list[tarfile.TarInfo]) -> tuple[list[tarfile.TarInfo], list[str]]:
    """Return the files that can be unpacked, and sentences on the others that are no folders."""
    leading = [entry.name for entry in entries if leads_out(entry.name)]
    inside = [entry for entry in entries if not entry.isdir() and not leads_out(entry.name)]
    links = [entry.name for entry in inside if not entry.isreg()]
    files = {entry.name: entry for entry in inside if entry.isreg() and entry.size}
    out = "whose name leads out of the tar"
    told = "that is a link, a pipe or a device", "that are links, pipes or devices"
    return list(files.values()), [
        *left_out(leading, f"tar entry {out}", f"tar entries {out}"),
        *left_out(links, f"tar entry {told[0]}", f"tar entries {told[1]}"),
    ]
