"""Look at the entries of a zip: which can be what they claim, and their first bytes.

A zip is read entry by entry and never unpacked. An entry that claims to be larger than its packed bytes can
hold, or whose name leads out of the zip, is not touched; a zip whose entries share bytes is refused.
"""

import os
import struct
import zipfile
import zlib
from itertools import pairwise
from pathlib import Path
from typing import Any

from dmc_cli.errors import DamagedVolumeError, VolumeError
from dmc_cli.volume_io.decoding import DEFLATE_RATIO, new_inflater
from dmc_cli.volume_io.left_out import left_out

MAX_ENTRY = 1 << 32
"""Largest zip entry that is read."""

MAX_ENTRIES = 1 << 18
"""More entries than any zip has slices."""

ENTRY_MARK = b"PK\x03\x04"
"""How a zip's entry begins."""

ENTRY_HEAD = 30
"""Bytes of a zip entry's own header before its name."""

_LZMA_HEAD = 9
"""Bytes of an LZMA entry before its stream: version, size of the properties, properties."""

_MOST_DICTIONARY = 1 << 28


def zip_entries(archive: zipfile.ZipFile, name: str) -> tuple[list[zipfile.ZipInfo], list[str]]:
    """Return the entries that can be what they claim, each name once, and sentences on those that cannot.

    Raises:
        VolumeError: The zip is encrypted.
        DamagedVolumeError: Entries share bytes, are too many, or none can be what it claims.
    """
    entries = archive.infolist()
    _check_apart(entries, name)
    full = [entry for entry in entries if entry.filename and not entry.is_dir() and entry.file_size > 0]
    leading = [entry.filename for entry in full if leads_out(entry.filename)]
    inside = [entry for entry in full if not leads_out(entry.filename)]
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
    return list({entry.filename: entry for entry in honest}.values()), notes


def _check_apart(entries: list[zipfile.ZipInfo], name: str) -> None:
    """Refuse entries that share bytes, a trick to unpack the same ones again and again."""
    if len(entries) > MAX_ENTRIES:
        raise DamagedVolumeError(
            f"{name}: {len(entries)} zip entries found; expected {MAX_ENTRIES} at most; unpack it and give "
            "the folder of the series"
        )
    placed = sorted((entry.header_offset, entry.compress_size, entry.filename) for entry in entries)
    for (begin, size, first), (following, _, second) in pairwise(placed):
        if begin + ENTRY_HEAD + size > following:
            raise DamagedVolumeError(
                f"{name}: the zip entries {first} and {second} share bytes; expected one after the other; "
                "get the file again"
            )


def _can_hold(entry: zipfile.ZipInfo) -> bool:
    """Return whether a zip's entry can be as large as it claims."""
    return entry.file_size <= min(MAX_ENTRY, DEFLATE_RATIO * entry.compress_size)


def leads_out(entry_name: str) -> bool:
    """Return whether the name of an archive's entry is absolute or climbs: a trick on whoever unpacks it."""
    parts = entry_name.replace("\\", "/").split("/")
    return parts[0] == "" or ".." in parts or parts[0][1:2] == ":"


def unpacked_start(path: Path, entry: zipfile.ZipInfo, count: int) -> bytes:
    """Return the first bytes of a zip's entry, at most `count`, its checksum compared where they are all.

    Raises:
        zipfile.BadZipFile: It is not where the zip says, or damaged.
        Exception: What the packers raise has no common base.
    """
    with path.open("rb") as file:
        file.seek(entry.header_offset)
        head = file.read(ENTRY_HEAD)
        if len(head) < ENTRY_HEAD or head[:4] != ENTRY_MARK:
            raise zipfile.BadZipFile("no entry where the zip's directory says")
        file.seek(sum(struct.unpack_from("<HH", head, 26)), os.SEEK_CUR)
        packed = file.read(entry.compress_size)
    if entry.compress_type == zipfile.ZIP_STORED:
        content = packed[:count]
    else:
        unpacker, stream = _unpacker(entry.compress_type, packed)
        content = unpacker.decompress(stream, count)
    if count >= entry.file_size and zlib.crc32(content) != entry.CRC:
        raise zipfile.BadZipFile("wrong checksum")
    return content


def _unpacker(kind: int, packed: bytes) -> tuple[Any, bytes]:
    """Return what unpacks a stream of a zip's kind, and the stream without what stands before it."""
    if kind == zipfile.ZIP_DEFLATED:
        return new_inflater(-15), packed
    if kind == zipfile.ZIP_BZIP2:
        import bz2

        return bz2.BZ2Decompressor(), packed
    if kind == zipfile.ZIP_LZMA:
        import lzma

        rest, lc = divmod(packed[4], 9)
        pb, lp = divmod(rest, 5)
        size = int.from_bytes(packed[5:_LZMA_HEAD], "little")
        if size > _MOST_DICTIONARY:
            raise zipfile.BadZipFile(f"a dictionary of {size} bytes")
        options = {"id": lzma.FILTER_LZMA1, "lc": lc, "lp": lp, "pb": pb, "dict_size": size}
        return lzma.LZMADecompressor(lzma.FORMAT_RAW, filters=[options]), packed[_LZMA_HEAD:]
    raise NotImplementedError(f"packed by method {kind}; expected deflate, bzip2 or LZMA")
