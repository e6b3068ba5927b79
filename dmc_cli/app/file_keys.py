"""Tell files apart whatever their paths: links, dots and letters' case hide none.

A file is known by its number on its disk, and where it does not exist yet by its name in its folder. The
temporary file that an output grows in counts as the output.
"""

import os
import stat
import sys
import unicodedata
from contextlib import suppress
from pathlib import Path
from typing import Any

from dmc_cli.files import part_of
from dmc_cli.settings import STREAM
from dmc_cli.volume_io import PREFIX, is_zarr

_FOLDS_CASE = sys.platform in ("darwin", "win32")
"""Whether `A` and `a` are one name in a folder that does not tell by what is in it."""


class FileKeys:
    """What a file is known by; folders are looked at once.

    Attributes:
        has_outputs: Whether one of the outputs asked for so far exists.
    """

    def __init__(self) -> None:
        self.has_outputs = False
        self._folders: dict[str, tuple[object, bool]] = {}
        self._existing: set[object] = set()

    def of_output(self, path: str) -> set[object]:
        """Return the keys of an output and of the file that it grows in; none of a device."""
        if path == STREAM:
            keys, size = _stream(sys.stdout)
            # `> FILE` leaves it empty, with nothing to lose: the inputs' further files need no look
            return self._remember(keys) if size else keys
        status = _status(path)
        if status is not None and stat.S_ISCHR(status.st_mode):
            return set()
        if status is not None and stat.S_ISDIR(status.st_mode):
            # nothing grows beside it: it is refused later
            return self._remember({_inode(status)})
        real = os.path.realpath(path) if os.path.islink(path) else path  # noqa: PTH114
        part = os.fspath(part_of(Path(real)))
        existing = {_inode(found) for found in (status, _status(part)) if found is not None}
        return self._remember(existing) | {self._name(real), self._name(part)}

    def of_input(self, path: str) -> set[object]:
        """Return the keys of an input or of one of its files."""
        if path == STREAM:
            return _stream(sys.stdin)[0]
        if path.startswith(PREFIX):
            return set()
        status = _status(path)
        return {self._name(path)} if status is None else {_inode(status)}

    def of_store(self, path: str) -> set[object]:
        """Return the key of an input that is a Zarr store, whose every file is the store's, there or not."""
        status = _status(path)
        is_store = status is not None and stat.S_ISDIR(status.st_mode) and is_zarr(Path(path))
        return self.of_input(path) if is_store else set()

    def of_folders_above(self, path: str) -> set[object]:
        """Return the keys of all folders that an output lies in."""
        if path == STREAM:
            return set()
        return {self._folder(os.fspath(folder))[0] for folder in Path(os.path.realpath(path)).parents}

    def is_output(self, status: os.stat_result) -> bool:
        """Return whether a file that exists is one of the outputs asked for so far."""
        return _inode(status) in self._existing

    def _remember(self, existing: set[object]) -> set[object]:
        """Return the keys of files that exist, kept as outputs that inputs may consist of."""
        self.has_outputs = self.has_outputs or bool(existing)
        self._existing |= existing
        return existing

    def _name(self, path: str) -> object:
        """Return the key of a path that need not exist: its folder and its name there."""
        folder, name = os.path.split(path)
        key, folds_case = self._folder(folder or os.curdir)
        return key, unicodedata.normalize("NFC", name).casefold() if folds_case else name

    def _folder(self, folder: str) -> tuple[object, bool]:
        """Return the key of a folder, and whether names in it differ by more than their case."""
        if folder not in self._folders:
            status = _status(folder)
            key = os.path.realpath(folder) if status is None else _inode(status)
            self._folders[folder] = key, folds_case(folder)
        return self._folders[folder]


def folds_case(folder: str) -> bool:
    """Return whether `A` and `a` are one file in a folder, judged by the first of its files with a letter."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            swapped = entry.name.swapcase()
            if swapped != entry.name:
                other = _status(os.path.join(folder, swapped))  # noqa: PTH118
                return other is not None and _inode(other) == _inode(entry.stat())
    return _FOLDS_CASE


def _status(path: str) -> os.stat_result | None:
    try:
        return os.stat(path)  # noqa: PTH116 -- no Path for each of thousands
    except OSError:
        return None


def _inode(status: os.stat_result) -> object:
    return status.st_dev, status.st_ino


def _stream(stream: Any) -> tuple[set[object], int]:
    """Return the key and the bytes of a standard stream that the shell has opened as a file."""
    try:
        status = os.fstat(stream.fileno())
    except (OSError, AttributeError, ValueError):  # none, or no file
        return set(), 0
    return ({_inode(status)}, status.st_size) if stat.S_ISREG(status.st_mode) else (set(), 0)
