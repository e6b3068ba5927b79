"""Keep an input's files in its folder: nothing that a link or a header names elsewhere is read unasked.

What is no regular file (a pipe, a device) is never opened, wherever it lies.
"""

import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from dmc_cli.errors import VolumeError

REMEDY = "copy it there, or read it with --allow-outside"


class Bounds:
    """Where an input's files may lie: below some folders, or anywhere with `allow_outside`."""

    def __init__(self, *folders: Path | str, allow_outside: bool = False) -> None:
        self._allow_outside = allow_outside
        self._roots = [os.path.realpath(folder).rstrip(os.sep) + os.sep for folder in folders]

    def hold(self, path: Path | str) -> bool:
        """Return whether a path, all links followed, is one of the folders or below it."""
        if self._allow_outside:
            return True
        real = os.path.realpath(path) + os.sep
        return any(real.startswith(root) for root in self._roots)


def check_beside(header: Path, found: Path, named: str, name: str, allow_outside: bool) -> None:
    """Refuse a data file outside its header's folder: the one that was named, or the header's real one.

    Args:
        header: The header's file.
        found: The data file.
        named: What the header calls it, for the message.
        name: The input, for the message.
        allow_outside: Whether any place will do.

    Raises:
        VolumeError: It lies elsewhere.
    """
    folders = header.parent, Path(os.path.realpath(header)).parent
    if not Bounds(*folders, allow_outside=allow_outside).hold(found):
        raise VolumeError(
            f"{name}: its data file {named[:200]!r} lies outside the header's folder; expected it beside the "
            f"header; {REMEDY}"
        )


@dataclass
class Walk:
    """The regular files below a folder; links are followed as far as the bounds, no folder is entered twice.

    Attributes:
        folder: Where to begin.
        bounds: Where files may lie.
        skipped: What was not looked at, filled while walking: name below the folder, and why.
    """

    folder: Path
    bounds: Bounds
    skipped: list[tuple[str, str]] = field(default_factory=list)

    def files(self) -> Iterator[tuple[str, os.stat_result]]:
        """Yield each file's name below the folder and its status, folder by folder, in the order of names."""
        seen: set[tuple[int, int]] = set()
        pending = [""]
        while pending:
            folder = pending.pop()
            try:
                status = os.stat(self.folder / folder)  # noqa: PTH116 -- no Path for each of thousands
                if (status.st_dev, status.st_ino) in seen:
                    continue
                seen.add((status.st_dev, status.st_ino))
                with os.scandir(self.folder / folder) as listing:
                    entries = sorted(listing, key=lambda entry: entry.name)
            except OSError as error:
                self.skipped.append((folder or ".", f"cannot be read ({error.strerror})"))
                continue
            inner = []
            for entry in entries:
                name = f"{folder}/{entry.name}" if folder else entry.name
                found = self._status(entry, name)
                if found is not None and stat.S_ISDIR(found.st_mode):
                    inner.append(name)
                elif found is not None:
                    yield name, found
            pending += reversed(inner)

    def _status(self, entry: "os.DirEntry[str]", name: str) -> os.stat_result | None:
        """Return the status of a file or folder, or None where it is to be skipped."""
        try:
            status = entry.stat()
        except OSError as error:
            self.skipped.append((name, f"cannot be read ({error.strerror})"))
            return None
        if entry.is_symlink() and not self.bounds.hold(entry.path):
            self.skipped.append((name, "a link out of the folder, which only --allow-outside follows"))
            return None
        if not stat.S_ISDIR(status.st_mode) and not stat.S_ISREG(status.st_mode):
            self.skipped.append((name, "a pipe, a device or a socket"))
            return None
        return status
