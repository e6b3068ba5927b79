"""Unpack the slices of a folder that are packed one by one, such as .dcm.gz, onto the disk."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from dmc_cli.errors import DamagedVolumeError, DmcError
from dmc_cli.volume_formats import format_of_suffix
from dmc_cli.volume_io.content import begins_as_dicom, first_bytes
from dmc_cli.volume_io.dicom.source import DicomFile
from dmc_cli.volume_io.packed import FREE_BYTES, LARGEST_RATIO, SUFFIXES, file_packing, unpacked_stream
from dmc_cli.volume_io.stream import check_disk

PIECE = 1 << 24


@contextmanager
def plain_slices(files: list[DicomFile], name: str) -> Iterator[tuple[list[DicomFile], list[str]]]:
    """Give the files of a folder, those that are packed DICOM unpacked to temporary ones, gone at the end.

    Packed files that may be DICOM or not, for they are damaged at their start, are left out, and told in
    the sentences that come second.

    Raises:
        DamagedVolumeError: One cannot be unpacked, or all unpack to far more than their size.
        UnsupportedFormatError: The package that unpacks them is missing.
        VolumeError: The disk is too small for them.
    """
    packed, unclear = [], {}
    for file in files:
        if file.path.suffix.lower() in SUFFIXES:
            try:
                if _is_dicom(file):
                    packed.append(file)
            except DmcError as error:
                unclear[file] = f"a file was left out: {error}"
    files = [file for file in files if file not in unclear]
    told = list(unclear.values())
    if not packed:
        yield files, told
        return
    left = FREE_BYTES + LARGEST_RATIO * sum(file.size for file in packed)
    with tempfile.TemporaryDirectory() as folder:
        plain = {}
        for number, file in enumerate(packed):
            plain[file] = _unpacked(file, Path(folder, str(number)), left, name)
            left -= plain[file].size
        yield [plain.get(file, file) for file in files], told


def _is_dicom(file: DicomFile) -> bool:
    """Return whether a file is packed DICOM, by its start, or by its name where that cannot be read.

    Raises:
        VolumeError: Neither says what it is.
    """
    try:
        return begins_as_dicom(first_bytes(file.path, file.name, 132))
    except (DmcError, OSError) as error:
        if format_of_suffix(file.path.with_suffix("").name) == "dicom":
            return True
        if isinstance(error, OSError):
            return False  # told by the header's reader
        raise


def _unpacked(file: DicomFile, target: Path, most: int, name: str) -> DicomFile:
    """Return a packed file as one that is unpacked to a path, `most` bytes at most."""
    packing = file_packing(file.path)
    assert packing is not None
    size = 0
    with file.path.open("rb") as source, target.open("wb") as plain:
        stream = unpacked_stream(source, packing, f"{name}: {file.name}")
        while piece := stream.read(PIECE):
            check_disk(target, size, name)
            size += plain.write(piece)
            if size > most:
                raise DamagedVolumeError(
                    f"{name}: {file.name} unpacks to more bytes than packed slices do; expected at most "
                    f"{LARGEST_RATIO} times their number in all; unpack it yourself if that is right"
                )
    return replace(file, plain=target, size=size)
