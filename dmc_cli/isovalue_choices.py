"""Read how an isovalue is to be chosen where no number is given: `otsu`, `20%`, `bone`, `band:150:300`.

A choice is a text in the settings; what number it means is known once the volume is read.
"""

import math
from dataclasses import dataclass
from typing import Literal

from dmc_cli.errors import SettingsError

PRESETS = {"bone": 300.0, "soft": -30.0, "fat": -190.0, "skin": -300.0, "lung": -500.0, "air": -900.0}
"""Isovalues in Hounsfield units, the most useful one first: what the tissue and all that is denser has.

Bone is at 300 and above; soft tissue above -30, where fat ends; fat above -190; the skin is half way from
air to tissue on many scanners' reconstructions; lungs end at -500; what is below -900 is air.
"""

MOST_OTSU = 5
"""Isovalues between classes of Otsu's method, at most."""

EXPECTED = (
    "a number, otsu, otsu:N or otsu:N:K, a share of the range of values as in 20%, band:LOW:HIGH, or in"
    f" Hounsfield units {', '.join(PRESETS)}"
)
"""What an isovalue may be, for messages and help texts."""


@dataclass(frozen=True)
class Choice:
    """How an isovalue is chosen.

    Attributes:
        rule: Which way; `default` follows what the volume is.
        name: The preset's name, else the rule's.
        count: Of otsu: how many isovalues part the values into one class more.
        rank: Of otsu: which of them, from 1, counted upwards.
        numbers: The percentage, or the ends of the band.
    """

    rule: Literal["default", "otsu", "percent", "preset", "band"]
    name: str = ""
    count: int = 1
    rank: int = 1
    numbers: tuple[float, ...] = ()


def parse_choice(text: str | None) -> Choice:
    """Return what a text says of how to choose, None standing for the default.

    Raises:
        SettingsError: It is no choice.
    """
    if text is None:
        return Choice("default", "default")
    word = text.strip().lower()
    if word in PRESETS:
        return Choice("preset", word)
    name, *rest = word.split(":")
    if name == "otsu" and len(rest) <= 2:
        return _otsu(text, rest)
    if name == "band" and len(rest) == 2:
        low, high = (_number(part, text) for part in rest)
        if low > high:
            raise SettingsError(f"isovalue is {text!r:.80}; expected band:LOW:HIGH, the lower end first")
        return Choice("band", word, numbers=(low, high))
    if word.endswith("%"):
        share = _number(word[:-1], text)
        if not 0 < share < 100:
            raise SettingsError(f"isovalue is {text!r:.80}; expected a share between 0% and 100%")
        return Choice("percent", word, numbers=(share,))
    raise _no_choice(text)


def is_choice(text: str) -> bool:
    """Return whether a text means to be a choice, right or wrong, and no number."""
    word = text.strip().lower()
    return word in PRESETS or word.endswith("%") or word.split(":")[0] in ("otsu", "band")


def isovalue_text(isovalue: float | str | None) -> str:
    """Return an isovalue as it is told in messages and names of files, before a volume settles it."""
    if isovalue is None:
        return "auto"
    return isovalue if isinstance(isovalue, str) else f"{isovalue:g}"


def _otsu(text: str, rest: list[str]) -> Choice:
    """Return the choice that `otsu`, `otsu:N` and `otsu:N:K` are; without K the uppermost of N isovalues."""
    if not all(part.isdecimal() for part in rest):
        raise _no_choice(text)
    count = int(rest[0]) if rest else 1
    rank = int(rest[1]) if len(rest) == 2 else count
    if not 1 <= rank <= count <= MOST_OTSU:
        raise SettingsError(
            f"isovalue is {text!r:.80}; expected otsu:N:K, the Kth of N isovalues counted upwards, N at most"
            f" {MOST_OTSU}"
        )
    return Choice("otsu", text.strip().lower(), count=count, rank=rank)


def _number(part: str, text: str) -> float:
    """Return a finite number in a choice."""
    try:
        number = float(part)
    except ValueError:
        raise _no_choice(text) from None
    if not math.isfinite(number):
        raise _no_choice(text)
    return number


def _no_choice(text: str) -> SettingsError:
    return SettingsError(f"isovalue is {text!r:.80}; expected {EXPECTED}")
