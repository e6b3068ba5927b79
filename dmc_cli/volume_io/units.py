"""Know the units of length that files name, in every spelling: one table for all formats.

Sources: UDUNITS-2 and the list of OME-Zarr 0.4 (names such as `micrometer`), OME's XML schema of 2016-06
(symbols such as `µm`, `Å`, `pt`), ImageJ (`micron`, `inch`, `A`, `pixel`), NRRD (`???` for unknown) and
MetaImage (`?`). Symbols are read as they are written, for Mm is a million metres; only where no symbol is
spelled so does case not count. Names count in any case, singular or plural, British or American.
"""

import re
import unicodedata
from collections.abc import Sequence
from contextlib import suppress

from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.volume_io.layout import Triple

_PREFIXES = {
    "yotta": ("Y", 24), "zetta": ("Z", 21), "exa": ("E", 18), "peta": ("P", 15), "tera": ("T", 12),
    "giga": ("G", 9), "mega": ("M", 6), "kilo": ("k", 3), "hecto": ("h", 2), "deca": ("da", 1),
    "deka": ("da", 1), "": ("", 0), "deci": ("d", -1), "centi": ("c", -2), "milli": ("m", -3),
    "micro": ("u", -6), "nano": ("n", -9), "pico": ("p", -12), "femto": ("f", -15), "atto": ("a", -18),
    "zepto": ("z", -21), "yocto": ("y", -24),
}  # fmt: skip
"""Symbol and power of ten of each prefix."""

_INCH = 25.4
_SURVEY_FOOT = 1200e3 / 3937
_OTHER_SYMBOLS = {
    "Å": 1e-7, "A": 1e-7, "u": 1e-3, "in": _INCH, "ft": 12 * _INCH, "yd": 36 * _INCH, "mi": 63360 * _INCH,
    "li": _INCH / 12, "pt": _INCH / 72, "ua": 149_597_870_700e3, "au": 149_597_870_700e3,
    "ly": 9_460_730_472_580_800e3, "pc": 3.0856775814913674e19,
}  # fmt: skip
_OTHER_NAMES = {
    "angstrom": 1e-7, "angstroem": 1e-7, "ångström": 1e-7, "ångstrom": 1e-7, "angström": 1e-7,
    "micron": 1e-3, "fermi": 1e-12,
    "inch": _INCH, "inches": _INCH, "foot": 12 * _INCH, "feet": 12 * _INCH, "yard": 36 * _INCH,
    "mile": 63360 * _INCH, "international_inch": _INCH, "international_inches": _INCH,
    "international_foot": 12 * _INCH, "international_feet": 12 * _INCH, "international_yard": 36 * _INCH,
    "international_mile": 63360 * _INCH, "us_survey_foot": _SURVEY_FOOT, "us_survey_feet": _SURVEY_FOOT,
    "us_survey_yard": 3 * _SURVEY_FOOT, "us_survey_mile": 5280 * _SURVEY_FOOT,
    "us_statute_mile": 5280 * _SURVEY_FOOT, "fathom": 6 * _SURVEY_FOOT, "rod": 16.5 * _SURVEY_FOOT,
    "pole": 16.5 * _SURVEY_FOOT, "perch": 16.5 * _SURVEY_FOOT, "chain": 66 * _SURVEY_FOOT,
    "furlong": 660 * _SURVEY_FOOT, "arpentlin": 191.835 * 12 * _INCH, "nautical_mile": 1852e3,
    "nmile": 1852e3, "thou": _INCH / 1000, "mil": _INCH / 1000, "line": _INCH / 12, "barleycorn": _INCH / 3,
    "point": _INCH / 72, "big_point": _INCH / 72, "printers_point": _INCH / 72.27, "pica": _INCH / 6.0225,
    "printers_pica": _INCH / 6.0225,
    "astronomical_unit": 149_597_870_700e3, "light_year": 9_460_730_472_580_800e3,
    "parsec": 3.0856775814913674e19,
}  # fmt: skip
"""Length in millimetres of units that are no metre with a prefix."""

_IN_ANY_CASE = frozenset(("m", "mm", "cm", "um", "nm", "km", "in", "ft", "yd", "pt"))
"""Symbols that are meant where no other one is spelled so: UM is um, but Pm is no pm."""

_MISSING = ("", "?", "???", "unknown", "none", "nan", "-")
"""What files write where they know no unit, in lower case."""

_TIMES = frozenset(
    (
        *("s", "sec", "second", "ms", "msec", "millisecond", "us", "usec", "microsecond", "ns", "nsec"),
        *("nanosecond", "ps", "picosecond", "fs", "femtosecond", "min", "minute", "h", "hr", "hour", "d"),
        *("day", "week", "month", "year", "hz", "hertz"),
    )
)
"""Units of time and frequency, in lower case, which no axis of space has."""

_SYMBOLS = {f"{symbol}m": float(f"1e{power + 3}") for symbol, power in _PREFIXES.values()} | _OTHER_SYMBOLS
_NAMES = {
    f"{prefix}{name}": length if power == 0 else float(f"1e{power}") * length
    for prefix, (_, power) in _PREFIXES.items()
    for name, length in _OTHER_NAMES.items()
}
_NAMES |= {
    f"{prefix}{metre}": float(f"1e{power + 3}")
    for prefix, (_, power) in _PREFIXES.items()
    for metre in ("meter", "metre")
}


def length_of(unit: str) -> float | None:
    """Return the length of a unit in millimetres, None for what is no unit of length."""
    factor, spelled = _plain(unit)
    lower = spelled.casefold()
    name = lower.replace(" ", "_").replace("-", "_")
    found = _SYMBOLS.get(spelled) or _NAMES.get(name) or _NAMES.get(name.removesuffix("s"))
    if found is None and lower in _IN_ANY_CASE:
        found = _SYMBOLS[lower]
    return factor * found if found and factor else None


def is_time(unit: str) -> bool:
    """Return whether a unit is one of time or frequency, or CF's `days since 2000-01-01`."""
    name = _plain(re.sub(r"\s+since\s.*", "", unit, flags=re.DOTALL))[1].casefold()
    return name in _TIMES or name.removesuffix("s") in _TIMES


def is_missing(unit: str) -> bool:
    """Return whether a unit is what files write where they know none."""
    return unit.strip(" \"'").casefold() in _MISSING


def scales_in_mm(
    units: Sequence[str | None], name: str, what: str = "the file"
) -> tuple[Triple, tuple[Notice, ...]]:
    """Return the length in millimetres of the units along x, y, z, and what is told of them.

    A unit that is missing or unknown is taken as a millimetre.

    Args:
        units: As the file spells them, None where it has none.
        name: The input, for messages.
        what: What tells the units, as messages begin.

    Raises:
        UnsupportedFormatError: An axis of space is measured in units of time.
    """
    spelled = [None if unit is None else unit.strip(" \"'") for unit in units]
    told = [None if unit is None or is_missing(unit) else unit for unit in spelled]
    lengths = [None if unit is None else length_of(unit) for unit in told]
    notices = [
        _unknown(unit, axis, name, what)
        for axis, unit, length in zip("xyz", told, lengths, strict=True)
        if unit is not None and length is None
    ]
    missing = [axis for axis, unit in zip("xyz", told, strict=True) if unit is None]
    if missing:
        along = "" if len(missing) == 3 else f" along {' and '.join(missing)}"
        sentence = f"{what} tells no unit of length{along}; taken as millimetres; --spacing tells better"
        notices.append(Notice("W-UNIT-MISSING", sentence))
    x, y, z = (length or 1.0 for length in lengths)
    return (x, y, z), tuple(dict.fromkeys(notices))


def _unknown(unit: str, axis: str, name: str, what: str) -> Notice:
    """Return what is told of a unit that no table has.

    Raises:
        UnsupportedFormatError: It is one of time.
    """
    if is_time(unit):
        raise UnsupportedFormatError(
            f"{name}: the axis {axis} of space found in {unit[:40]!r}, a unit of time; expected one of "
            "length, for a time is no length; correct the metadata, or take a volume of one time"
        )
    sentence = (
        f"{what}'s unit of length {unit[:40]!r} is unknown; taken as millimetres; --spacing tells better"
    )
    return Notice("W-UNIT-UNKNOWN", sentence)


def _plain(unit: str) -> tuple[float, str]:
    """Return how many units are meant, as in UDUNITS' `0.1 mm`, and the unit.

    It is without quotes, blanks and a final point, its escapes resolved, and has u for either µ.
    """
    plain = unit.strip(" \t\r\n\0\"'")
    plain = re.sub(r"\\u([0-9a-fA-F]{4})", lambda match: chr(int(match[1], 16)), plain)  # as ImageJ escapes
    with suppress(UnicodeError):  # UTF-8 that a writer took for Latin letters: Âµ
        plain = plain.encode("cp1252").decode()
    plain = unicodedata.normalize("NFKC", plain).replace("μ", "u").removesuffix(".")
    scaled = re.fullmatch(r"([0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]{1,2})?) ?([^\W\d].*)", plain)
    return (float(scaled[1]), scaled[2]) if scaled else (1.0, plain)
