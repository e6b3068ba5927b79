"""Every unit of length in every spelling; what is none is told, and a time is never a length."""

import pytest

from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.volume_io.units import is_time, length_of, scales_in_mm

NGFF = {
    "angstrom": 1e-7, "attometer": 1e-15, "centimeter": 10, "decimeter": 100, "exameter": 1e21,
    "femtometer": 1e-12, "foot": 304.8, "gigameter": 1e12, "hectometer": 1e5, "inch": 25.4, "kilometer": 1e6,
    "megameter": 1e9, "meter": 1e3, "micrometer": 1e-3, "mile": 1609344, "millimeter": 1, "nanometer": 1e-6,
    "parsec": 3.0856775814913674e19, "petameter": 1e18, "picometer": 1e-9, "terameter": 1e15, "yard": 914.4,
    "yoctometer": 1e-21, "yottameter": 1e27, "zeptometer": 1e-18, "zettameter": 1e24,
}  # fmt: skip
"""The list of OME-Zarr 0.4, lengths in millimetres written down from the definitions."""

OME_XML = {
    "Ym": 1e27, "Zm": 1e24, "Em": 1e21, "Pm": 1e18, "Tm": 1e15, "Gm": 1e12, "Mm": 1e9, "km": 1e6, "hm": 1e5,
    "dam": 1e4, "m": 1e3, "dm": 100, "cm": 10, "mm": 1, "µm": 1e-3, "nm": 1e-6, "pm": 1e-9, "fm": 1e-12,
    "am": 1e-15, "zm": 1e-18, "ym": 1e-21, "Å": 1e-7, "thou": 0.0254, "li": 25.4 / 12, "in": 25.4,
    "ft": 304.8, "yd": 914.4, "mi": 1609344, "ua": 149597870700e3, "ly": 9.4607304725808e18,
    "pc": 3.0856775814913674e19, "pt": 25.4 / 72,
}  # fmt: skip
"""The lengths of the enumeration UnitsLength of OME's schema 2016-06."""

UDUNITS = {
    "fermi": 1e-12, "light_year": 9.4607304725808e18, "micron": 1e-3, "mil": 0.0254,
    "printers_point": 0.3514598, "chain": 20116.84, "printers_pica": 4.2175176, "pica": 4.2175176,
    "nautical_mile": 1852e3, "nmile": 1852e3,
    "US_survey_foot": 304.80061, "US_survey_yard": 914.40183, "US_statute_mile": 1609347.2, "rod": 5029.21,
    "pole": 5029.21, "perch": 5029.21, "furlong": 201168.4, "fathom": 1828.8037, "international_inches": 25.4,
    "international_feet": 304.8, "international_yard": 914.4, "international_mile": 1609344,
    "big_point": 25.4 / 72, "barleycorn": 25.4 / 3, "arpentlin": 191.835 * 304.8,
}  # fmt: skip
"""The lengths of UDUNITS-2 that are no metre with a prefix, with the digits of its table."""

SPELLINGS = {
    "\u00b5m": 1e-3, "\u03bcm": 1e-3, "um": 1e-3, "UM": 1e-3, "\\u00B5m": 1e-3, '"um"': 1e-3, "micron": 1e-3,
    "Microns": 1e-3, "\u00b5": 1e-3, "micrometre": 1e-3, "Micrometers": 1e-3, "MICROMETER": 1e-3,
    "\u212b": 1e-7, "A\u030a": 1e-7, "Angstroms": 1e-7, "\u00c5ngstr\u00f6m": 1e-7, "A": 1e-7,
    "inches": 25.4, "Inch": 25.4, "in.": 25.4, "feet": 304.8, "ft": 304.8, "points": 25.4 / 72,
    "millimetres": 1, " mm ": 1, "MM": 1, "Cm": 10, "nautical mile": 1852e3,
    "light-years": 9.4607304725808e18,
    "Angstroem": 1e-7, "mm\0": 1, "\u00c2\u00b5m": 1e-3, "\u00e2\u201e\u00ab": 1e-7, "0.1 mm": 0.1,
    "10um": 0.01, "1e-3 m": 1, "microinch": 25.4e-6, "kilofeet": 304800,
    "dekameter": 1e4, "decametre": 1e4, "km": 1e6, "NM": 1e-6, "pm": 1e-9, "nanometers": 1e-6,
}  # fmt: skip

NO_LENGTHS = [
    "pixel",
    "pixels",
    "voxel",
    "reference frame",
    "ell",
    "PM",
    "YM",
    "kg",
    "degree",
    "a",
    "mm2",
    "0 mm",
    "-1 mm",
    "nan mm",
    "1",
    "10",
    "m m",
    "mm/pixel",
    "s",
]


@pytest.mark.parametrize(("unit", "length"), [*NGFF.items(), *OME_XML.items(), *SPELLINGS.items()])
def test_units_of_length(unit, length):
    assert length_of(unit) == pytest.approx(length, rel=1e-14)


@pytest.mark.parametrize("unit", UDUNITS)
def test_lengths_of_udunits(unit):
    assert length_of(unit) == pytest.approx(UDUNITS[unit], rel=1e-6)


@pytest.mark.parametrize("unit", NO_LENGTHS)
def test_what_is_no_unit_of_length(unit):
    assert length_of(unit) is None


@pytest.mark.parametrize(
    "unit", ["s", "ms", "Seconds", "second", "sec", "min", "minutes", "µs", "hour", "Hz", "day", "0.1 s"]
)
def test_a_time_is_no_length(unit):
    assert is_time(unit)
    assert length_of(unit) is None
    with pytest.raises(UnsupportedFormatError, match=r"a.tif: the axis z .* a time is no length"):
        scales_in_mm(("mm", "mm", unit), "a.tif")


@pytest.mark.parametrize(
    ("units", "scales", "told"),
    [
        (("mm", "um", "cm"), (1, 1e-3, 10), []),
        ((None, None, None), (1, 1, 1), ["W-UNIT-MISSING"]),
        (("", "???", "?"), (1, 1, 1), ["W-UNIT-MISSING"]),
        (("um", "um", None), (1e-3, 1e-3, 1), ["W-UNIT-MISSING"]),
        (("pixel", "pixel", "pixel"), (1, 1, 1), ["W-UNIT-UNKNOWN"]),
        (("um", "ell", None), (1e-3, 1, 1), ["W-UNIT-UNKNOWN", "W-UNIT-MISSING"]),
    ],
)
def test_units_that_are_unknown_or_missing_are_told(units, scales, told):
    found, notices = scales_in_mm(units, "a.nrrd")
    assert found == pytest.approx(scales)
    assert [notice.code for notice in notices] == told
    assert all("--spacing" in notice.sentence for notice in notices)
