"""Tell a file's format from its first bytes."""

from pathlib import Path

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_formats import format_of_start
from dmc_cli.volume_io.packed import packing_of, unpacked_stream
from dmc_cli.volume_io.zip_archive import ENTRY_MARK

START = 4096
"""Bytes of a file that are looked at, unpacked."""


def format_of_content(path: Path, name: str) -> str | None:
    """Return the format whose first bytes the file has, or None."""
    return format_of_start(first_bytes(path, name, START))


def begins_as_dicom(start: bytes) -> bool:
    """Return whether the first 132 bytes of a file, or more, are those of DICOM, and not of an archive."""
    is_plausible = format_of_start(start[:132]) == "dicom" and not start.startswith(ENTRY_MARK)
    return start[128:132] == b"DICM" or is_plausible


def first_bytes(path: Path, name: str, count: int) -> bytes:
    """Return the first `count` bytes of a file, unpacked where it is packed, or fewer where it ends.

    Raises:
        UnsupportedFormatError: The package that unpacks it is missing.
        DamagedVolumeError: What is packed there is damaged.
    """
    with path.open("rb") as file:
        start = file.read(count)
        packing = packing_of(start)
        if packing is None:
            return start
        file.seek(0)
        try:
            return unpacked_stream(file, packing, name).read(count)
        except DamagedVolumeError as error:
            raise DamagedVolumeError(
                f"{name}: what {packing} packed is damaged at its start ({error.__cause__}); get the file "
                "again"
            ) from error
