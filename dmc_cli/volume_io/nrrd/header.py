"""Parse a NRRD header's text: its fields, and the numbers, vectors and lists in them."""

import re
from pathlib import Path
from typing import Any

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.volume_io.content import first_bytes

MAX_HEADER = 1 << 20
"""Longest header that is read; real ones have some hundred bytes."""


def read_header(path: Path, name: str) -> tuple[dict[str, str], int, list[str]]:
    """Return the fields by lower-case name, the header's length, and the lines after `data file: LIST`."""
    start = first_bytes(path, name, MAX_HEADER)
    if not re.match(rb"NRRD00\d\d", start):
        raise UnsupportedFormatError(
            f"{name}: no NRRD file (it does not begin with NRRD000); choose another --input-format"
        )
    fields: dict[str, str] = {}
    trailing: list[str] = []
    position = start.find(b"\n") + 1
    while 0 < position < len(start):
        end = start.find(b"\n", position)
        line = start[position : end if end >= 0 else len(start)].decode("utf-8", "replace").strip("\r\n\t ")
        position = end + 1 if end >= 0 else len(start)
        if not line:
            break
        if "data file" in fields and fields["data file"].split()[:1] == ["LIST"]:
            trailing.append(line)
        elif not line.startswith("#") and not re.match(r"[^:]*:=", line):
            key, separator, value = line.partition(":")
            if not separator:
                raise DamagedVolumeError(f"{name}: header line {line[:60]!r} found; expected `field: value`")
            key = {"datafile": "data file", "byteskip": "byte skip", "lineskip": "line skip"}.get(
                key.strip().lower(), key.strip().lower()
            )
            fields.setdefault(key, value.strip())
    else:
        if position >= MAX_HEADER:
            raise DamagedVolumeError(
                f"{name}: no end of the header in its first {MAX_HEADER} bytes; expected an empty line"
            )
    for key in ("type", "dimension", "sizes", "encoding"):
        if key not in fields:
            raise DamagedVolumeError(
                f"{name}: the header has no field {key!r}; expected type, dimension, sizes, encoding"
            )
    return fields, position, trailing


def numbers(fields: dict[str, str], key: str, name: str, kind: type) -> list[Any]:
    """Return the numbers of a field."""
    try:
        return [kind(token) for token in fields[key].split()]
    except ValueError as error:
        raise DamagedVolumeError(
            f"{name}: {key} {fields[key][:60]!r} found in the header; expected numbers"
        ) from error


def per_axis(text: str) -> list[str]:
    """Return the entries of a field, one an axis: texts, "quoted texts" or (vectors, in, brackets)."""
    return re.findall(r'"[^"]*"|\([^)]*\)|[^\s()"]+', text)


def vector(text: str, name: str) -> list[float]:
    """Return the numbers of a vector (in,brackets)."""
    try:
        return [float(token) for token in text.strip("()").split(",")]
    except ValueError as error:
        raise DamagedVolumeError(
            f"{name}: vector {text[:60]!r} found in the header; expected (number,number,number)"
        ) from error
