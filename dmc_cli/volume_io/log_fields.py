"""Read the lines of a scanner's text: keys, numbers and their units, however they are written.

A text is in UTF-8, UTF-16 or Latin-1. A comma is the decimal sign where the text writes numbers with commas
and none with points; what stays open is told as a doubt, and so is a key that stands twice with other
numbers.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from dmc_cli.volume_io.units import length_of

LARGEST_TEXT = 1 << 18
LONGEST_LINE = 200
"""Bytes of a text and characters of a line that are looked at."""

_LINE = re.compile(r"([A-Za-z][^=:\t]*?)\s*(?:=|:|\t|  )\s*(\S.*?)\s*$")
_BLANK_LINE = re.compile(r"([A-Za-z][^=:\t]*?) ([-+.\d].*?)\s*$")
"""A line whose key and number only a blank keeps apart."""
_SECTION = re.compile(r"\[([^\]=:]+)\]$")
_DETECTOR = re.compile(r"detector|camera|panel", re.IGNORECASE)
_AXES = re.compile(r"\s*[\[(]\s*x\s*,\s*y(?:\s*,\s*z)?\s*[\])]", re.IGNORECASE)
_UNIT = re.compile(r"\s*[\[(]\s*([^\])]+?)\s*[\])]|[_ ](um|µm|μm|mm|nm|cm)$")
_PER_NODE = re.compile(r"\s*(?:/|per)\s*(?:px|pixel|voxel|vx)s?$", re.IGNORECASE)
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_COMMA_NUMBER = r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?"
_POINT = re.compile(r"[-+]?\d*\.\d+(?![.\d])")
_CLEAR_COMMA = re.compile(r"[-+]?(0,\d+|\d+,(\d\d?|\d{4,}))(?![,\d])")
"""A number with a point, and one whose comma is no sign of thousands."""
_UNIT_BEHIND = r"\s*[\[(]?\s*([^\d\s\])]*)"
_NUMBERS = re.compile(rf"({_NUMBER}(?:(?:\s*[,;x×]\s*|\s+){_NUMBER}){{0,2}}){_UNIT_BEHIND}")
_COMMA_NUMBERS = re.compile(
    rf"({_COMMA_NUMBER}(?:(?:\s*[;x×]\s*|\s+){_COMMA_NUMBER}){{0,2}})(?!,){_UNIT_BEHIND}"
)


@dataclass(frozen=True)
class LogField:
    """What stands behind a key.

    Attributes:
        numbers: One to three.
        unit: Theirs, as the text spells it, or nothing.
        told: The numbers as the text has them.
        doubt: Why they cannot be used, or nothing.
    """

    numbers: tuple[float, ...]
    unit: str
    told: str
    doubt: str = ""


@dataclass
class LogFields:
    """The lines of a text by key, spelled alike: those with numbers, and what stands behind every key."""

    values: dict[str, LogField] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)

    def first(self, keys: tuple[str, ...]) -> str | None:
        """Return the first of the keys that there is."""
        return next((key for key in keys if key in self.values), None)

    def numbers(self, key: str) -> tuple[float, ...]:
        """Return the numbers of a key, none where there is no such key."""
        return self.values[key].numbers if key in self.values else ()

    def whole(self, keys: tuple[str, ...]) -> int | None:
        """Return the whole number of the first of the keys that there is."""
        numbers = self.numbers(self.first(keys) or "")
        return int(numbers[0]) if numbers and abs(numbers[0]) < 1 << 31 else None


def log_fields(text: Path) -> LogFields:
    """Return the lines of a text that have a key and a value."""
    with text.open("rb") as file:
        lines = _decoded(file.read(LARGEST_TEXT)).splitlines()
    pairs = list(_pairs(lines))
    has_points = any(_POINT.match(value) for _, value in pairs)
    has_points &= not any(_CLEAR_COMMA.match(value) for _, value in pairs)
    fields = LogFields()
    for key, value in pairs:
        name, unit = _name_and_unit(key)
        fields.texts.setdefault(name, value)
        found = _field(value, unit, has_points)
        if found is not None:
            known = fields.values.setdefault(name, found)
            if _in_mm(known) != _in_mm(found) and not known.doubt:
                fields.values[name] = replace(known, doubt=f"it is {found.told} elsewhere in the text")
    return fields


def _pairs(lines: list[str]) -> Iterator[tuple[str, str]]:
    """Yield the key and the value of each line; a key in a section of the detector begins with its name."""
    section = ""
    for line in lines:
        plain = line.strip(" \t#;!")[:LONGEST_LINE]
        named = _SECTION.match(plain)
        if named is not None:
            section = f"{named[1]} " if _DETECTOR.search(named[1]) else ""
        matched = _LINE.match(plain) or _BLANK_LINE.match(plain)
        if matched is not None:
            yield section + matched[1], matched[2]


def _name_and_unit(key: str) -> tuple[str, str]:
    """Return a key as it is looked up, and the unit that stands in it."""
    plain = _AXES.sub("", key)
    unit = _UNIT.search(plain)
    return (_spelled(plain), "") if unit is None else (_spelled(plain[: unit.start()]), unit[1] or unit[2])


def _field(value: str, unit: str, has_points: bool) -> LogField | None:
    """Return the numbers that a value begins with, or None."""
    commas, points = _COMMA_NUMBERS.match(value), _NUMBERS.match(value)
    matched = commas or points
    if matched is None:
        return None
    text = matched[1]
    found = re.findall(_COMMA_NUMBER if commas else _NUMBER, text)
    numbers = tuple(float(number.replace(",", ".")) for number in found)
    behind = _PER_NODE.sub("", matched[2])
    doubt = ""
    if commas and has_points:
        doubt = "its comma may be a decimal sign or not, for other numbers have a point"
    given = _PER_NODE.sub("", unit)
    lengths = length_of(given), length_of(behind)
    if None not in lengths and lengths[0] != lengths[1]:
        doubt = f"the units {given} and {behind} differ"
    return LogField(numbers, given or behind, text, doubt)


def _in_mm(found: LogField) -> tuple[float, ...]:
    scale = length_of(found.unit) or 1.0
    return tuple(float(f"{number * scale:.9g}") for number in found.numbers)


def _decoded(content: bytes) -> str:
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    if content[1:64:2].count(0) > len(content[1:64:2]) // 2:
        return content.decode("utf-16-le", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _spelled(key: str) -> str:
    """Return a key in small letters, its words apart: `VoxelSizeX` is `voxel size x`."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", key)
    spelled = " ".join(re.split(r"[\s_.-]+", apart)).strip().lower()
    return re.sub(r"^(pixel|voxel)size\b", r"\1 size", spelled)
