"""Hold the distances of nodes that an image's own file tells, axis by axis, until it is known what counts.

A resolution (dots per inch or per centimetre) is a distance of nodes only where it is no screen's and no
printer's, which are multiples of 72, 75, 90, 96 or 100 dpi below 10,000, and not 1, which stands for none.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.layout import Triple, check_lengths, chosen_spacing
from dmc_cli.volume_io.lengths import Doubts, missing_spacing
from dmc_cli.volume_io.units import length_of, scales_in_mm

_INCH = 25.4
_PRINTED = (72, 75, 90, 96, 100)
_FINEST_PRINT = 10_000
_ROUNDED = 0.03
"""Dots per inch that a resolution in whole dots per metre is beside the one that is meant, at most."""

SAME_LENGTH = 1e-3
"""Of two statements that are the same, the relative difference at most."""

Lengths = tuple[float | None, float | None, float | None]


@dataclass(frozen=True)
class ToldLengths:
    """Distances of the nodes as a file tells them.

    Attributes:
        lengths: Along x, y, z, each in its unit; None for one that is not told.
        units: As the file spells them, None where it has none.
        what: What tells them, as messages begin.
        is_resolution: Whether they are a resolution, which a text of the scanner corrects.
        doubts: What else is told of them, where nobody knows better.
    """

    lengths: Lengths
    units: tuple[str | None, str | None, str | None] = ("mm", "mm", "mm")
    what: str = "the file"
    is_resolution: bool = False
    doubts: Doubts = ()

    @property
    def are_known(self) -> bool:
        """Return whether one of them is told at least."""
        return any(length is not None for length in self.lengths)

    def in_mm(self, name: str) -> tuple[Triple, Doubts]:
        """Return them in millimetres, 1 of its unit for one that is missing, and what is told of that.

        Raises:
            UnsupportedFormatError: An axis of space is measured in units of time.
        """
        scales, doubts = scales_in_mm(self.units, name, self.what)
        missing = {axis: scales[n] for n, axis in enumerate("xyz") if self.lengths[n] is None}
        x, y, z = (
            scale * (1.0 if length is None else length)
            for length, scale in zip(self.lengths, scales, strict=True)
        )
        return (x, y, z), (*missing_spacing(missing, self.what), *doubts, *self.doubts)

    def known_in_mm(self, name: str) -> Lengths:
        """Return them in millimetres, None where they or their unit are not told.

        Raises:
            UnsupportedFormatError: An axis of space is measured in units of time.
        """
        found, _ = self.in_mm(name)
        x, y, z = (
            None if length is None or length_of(unit or "") is None else known
            for length, unit, known in zip(self.lengths, self.units, found, strict=True)
        )
        return x, y, z


def differ(one: Sequence[float | None], other: Sequence[float | None], tolerance: float) -> bool:
    """Return whether two statements about the same lengths differ along an axis that both tell."""
    return any(
        a is not None and b is not None and not abs(a - b) <= tolerance * abs(b)
        for a, b in zip(one, other, strict=True)
    )


def settled_spacing(
    told: ToldLengths | None, name: str, settings: ReadSettings, what: str
) -> tuple[Triple, Doubts]:
    """Return the spacing in millimetres, that of the settings where the file's is in doubt, and warnings.

    Args:
        told: What the file tells, if anything.
        name: The input, for messages.
        settings: Their spacing.
        what: What tells nothing otherwise, as messages begin.

    Raises:
        DamagedVolumeError: Lengths that are none.
        UnsupportedFormatError: An axis of space is measured in units of time.
    """
    if told is None or not told.are_known:
        return chosen_spacing(None, settings, what if told is None else told.what)
    found, doubts = told.in_mm(name)
    check_lengths(name, found)
    spacing, warnings = chosen_spacing(found, settings, told.what, doubts)
    if doubts and settings.spacing is not None:
        spacing = settings.spacing
    return spacing, warnings


def resolution_lengths(x: float, y: float, unit: float, what: str) -> ToldLengths | None:
    """Return the lengths that a resolution means, without any where it is one of print; None for none.

    Args:
        x: Dots a unit along x.
        y: Along y.
        unit: In millimetres.
        what: The file, as messages begin.
    """
    if not all(math.isfinite(n) and n > 0 and n != 1 for n in (x, y)):
        return None
    dots = [n / unit * _INCH for n in (x, y)]
    told = ToldLengths((None, None, None), is_resolution=True)
    if all(map(is_of_print, dots)):
        found = f"{what}, whose resolution of {dots[0]:.0f} dpi is that of a screen or printer,"
        return replace(told, what=found)
    found = f"{what}, whose resolution is that of pixels of {unit / x:g} x {unit / y:g} mm,"
    return replace(told, lengths=(unit / x, unit / y, None), what=found)


def is_of_print(dots: float) -> bool:
    """Return whether a resolution in dots per inch is one that screens or printers have."""
    is_whole = any(abs(dots - n * max(round(dots / n), 1)) <= _ROUNDED for n in _PRINTED)
    return is_whole and dots < _FINEST_PRINT
