"""Find a DICOM file's header: without pydicom where it is plain, by pydicom where it is not."""

import struct
import warnings
from dataclasses import dataclass
from typing import Any

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.dicom.deflated import DEFLATED, DeflatedFile, inflated_file
from dmc_cli.volume_io.dicom.effort import PiecewiseStream, TooMuchError
from dmc_cli.volume_io.dicom.elements import (
    EXPLICIT,
    FLOAT_PIXEL_DATA,
    IMPLICIT,
    Header,
    text,
)
from dmc_cli.volume_io.dicom.labels import DISCRIMINATORS
from dmc_cli.volume_io.dicom.makers import CREATORS, KINDS
from dmc_cli.volume_io.dicom.source import HEAD_BYTES, DicomFile

FLAT_BYTES = 1 << 16
"""How much of a file is looked at before pydicom is asked; most headers have a tenth of it."""

WANTED = frozenset(
    (
        *(0x00020010, 0x00080016, 0x00080060, 0x0008103E, 0x00180050, 0x00180088, 0x00181164, 0x0020000E),
        *(0x00200011, 0x00200013, 0x00200032, 0x00200037, 0x00201041, 0x00280002, 0x00280004, 0x00280008),
        *(0x00280010, 0x00280011, 0x00280030, 0x00280034, 0x00280100, 0x00280101, 0x00280102, 0x00280103),
        0x00280120,
        *(0x00280121, 0x00281052, 0x00281053, 0x00541001, 0x00541102, 0x30040002, 0x3004000E),
        *DISCRIMINATORS.values(),
        *CREATORS,
        *KINDS,
    )
)
"""Every element that a single-frame image is asked for."""

_ENHANCED = frozenset([0x52009229, 0x52009230, 0x00540022, 0x3004000C, 0x00283000, 0x00409096])

_LONG_FORM = frozenset(
    [b"OB", b"OD", b"OF", b"OL", b"OV", b"OW", b"SQ", b"SV", b"UC", b"UN", b"UR", b"UT", b"UV"]
)


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
                start += head.read(FLAT_BYTES)
                if has_preamble and start[132:134] == b"\0\0":
                    raise TooMuchError("it begins with commands, of which zeros would be millions")
                found = _flat_header(file, start) if has_preamble else None
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


@dataclass(frozen=True)
class _FlatElement:
    """An element that was found without pydicom."""

    value: bytes
    VR: str | None
    is_little_endian: bool = True


class _FlatDataset(dict[int, _FlatElement]):
    """The wanted elements of a plain header, looked up as in pydicom's data set."""

    get_item = dict.get


def _flat_header(file: DicomFile, start: bytes) -> Header | DeflatedFile | None:
    """Return the header of a plain image, or of a deflated file what it has to be read as.

    Plain is little endian with one frame and no sequence of unknown length before its pixels. Nearly every
    slice is plain, and this takes a tenth of pydicom's time; anything else is left to pydicom.
    """
    meta, position = _flat_elements(start, 132, explicit=True)
    syntax = text(meta, 0x00020010)
    if syntax == DEFLATED and position > 0:
        return inflated_file(file, position)
    if syntax not in (IMPLICIT, EXPLICIT):
        return None
    found, position = _flat_elements(start, position, explicit=syntax == EXPLICIT)
    if not 0 <= position < file.size - 8 or position > len(start) or text(found, 0x00280008) not in ("", "1"):
        return None
    return Header(file, found, syntax, position)


def _flat_elements(data: bytes, position: int, explicit: bool) -> tuple[_FlatDataset, int]:
    """Return the wanted elements before the end of group 2 or the pixel data, and where that is; else -1."""
    found = _FlatDataset()
    is_meta = data[position : position + 2] == b"\x02\x00"
    while position + 12 <= len(data):
        group, element = struct.unpack_from("<HH", data, position)
        if (is_meta and group != 2) or (group << 16 | element) >= FLOAT_PIXEL_DATA:
            return found, position
        kind = data[position + 4 : position + 6]
        if explicit and kind not in _LONG_FORM:
            begin, length = position + 8, int.from_bytes(data[position + 6 : position + 8], "little")
            if not kind.isalpha():
                break
        else:
            begin = position + (12 if explicit else 8)
            length = int.from_bytes(data[begin - 4 : begin], "little")
        tag = group << 16 | element
        if length == 0xFFFFFFFF or tag in _ENHANCED:
            break
        if tag in WANTED:
            found[tag] = _FlatElement(
                data[begin : begin + length], kind.decode("ascii", "replace") if explicit else None
            )
        position = begin + length
    return found, -1


def _parsed(file: DicomFile, head: Any, force: bool) -> Header:
    import pydicom

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        dataset = pydicom.dcmread(head, stop_before_pixels=True, force=force)
        meta = getattr(dataset, "file_meta", None)
        found = meta.get("TransferSyntaxUID") if meta is not None else None
    if found is None:
        found = EXPLICIT if dataset.original_encoding[0] is False else IMPLICIT
    position = head.tell()
    if len(head.read(9)) == 9:
        return Header(file, dataset, str(found), position)
    if head.tell() < file.size and head.tell() in HEAD_BYTES:
        raise EOFError("the header is longer than what was looked at")
    return Header(file, dataset, str(found), None)
