"""Read which box of a volume's nodes is kept: `10:200,:,25%:75%`, `-40:40,-60:60,0:120mm`."""

import math
from dataclasses import dataclass
from typing import Literal

from dmc_cli.errors import SettingsError

AXES = "xyz"

Unit = Literal["nodes", "mm", "percent"]


@dataclass(frozen=True)
class Span:
    """Where a box begins and ends along an axis; None where the volume does."""

    unit: Unit
    first: float | None = None
    last: float | None = None


def parse_crop(text: str) -> tuple[Span, Span, Span]:
    """Return the spans along x, y and z that a text tells.

    A unit behind a number counts for its span, `mm` behind the whole text for all spans.

    Raises:
        SettingsError: It is no box.
    """
    word = text.strip().lower().replace(" ", "")
    parts = word.split(",")
    if len(parts) != len(AXES):
        raise _no_crop(text, f"{len(parts)} span(s)")
    everywhere = "mm" if word.endswith("mm") and word.count("mm") == 1 else ""
    x, y, z = (_span(part, text, everywhere) for part in parts)
    return x, y, z


def _span(part: str, text: str, everywhere: str) -> Span:
    """Return one span."""
    ends = part.split(":")
    if len(ends) != 2:
        raise _no_crop(text, repr(part))
    unit: Unit = "mm" if "mm" in part or everywhere else "percent" if "%" in part else "nodes"
    suffix = {"mm": "mm", "percent": "%", "nodes": ""}[unit]
    first, last = (_end(end.removesuffix(suffix), text) for end in ends)
    if first is not None and last is not None and first > last:
        raise _no_crop(text, f"{part!r}, whose end lies before its beginning,")
    numbers = [end for end in (first, last) if end is not None]
    if unit == "nodes" and any(end != int(end) or end < 0 for end in numbers):
        raise _no_crop(text, f"{part!r}, which are no numbers of nodes,")
    if unit == "percent" and any(not 0 <= end <= 100 for end in numbers):
        raise _no_crop(text, f"{part!r}, which is no share,")
    return Span(unit, first, last)


def _end(end: str, text: str) -> float | None:
    """Return the number of an end, None where there is none."""
    if not end:
        return None
    try:
        number = float(end)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise _no_crop(text, repr(end))
    return number


def _no_crop(text: str, found: str) -> SettingsError:
    return SettingsError(
        f"crop is {text!r:.80}: {found} found; expected first:last for x, y and z with commas between, in"
        " nodes, mm or %, as in 10:200,:,25%:75% or -40:40,:,0:80mm"
    )
