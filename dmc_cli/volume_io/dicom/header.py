"""Find a DICOM file's header: without pydicom where it is plain, by pydicom where it is not."""

import io
import warnings
from typing import Any, BinaryIO

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.dicom.deflated import DEFLATED, DeflatedFile, inflated_file
from dmc_cli.volume_io.dicom.effort import PiecewiseStream, TooMuchError
from dmc_cli.volume_io.dicom.elements import (
    EXPLICIT,
    IMPLICIT,
    Header,
    text,
)
from dmc_cli.volume_io.dicom.flat import FlatScanner
from dmc_cli.volume_io.dicom.source import HEAD_BYTES, DicomFile
from dmc_cli.volume_io.dicom.wanted import COMPLEX, OFFSETS, WANTED

_ASKED: list[Any] = sorted(COMPLEX | OFFSETS | WANTED)


def read_header(file: DicomFile) -> Header | None:
    """Return the header of a DICOM file, or None for a file of another kind.

    Raises:
        DamagedVolumeError: It is DICOM, but its header cannot be read.
    """
    failure: Exception | None = None
    for head in file.heads():
        with head:
            try:
                start = head.read(132)
            except OSError as error:
                raise DamagedVolumeError(
                    f"{file.name}: cannot be read ({error.strerror or error}); get the file again"
                ) from error
            has_preamble = start[128:132] == b"DICM"
            if not has_preamble and not isinstance(file, DeflatedFile) and not _is_plausible(start):
                return None
            try:
                found = _flat_header(file, head) if has_preamble else None
                if isinstance(found, DeflatedFile):
                    return read_header(found)
                if found is not None:
                    return found
                head.seek(0)
                return _parsed(file, PiecewiseStream(head, file.effort), force=not has_preamble)
            except TooMuchError as error:
                failure = error
                break
            except Exception as error:
                # pydicom raises whatever its parsing runs into: struct.error, KeyError, EOFError, ...
                failure = error
    if not has_preamble and not isinstance(file, DeflatedFile):
        return None
    raise DamagedVolumeError(
        f"{file.name}: the DICOM header cannot be read ({failure}); get the file again"
    ) from failure


def _is_plausible(start: bytes) -> bool:
    """Return whether a file without preamble begins with an element of the first groups."""
    if len(start) < 12 or start[:2] not in (b"\x02\x00", b"\x08\x00", b"\x00\x08"):
        return False
    has_type = start[4:6].isalpha() and start[4:6].isupper()
    return has_type or int.from_bytes(start[4:8], "little") < 128


def _flat_header(file: DicomFile, head: BinaryIO) -> Header | DeflatedFile | None:
    """Return the header of a plain image, or of a deflated file what it has to be read as; else None."""
    scanner = FlatScanner(head, 132)
    if scanner.begins_with(b"\0\0"):
        raise TooMuchError("it begins with commands, of which zeros would be millions")
    meta, position = scanner.scan(explicit=True)
    syntax = text(meta, 0x00020010)
    if syntax == DEFLATED and position > 0:
        return inflated_file(file, position)
    if syntax not in (IMPLICIT, EXPLICIT) or position < 0:
        return None
    found, position = scanner.scan(explicit=syntax == EXPLICIT)
    file.effort.take_pieces(scanner.count)
    if not 0 <= position < file.size - 8 or text(found, 0x00280008) not in ("", "1"):
        return None
    return Header(file, found, syntax, position)


def _parsed(file: DicomFile, head: Any, force: bool) -> Header:
    import pydicom

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        dataset = pydicom.dcmread(head, stop_before_pixels=True, force=force, specific_tags=_ASKED)
        meta = getattr(dataset, "file_meta", None)
        found = meta.get("TransferSyntaxUID") if meta is not None else None
    if found is None:
        found = EXPLICIT if dataset.original_encoding[0] is False else IMPLICIT
    position = head.tell()
    if len(head.read(9)) == 9:
        return Header(file, dataset, str(found), position)
    # what is not asked for is passed over, though it end behind what there is
    end = head.seek(0, io.SEEK_END)
    if end < file.size and end in HEAD_BYTES:
        raise EOFError("the header is longer than what was looked at")
    return Header(file, dataset, str(found), None)
